"""Compiling kernels before work begins, side by side: other processes compile a share each into numba's cache.

Kernels that call the same ones stay together, so that no two processes compile these. No process is started where that
would gain nothing (all in the cache, one core, little to compile) or lead nowhere (no cache folder can be written).
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterable, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

from cdtool.cores import usable_cores
from cdtool.kernels import Kernel, entries, loaded, named

# Time to compile, as bytes of byte code: what every kernel takes, whatever its size; what the start of a process
# takes; and how much there must be for each process.
_ANY_KERNEL = 150
_START = 1000
_WORTH_A_PROCESS = 4000

_CHILD = """
import json, sys
path, kernels = json.loads(sys.argv[1])
sys.path[:] = path
from cdtool.kernel_warm_up import compile_named
compile_named(kernels)
"""


def compile_loaded() -> int:
    """Compile every kernel of the modules imported so far (before workers start); returns how many there are.

    What another process could not compile this one does.
    """
    wanted = entries()
    own, *others = shares(_not_cached(wanted), usable_cores())
    children = [child for share in others if (child := _start(share))]
    try:
        for item in own:
            _ = item.compiled
        for child in children:
            child.wait()
    finally:
        for child in children:
            child.kill()
            child.wait()
    for item in wanted:
        _ = item.compiled
    return len(loaded())


def compile_named(names: Iterable[tuple[str, str]]) -> None:
    """Compile kernels by their modules, which are imported, and names."""
    for module, name in names:
        import_module(module)
        for item in loaded():
            if (item.function.__module__, item.__name__) == (module, name):
                _ = item.compiled


def shares(items: Sequence[Kernel], cores: int) -> list[list[Kernel]]:
    """The kernels that each of at most so many processes compiles, this one's first; evenly, the longest spread first.

    Kernels of plug-ins stay with this process: another one may not be able to import them, or not without side effects.
    """
    own, groups = _groups(items)
    weights = [_weight(group) for group in groups]
    count = 1 + min(cores - 1, int(sum(weights) // _WORTH_A_PROCESS))
    if getattr(sys, "frozen", False) or not sys.executable:  # there is no Python to start
        count = 1
    made = [own, *([] for _ in range(count - 1))]
    loads = [_weight(own), *(_START for _ in range(count - 1))]
    for weight, group in sorted(zip(weights, groups, strict=True), key=lambda each: -each[0]):
        lightest = loads.index(min(loads))
        made[lightest] += group
        loads[lightest] += weight
    return [made[0], *filter(None, made[1:])]


def _groups(items: Sequence[Kernel]) -> tuple[list[Kernel], list[list[Kernel]]]:
    """Those of plug-ins, with what calls the same kernels; and the others, those that call the same ones together."""
    groups: list[tuple[set[Kernel], list[Kernel]]] = []
    for item in items:
        parts, members, apart = _parts(item), [item], []
        for group in groups:
            if parts & group[0]:
                parts |= group[0]
                members += group[1]
            else:
                apart.append(group)
        groups = [*apart, (parts, members)]
    ours = [all(part.function.__module__.startswith("cdtool.") for part in parts) for parts, _ in groups]
    own = [item for mine, (_, members) in zip(ours, groups, strict=True) if not mine for item in members]
    return own, [members for mine, (_, members) in zip(ours, groups, strict=True) if mine]


def _parts(item: Kernel) -> set[Kernel]:
    """A kernel and all that it calls."""
    called = [other for other in item.called.values() if not other.is_instruction]
    return {item}.union(*map(_parts, called))


def _weight(items: Iterable[Kernel]) -> int:
    parts = set().union(*map(_parts, items))
    return sum(_ANY_KERNEL + len(part.function.__code__.co_code) for part in parts)


def _not_cached(items: Iterable[Kernel]) -> list[Kernel]:
    """Return the kernels that are not in numba's cache; none where there is no cache.

    numba has no call that looks into its cache without compiling. What it documents is used instead: the folder
    (`stats.cache_path` of a function that was not compiled yet), and that each function has one index file there,
    `.nbi`, by its name. An index older than the kernel's file or than numba is out of date. A wrong answer costs time,
    never a result: what was taken for cached is compiled by this process.
    """
    import numba

    config: Any = numba.config
    if config.DISABLE_JIT:
        return []
    try:
        return [item for item in items if not _is_cached(item)]
    except (RuntimeError, OSError):  # no folder can be written
        return []


def _is_cached(item: Kernel) -> bool:
    import numba

    function = named(item)
    lazy: Any = numba.njit(cache=True)(function)
    changed = max(Path(file).stat().st_mtime for file in (item.function.__code__.co_filename, numba.__file__))
    # numba leaves the signs < and > out of file names.
    name = function.__qualname__.translate({ord("<"): None, ord(">"): None})
    indices = Path(lazy.stats.cache_path).glob(f"*.{name}-*.nbi")
    return any(index.stat().st_mtime >= changed for index in indices)


def _start(share: Iterable[Kernel]) -> subprocess.Popen[bytes] | None:
    """A process that compiles these kernels; None where none can be started. What it says is of no concern."""
    names = [(item.function.__module__, item.__name__) for item in share]
    task = json.dumps([list(map(str, sys.path)), names])
    silent = subprocess.DEVNULL
    try:
        return subprocess.Popen([sys.executable, "-c", _CHILD, task], stdin=silent, stdout=silent, stderr=silent)
    except OSError:
        return None
