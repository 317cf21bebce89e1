"""Compiled loops: numba, cached on disk, without the interpreter lock, compiled at the first call.

A module with kernels can be imported without loading numba. Without a writable cache folder (a read-only installation
and a read-only home), kernels are compiled in each process, and a warning is shown once.
"""

from __future__ import annotations

import hashlib
import logging
import os
import re
import sys
import types
import warnings
from collections.abc import Callable, Iterator
from functools import cache, cached_property, update_wrapper
from pathlib import Path
from typing import Any, get_type_hints

import numpy as np
import numpy.typing as npt

# The signature of a read-only array (n,) of float64; writable arrays fit it too.
READ_ONLY = "Array(float64, 1, 'C', readonly=True)"

_FIRST_USE = "first use: compiling kernels, which are stored; this can take a minute or two"
_BYTES = "Array(uint8, 1, 'C', readonly=True)"
_FIELDS: dict[Any, str] = {float: "float64", npt.NDArray[np.float64]: READ_ONLY, npt.NDArray[np.uint8]: _BYTES}


class Kernel:
    """A function that numba compiles on its first call, for its signature only.

    A kernel may call another kernel by a name of its module, imported or not; that one is compiled as a part of it. In
    an `exact` kernel no product is fused with a sum: each operation is rounded, as in numpy.
    """

    def __init__(self, function: Callable[..., Any], signature: str, exact: bool) -> None:
        update_wrapper(self, function)
        self.function, self.signature = function, signature
        self._options: dict[str, Any] = {"nogil": True, "error_model": "numpy", "fastmath": not exact and {"contract"}}

    def __call__(self, *arguments: Any) -> Any:
        """Call the compiled function."""
        return self.compiled(*arguments)

    @cached_property
    def compiled(self) -> Any:
        """Return the compiled function from the cache; compiled and stored there if it is missing or damaged."""
        import numba

        stamp = "_" + hashlib.sha256(b"".join(_taken(self))).hexdigest()[:12]
        function, signature = self._linked(stamp), eval(self.signature, self.function.__globals__ | vars(numba.types))
        try:
            made: Any = numba.njit(cache=True, **self._options)(function)
            if made is function:  # NUMBA_DISABLE_JIT
                return made
            try:
                made.compile(signature)
            except OSError:
                raise
            except Exception:  # what a crash or a full disk left in the cache, which numba reads without a check
                for damaged in Path(made.stats.cache_path).glob(f"*{stamp}-*.nb?"):
                    damaged.unlink()
                made.compile(signature)
        except (RuntimeError, OSError):
            _tell_not_stored()
            made = numba.njit(signature, **self._options)(function)
        if made.stats.cache_misses:
            logging.getLogger(__name__).info(_FIRST_USE)
        made.disable_compile()
        return made

    @cached_property
    def part(self) -> Any:
        """Return the function as a part of other kernels, compiled with them."""
        import numba

        return numba.njit(**self._options | {"no_cpython_wrapper": True})(self._linked(""))

    @property
    def named(self) -> dict[str, Any]:
        """Return what its code and the annotations of its arguments name in its module."""
        names = {*self.function.__code__.co_names, *re.findall(r"\w+", str(self.function.__annotations__))}
        return {name: self.function.__globals__[name] for name in sorted(names & self.function.__globals__.keys())}

    def _linked(self, stamp: str) -> Callable[..., Any]:
        """Return the function as numba compiles it, with kernels in scope; the stamp is a part of its file's name."""
        function = self.function
        parts = {name: value.part for name, value in self.named.items() if isinstance(value, Kernel)}
        linked = types.FunctionType(function.__code__, {**function.__globals__, **parts}, function.__name__)
        linked.__module__, linked.__qualname__ = function.__module__, function.__qualname__ + stamp
        return linked


def kernel(signature: str, *, exact: bool = False) -> Callable[[Callable[..., Any]], Kernel]:
    """Mark a function as a kernel with the given numba signature.

    `exact`: its numbers have the bits of the same formula in numpy; the kernels that it calls must be exact too.
    """
    return lambda function: Kernel(function, signature, exact)


def fields_of(kind: type) -> str:
    """Return the signature of a `NamedTuple` of a kernel's module: numbers, and arrays from `read_only`."""
    hints = get_type_hints(kind).values()
    return f"BaseTuple.from_types([{', '.join(_FIELDS[hint] for hint in hints)}], {kind.__name__})"


def read_only(array: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return the array as required for a named tuple of a kernel's arguments: contiguous and read-only."""
    view = np.ascontiguousarray(array).view()
    view.flags.writeable = False
    return view


def _taken(item: Kernel) -> Iterator[bytes]:
    """Yield its name and what it takes from other files: numba compiles again only if its own file has changed."""
    yield item.function.__qualname__.encode()
    for value in item.named.values():
        if isinstance(value, Kernel | type):
            yield Path(str(sys.modules[value.__module__].__file__)).read_bytes()
        elif isinstance(value, int | float | str):
            yield repr(value).encode()
        if isinstance(value, Kernel):
            yield from _taken(value)


@cache
def _tell_not_stored() -> None:
    where = os.environ.get("NUMBA_CACHE_DIR") or "the folder of cdtool or one below the home folder"
    cure = "every process compiles them. Set NUMBA_CACHE_DIR to a folder that can be written to avoid the wait"
    warnings.warn(f"compiled kernels cannot be stored in {where}: {cure}", stacklevel=4)
