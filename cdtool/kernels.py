"""Compiled loops: numba, cached on disk, without the interpreter lock, compiled at the first call.

A module with kernels can be imported without numba being loaded. Where no cache folder can be written (a read-only
installation and a read-only home), the kernel is compiled anew in each process, and a warning says so once.
"""

from __future__ import annotations

import threading
import types
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

# The signature of an array (n,) of float64 that a kernel only reads; writable arrays fit it too.
READ_ONLY = "Array(float64, 1, 'C', readonly=True)"

_lock = threading.RLock()
_all: list[Kernel] = []
_told = False


class Kernel:
    """A function that numba compiles when it is first called; `signature` fixes its one specialisation.

    A kernel may call another kernel by a name of its module, imported or not: it is linked to the compiled one.
    """

    def __init__(self, function: Callable[..., Any], signature: str) -> None:
        self.function = function
        self.signature = signature
        self.__doc__ = function.__doc__
        self.__name__ = function.__name__
        self._compiled: Callable[..., Any] | None = None
        _all.append(self)

    @property
    def compiled(self) -> Callable[..., Any]:
        """The compiled function, compiled or taken from the cache if it was not yet."""
        if self._compiled is None:
            with _lock:
                if self._compiled is None:
                    self._compiled = _compile(self.function, self.signature)
        return self._compiled

    def __call__(self, *arguments: Any) -> Any:
        """Call the compiled function."""
        return (self._compiled or self.compiled)(*arguments)


def kernel(signature: str) -> Callable[[Callable[..., Any]], Kernel]:
    """Mark a function as a kernel with the given numba signature."""
    return lambda function: Kernel(function, signature)


def compile_loaded() -> int:
    """Compile every kernel of the modules imported so far (before workers start); returns how many there are."""
    for item in _all:
        _ = item.compiled
    return len(_all)


def _linked(function: Callable[..., Any]) -> Callable[..., Any]:
    called = _called(function)
    if not called:
        return function
    names = function.__globals__ | {name: item.compiled for name, item in called.items()}
    linked = types.FunctionType(function.__code__, names, function.__name__)
    linked.__module__, linked.__qualname__ = function.__module__, function.__qualname__ + _stamp(function)
    return linked


def _called(function: Callable[..., Any]) -> dict[str, Kernel]:
    names = function.__globals__
    return {name: names[name] for name in function.__code__.co_names if isinstance(names.get(name), Kernel)}


def _files(function: Callable[..., Any]) -> set[str]:
    return {function.__code__.co_filename}.union(*(_files(item.function) for item in _called(function).values()))


def _stamp(function: Callable[..., Any]) -> str:
    import hashlib

    # numba compiles a cached function anew when its own file has changed; the files of what it calls go into its name.
    others = sorted(_files(function) - {function.__code__.co_filename})
    if not others:
        return ""
    return "_" + hashlib.sha256(b"".join(Path(file).read_bytes() for file in others)).hexdigest()[:12]


def _compile(function: Callable[..., Any], signature: str) -> Callable[..., Any]:
    from numba import njit

    global _told
    function = _linked(function)
    try:
        return njit(signature, cache=True, nogil=True, error_model="numpy", fastmath={"contract"})(function)
    except (RuntimeError, OSError) as fault:
        if not _told:
            _told = True
            warnings.warn(
                f"no folder for compiled kernels can be written ({fault}); compiling in every process instead. "
                "Set NUMBA_CACHE_DIR to a writable folder to avoid the wait.",
                RuntimeWarning,
                stacklevel=4,
            )
        return njit(signature, nogil=True, error_model="numpy", fastmath={"contract"})(function)
