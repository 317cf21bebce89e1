"""numba's cache of compiled kernels: what is in it, loading without the compiler, one process at a time that compiles.

Before numba looks into its cache, it prepares its compiler: 130 modules and scipy.linalg, which take a quarter of the
time of a short command. Machine code from the cache needs only numba's runtime: the compiler is prepared when a kernel
must be compiled. This uses three names that numba does not document (a dispatcher's `_cache`, `runtime.rtsys`,
`context.refresh`); a version of numba without them loads kernels in its own way.
"""

from __future__ import annotations

import logging
import os
import sys
from collections.abc import Callable, Iterable
from contextlib import ExitStack, suppress
from functools import cache
from pathlib import Path
from typing import Any

from cdtool.errors import OutputError, UsageError

# A function as numba compiles it: `cdtool.kernels.named`.
Function = Callable[..., Any]

_logger = logging.getLogger(__name__)
_reported = False

before_compiling: list[Callable[[], object]] = []
"""Called once, before this process compiles its first kernel: a command compiles those of other commands with it."""


@cache
def imported_numba() -> Any:
    """Return numba, imported without the package coverage: numba reports to it only while coverage runs.

    Raises UsageError if NUMBA_DISABLE_JIT is set: the kernels use instructions that Python does not have.
    """
    hidden = "coverage" not in sys.modules
    if hidden:
        sys.modules["coverage"] = None  # type: ignore[assignment]  # the import system's mark of an absent module
    try:
        import numba
    finally:
        if hidden:
            del sys.modules["coverage"]
    imported: Any = numba
    if imported.config.DISABLE_JIT:
        raise UsageError("NUMBA_DISABLE_JIT is set, but cdtool's kernels must be compiled", "unset it")
    return imported


def compile_cached(function: Function, signature: Any, options: dict[str, Any]) -> Function:
    """Return the compiled function, from the cache or compiled and stored there.

    Raises RuntimeError or OSError if no folder for the cache is writable.
    """
    compiled: Function = imported_numba().njit(cache=True, **options)(function)
    dispatcher: Any = compiled
    with ExitStack() as held:
        own = getattr(dispatcher, "_cache", None)
        if hasattr(own, "load_overload"):
            dispatcher._cache = _SharedCache(own, function, held)
        dispatcher.compile(signature)
    dispatcher.disable_compile()
    return compiled


def report_compilation(count: int = 0) -> None:
    """Log, once per process, that kernels are compiled; `count`: how many, if known.

    The first one takes more than a second: numba prepares its compiler for it.
    """
    global _reported
    if not _reported:
        _reported = True
        kernels = f"{count} kernels" if count > 1 else "kernels"
        _logger.info(
            "first use: compiling %s, which can take a minute or two; later commands load them from the cache", kernels
        )


def report_progress(line: str) -> None:
    """Log how far the compilation is, in place of the line before; an empty line at its end."""
    _logger.debug(line)


class _SharedCache:
    """numba's cache of one function, where only one process at a time compiles what is missing.

    Other processes wait for it, then load what it has compiled. The lock is entered into `held`, and ends with its
    process; without locks on the file system, and after a minute, the function is compiled without it.
    """

    def __init__(self, cache: Any, function: Function, held: ExitStack) -> None:
        self._cache = cache
        self._function = function
        self._held = held

    def __getattr__(self, name: str) -> Any:
        return getattr(self._cache, name)

    def load_overload(self, signature: Any, context: Any) -> Any:
        """Return the compiled function from the cache; None if this process is to compile it."""
        loaded = self._load(signature, context)
        if loaded is None:
            while before_compiling:
                before_compiling.pop()()
            report_compilation()
            from cdtool.file_locks import holding

            folder = Path(self._cache.cache_path)
            target = folder / _name(self._function)
            with suppress(OSError, OutputError):
                self._held.enter_context(holding(target, folder, target))
                loaded = self._load(signature, context)
        return loaded

    def _load(self, signature: Any, context: Any) -> Any:
        """Load without the compiler, except for a kernel of a plug-in, which may call what the compiler provides."""
        from numba.core import runtime

        started = getattr(vars(runtime).get("rtsys"), "initialize", None)
        is_own = self._function.__module__.startswith("cdtool.")
        if not is_own or started is None or not hasattr(context, "refresh"):
            return self._cache.load_overload(signature, context)
        started(context)
        context.refresh = lambda: None  # in place of the method that prepares the compiler
        try:
            return self._cache.load_overload(signature, context)
        finally:
            del context.refresh


def not_cached(functions: Iterable[Function]) -> list[Function]:
    """Return the functions that are not in the cache; empty without a cache.

    numba cannot query its cache without loading from it. This uses documented facts instead: the folder
    (`stats.cache_path` of a function that is not compiled yet), and one index file `.nbi` per function, named after it.
    An index older than the function's file or than numba is outdated. A wrong answer costs only time.
    """
    numba = imported_numba()
    folders: dict[str, dict[str, float]] = {}
    missing = []
    for function in functions:
        sources = os.path.dirname(_file(function))  # noqa: PTH120 - for every kernel
        if sources not in folders:
            try:
                folders[sources] = _indices(Path(numba.njit(cache=True)(function).stats.cache_path))
            except (RuntimeError, OSError):  # no writable folder
                return []
        changed = max(os.stat(file).st_mtime for file in (_file(function), numba.__file__))  # noqa: PTH116
        if folders[sources].get(_name(function), 0.0) < changed:
            missing.append(function)
    return missing


def mark_current(functions: Iterable[Function]) -> None:
    """Date the indices of cached functions now: an upgrade that left a file as it was made its functions look outdated.

    numba, which compares the content of the file, keeps such an index as it is.
    """
    for function in functions:
        folder = Path(imported_numba().njit(cache=True)(function).stats.cache_path)
        with suppress(OSError):
            for index in folder.glob(f"{_name(function)}-*.nbi"):
                index.touch()


def _indices(folder: Path) -> dict[str, float]:
    """Return when each index of a cache folder was written, by function: its name ends in line and Python version."""
    written: dict[str, float] = {}
    with os.scandir(folder) as entries:
        for entry in entries:
            if entry.name.endswith(".nbi"):
                name = entry.name.rpartition("-")[0]
                written[name] = max(written.get(name, 0.0), entry.stat().st_mtime)
    return written


def _name(function: Function) -> str:
    # numba removes the signs < and > from file names.
    return f"{Path(_file(function)).stem}.{function.__qualname__.translate({ord('<'): None, ord('>'): None})}"


def _file(function: Function) -> str:
    file: str = function.__code__.co_filename
    return file
