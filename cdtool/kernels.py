"""Compiled loops: numba, cached on disk, without the interpreter lock, compiled at the first call.

A module with kernels can be imported without numba being loaded. Where no cache folder can be written (a read-only
installation and a read-only home), the kernel is recompiled in each process, and a warning says so once.
"""

from __future__ import annotations

import gc
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

# The signature of an array (n,) of float64 that a kernel only reads; writable arrays fit it too.
READ_ONLY = "Array(float64, 1, 'C', readonly=True)"

# The signature of a field of a named tuple by its annotation. Arrays come from `read_only`: inside a tuple numba fits
# no writable array to a type that is read-only.
_FIELDS: dict[Any, str] = {
    float: "float64",
    npt.NDArray[np.float64]: READ_ONLY,
    npt.NDArray[np.uint8]: "Array(uint8, 1, 'C', readonly=True)",
}

_lock = threading.RLock()
_all: list[Kernel] = []
_told = False


class Kernel:
    """A function that numba compiles when it is first called; `signature` fixes its one specialisation.

    The signature may name a `NamedTuple` of the kernel's module, whose fields are numbers (`float`) or arrays (n,) that
    the kernel only reads (`FloatArray`, `StatusArray`, made by `read_only`): arguments then have names.

    A kernel may call another kernel by a name of its module, imported or not: it is linked to the compiled one. What
    kernels call is compiled for them without an entry from Python, which alone takes as long as a small kernel; called
    from Python all the same it is compiled once more, unless `entry` says from the start that it has one.
    """

    def __init__(self, function: Callable[..., Any], signature: str, entry: bool = False) -> None:
        self.function = function
        self.signature = signature
        self.entry = entry
        self.__doc__ = function.__doc__
        self.__name__ = function.__name__
        self._compiled: Callable[..., Any] | None = None
        self._linked: Callable[..., Any] | None = None
        _all.append(self)

    @property
    def compiled(self) -> Callable[..., Any]:
        """The compiled function, compiled or taken from the cache if it was not yet."""
        if self._compiled is None:
            with _lock:
                if self._compiled is None:
                    self._compiled = _compile(self, "", {})
        return self._compiled

    @property
    def linked(self) -> Callable[..., Any]:
        """What other kernels call: as `compiled`, only kernels can call it."""
        if self.entry or self.is_instruction:
            return self.compiled
        with _lock:
            if self._linked is None:
                self._linked = _compile(self, "_linked", {"no_cpython_wrapper": True})
        return self._linked

    @property
    def is_instruction(self) -> bool:
        """Whether it stands for an instruction of the processor: it has no signature, and nothing of it is compiled."""
        return not self.signature

    @property
    def tuples(self) -> dict[str, type]:
        """The named tuples that its signature names, by their names in its module."""
        known = ((name, self.function.__globals__.get(name)) for name in re.findall(r"\w+", self.signature))
        return {name: value for name, value in known if isinstance(value, type) and hasattr(value, "_fields")}

    @property
    def called(self) -> dict[str, Kernel]:
        """The kernels that it calls, by their names in its module."""
        names = self.function.__globals__
        return {name: names[name] for name in self.function.__code__.co_names if isinstance(names.get(name), Kernel)}

    def __call__(self, *arguments: Any) -> Any:
        """Call the compiled function."""
        return (self._compiled or self.compiled)(*arguments)


def kernel(signature: str, *, entry: bool = False) -> Callable[[Callable[..., Any]], Kernel]:
    """Mark a function as a kernel with the given numba signature; `entry`: both Python and kernels call it."""
    return lambda function: Kernel(function, signature, entry)


def read_only(array: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return the array as a named tuple of a kernel's arguments holds it: contiguous, not to be written to."""
    view = np.ascontiguousarray(array).view()
    view.flags.writeable = False
    return view


def entries() -> list[Kernel]:
    """The kernels of the modules imported so far that Python calls: all but those that only kernels call."""
    inner = {item for caller in _all for item in caller.called.values() if not item.entry}
    return [item for item in _all if item not in inner]


def loaded() -> list[Kernel]:
    """All kernels of the modules imported so far."""
    return list(_all)


class _Names(dict[str, Any]):
    """The names that a kernel knows; those of kernels stand for compiled functions.

    They are compiled when the compiler asks for them: never where the caller is in the cache, with all that it calls.
    """

    def __init__(self, names: dict[str, Any], called: dict[str, Kernel]) -> None:
        super().__init__((name, value) for name, value in names.items() if name not in called)
        # An instruction has to be there when its caller begins to be compiled.
        self.update((name, item.compiled) for name, item in called.items() if item.is_instruction)
        self._called = called

    def __missing__(self, name: str) -> Callable[..., Any]:
        return self._called[name].linked


def named(item: Kernel, suffix: str = "") -> Callable[..., Any]:
    """The function that numba compiles: it knows the compiled kernels, and bears the name of its cache file."""
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
    """Return what changes in the name of the cache file with what the kernel takes from other modules.

    numba recompiles a cached function when its own file has changed, but not when one that it imports from has.
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
    """Without garbage collection: looking again and again at all that the compiler made takes an eighth of its time."""
    if not gc.isenabled():
        yield
        return
    gc.disable()
    try:
        yield
    finally:
        gc.enable()


def _signature(item: Kernel) -> Any:
    """Return the signature for numba, which knows the names of its own types alone."""
    from numba import types

    if not item.tuples:
        return item.signature
    names = dict(vars(types))
    kind_of: Any = types.BaseTuple.from_types
    for name, value in item.tuples.items():
        fields = [eval(_FIELDS[hint], vars(types)) for hint in get_type_hints(value).values()]
        names[name] = kind_of(fields, value)
    return eval(item.signature, names)


def _compile(item: Kernel, suffix: str, options: dict[str, Any]) -> Callable[..., Any]:
    import numba

    global _told
    njit: Any = numba.njit
    function, signature = named(item, suffix), _signature(item)
    options = {"nogil": True, "error_model": "numpy", "fastmath": {"contract"}, **options}
    with _no_collection():
        try:
            compiled: Callable[..., Any] = njit(signature, cache=True, **options)(function)
        except (RuntimeError, OSError) as fault:
            if not _told:
                _told = True
                warnings.warn(
                    f"no folder for compiled kernels can be written ({fault}); compiling in every process instead. "
                    "Set NUMBA_CACHE_DIR to a writable folder to avoid the wait.",
                    RuntimeWarning,
                    stacklevel=4,
                )
            compiled = njit(signature, **options)(function)
        return compiled
