"""Compiled loops: numba, cached on disk, without the interpreter lock, compiled at the first call.

A module with kernels can be imported without loading numba. Without a writable cache folder (a read-only installation
and a read-only home), kernels are recompiled in each process, and a warning is shown once.
"""

from __future__ import annotations

import gc
import os
import re
import threading
import types
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from enum import EnumType
from pathlib import Path
from typing import Any, get_type_hints

import numpy as np
import numpy.typing as npt

from cdtool.kernel_cache import compile_cached, imported_numba

# The signature of a read-only array (n,) of float64; writable arrays fit it too.
READ_ONLY = "Array(float64, 1, 'C', readonly=True)"

# The signature of a named tuple's field, by its annotation. Arrays come from `read_only`: in a tuple, numba does not
# accept a writable array for a read-only type.
_FIELDS: dict[Any, str] = {
    float: "float64",
    npt.NDArray[np.float64]: READ_ONLY,
    npt.NDArray[np.uint8]: "Array(uint8, 1, 'C', readonly=True)",
}

_lock = threading.RLock()
_all: list[Kernel] = []
_told = False


class Kernel:
    """A function that numba compiles on its first call; `signature` fixes its only specialisation.

    The signature may name a `NamedTuple` of the kernel's module, with numbers (`float`) or read-only arrays (n,) as
    fields (`FloatArray`, `StatusArray`, from `read_only`), so that arguments have names.

    A kernel may call another kernel by a name of its module, imported or not: it is linked to the compiled one. Kernels
    called only by kernels are compiled without an entry from Python, which takes as long to compile as a small kernel.
    If such a kernel is also called from Python, it is compiled again, unless `entry` is set.

    In an `exact` kernel no product is fused with a sum: each operation is rounded, as in numpy.

    A call with arrays takes longer than the reading of a number, as each array is passed as seven words and counted as
    in use: with `inline`, the machine code of a short kernel becomes a part of its callers.
    """

    def __init__(
        self,
        function: Callable[..., Any],
        signature: str,
        *,
        entry: bool = False,
        exact: bool = False,
        inline: bool = False,
    ) -> None:
        self.function = function
        self.signature = signature
        self.entry = entry
        self.exact = exact
        self.inline = inline
        self.__doc__ = function.__doc__
        self.__name__ = function.__name__
        self._compiled: Callable[..., Any] | None = None
        self._linked: Callable[..., Any] | None = None
        _all.append(self)

    @property
    def compiled(self) -> Callable[..., Any]:
        """Return the compiled function; compile it or load it from the cache on first use."""
        if self._compiled is None:
            with _lock:
                if self._compiled is None:
                    self._compiled = _compile(self, "", {})
        return self._compiled

    @property
    def linked(self) -> Callable[..., Any]:
        """Return the function for other kernels: as `compiled`, but callable only from kernels."""
        if self.entry or self.is_instruction:
            return self.compiled
        with _lock:
            if self._linked is None:
                self._linked = _compile(self, "_linked", {"no_cpython_wrapper": True, "forceinline": self.inline})
        return self._linked

    @property
    def is_instruction(self) -> bool:
        """Whether it stands for a processor instruction, without a signature and without anything to compile."""
        return not self.signature

    @property
    def is_ready(self) -> bool:
        """Whether this process has compiled it, or loaded it from the cache."""
        return self._compiled is not None

    @property
    def tuples(self) -> dict[str, type]:
        """Return the named tuples in its signature, by their names in its module."""
        known = ((name, self.function.__globals__.get(name)) for name in re.findall(r"\w+", self.signature))
        return {name: value for name, value in known if isinstance(value, type) and hasattr(value, "_fields")}

    @property
    def called(self) -> dict[str, Kernel]:
        """Return the kernels that it calls, by their names in its module."""
        names = self.function.__globals__
        return {name: names[name] for name in self.function.__code__.co_names if isinstance(names.get(name), Kernel)}

    def __call__(self, *arguments: Any) -> Any:
        """Call the compiled function."""
        return (self._compiled or self.compiled)(*arguments)


def kernel(
    signature: str, *, entry: bool = False, exact: bool = False, inline: bool = False
) -> Callable[[Callable[..., Any]], Kernel]:
    """Mark a function as a kernel with the given numba signature.

    `entry`: both Python and kernels call it. `exact`: its numbers have the bits of the same formula in numpy; the
    kernels that it calls must be exact too. `inline`: its machine code is a part of its callers.
    """
    return lambda function: Kernel(function, signature, entry=entry, exact=exact, inline=inline)


def read_only(array: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return the array as required for a named tuple of a kernel's arguments: contiguous and read-only."""
    view = np.ascontiguousarray(array).view()
    view.flags.writeable = False
    return view


def entries() -> list[Kernel]:
    """Return the kernels of the modules imported so far that Python calls, without those that only kernels call."""
    inner = {item for caller in _all for item in caller.called.values() if not item.entry}
    return [item for item in _all if item not in inner]


def loaded() -> list[Kernel]:
    """Return all kernels of the modules imported so far."""
    return list(_all)


class _Names(dict[str, Any]):
    """The names that a kernel can use; the names of kernels stand for compiled functions.

    They are compiled only when the compiler needs them: not if the caller, with all that it calls, is in the cache.
    """

    def __init__(self, names: dict[str, Any], called: dict[str, Kernel]) -> None:
        super().__init__((name, value) for name, value in names.items() if name not in called)
        # An instruction must exist before its caller is compiled.
        self.update((name, item.compiled) for name, item in called.items() if item.is_instruction)
        self._called = called

    def __missing__(self, name: str) -> Callable[..., Any]:
        return self._called[name].linked


def named(item: Kernel, suffix: str = "") -> Callable[..., Any]:
    """Return the function that numba compiles, with the compiled kernels in scope and the name of its cache file."""
    function, called = item.function, item.called
    made = types.FunctionType(function.__code__, _Names(function.__globals__, called), function.__name__)
    made.__module__, made.__qualname__ = function.__module__, function.__qualname__ + suffix + _stamp(item)
    return made


def _files(item: Kernel) -> set[str]:
    return {item.function.__code__.co_filename}.union(*map(_files, item.called.values()))


def _constants(item: Kernel) -> dict[str, object]:
    """Return the numbers, enumerations and named tuples that a kernel and those it calls read, by module and name."""
    constants: dict[str, object] = {
        f"{value.__module__}.{value.__qualname__}": dict(value.__annotations__) for value in item.tuples.values()
    }
    for name in item.function.__code__.co_names:
        value = item.function.__globals__.get(name)
        if isinstance(value, EnumType):
            value = {member.name: member.value for member in value}  # type: ignore[var-annotated]
        elif not isinstance(value, int | float | str):
            continue
        constants[f"{item.function.__module__}.{name}"] = value
    for other in item.called.values():
        constants |= _constants(other)
    return constants


def _stamp(item: Kernel) -> str:
    """Return the part of the cache file's name that depends on what the kernel takes from other modules.

    numba recompiles a cached function if its own file has changed, but not if an imported one has.
    """
    import hashlib

    others = sorted(_files(item) - {item.function.__code__.co_filename})
    constants = _constants(item)
    if not others and not constants:
        return ""
    parts = [Path(file).read_bytes() for file in others] + [repr(sorted(constants.items())).encode()]
    return "_" + hashlib.sha256(b"".join(parts)).hexdigest()[:12]


@contextmanager
def _no_collection() -> Iterator[None]:
    """Disable garbage collection, which takes an eighth of the compile time."""
    if not gc.isenabled():
        yield
        return
    gc.disable()
    try:
        yield
    finally:
        gc.enable()


def _signature(item: Kernel) -> Any:
    """Return the signature for numba, with numba's own type names only."""
    from numba import types

    if not item.tuples:
        return item.signature
    names = dict(vars(types))
    kind_of: Any = types.BaseTuple.from_types
    for name, value in item.tuples.items():
        fields = [eval(_FIELDS[hint], vars(types)) for hint in get_type_hints(value).values()]
        names[name] = kind_of(fields, value)
    return eval(item.signature, names)


def _why_not_stored(fault: Exception) -> str:
    """Return which folders cannot be written; numba names only the file of the kernel."""
    if isinstance(fault, OSError):
        return str(fault)
    folder = os.environ.get("NUMBA_CACHE_DIR")
    return f"NUMBA_CACHE_DIR = {folder}" if folder else "neither that of cdtool nor one below the home folder"


def _compile(item: Kernel, suffix: str, options: dict[str, Any]) -> Callable[..., Any]:
    global _told
    with _no_collection():
        numba = imported_numba()
        function, signature = named(item, suffix), _signature(item)
        fused: set[str] | bool = False if item.exact else {"contract"}
        options = {"nogil": True, "error_model": "numpy", "fastmath": fused, **options}
        try:
            return compile_cached(function, signature, options)
        except (RuntimeError, OSError) as fault:
            if not _told:
                _told = True
                warnings.warn(
                    f"no writable folder for compiled kernels ({_why_not_stored(fault)}); they are compiled in every "
                    "process. Set NUMBA_CACHE_DIR to a writable folder to avoid the wait.",
                    UserWarning,
                    stacklevel=4,
                )
            compiled: Callable[..., Any] = numba.njit(signature, **options)(function)
        return compiled
