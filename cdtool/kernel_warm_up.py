"""Compile all kernels of the package in one wait, in parallel: other processes each compile a share into the cache.

Kernels that call the same kernels stay together, so that no two processes compile these. No process is started if it
would save nothing (all in the cache, one core, little to compile) or cannot help (no writable cache folder).
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections.abc import Iterable, Sequence
from importlib import import_module
from pathlib import Path

from cdtool.cores import usable_cores
from cdtool.kernel_cache import before_compiling, mark_current, not_cached, report_compilation, report_progress
from cdtool.kernels import Kernel, entries, loaded, named

# Compile time, in bytes of byte code: fixed cost of a kernel; cost of starting a process; and the minimum work per
# process.
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


def compile_package() -> int:
    """If a kernel of the modules imported so far is `missing`, compile all that the package misses; return how many.

    Later commands then find theirs in the cache. Kernels that another process failed to compile are compiled by this
    one.
    """
    before_compiling.clear()
    if not missing():
        return 0
    import_kernels()
    absent = missing()
    report_compilation(len(absent))
    own, *others = shares(absent, usable_cores())
    begin, children = time.monotonic(), [child for share in others if (child := _start(share))]
    try:
        for item in own:
            _ = item.compiled
            _report(absent, begin)
        while any(child.poll() is None for child in children):
            time.sleep(0.2)
            _report(absent, begin)
    finally:
        report_progress("")
        for child in children:
            child.kill()
            child.wait()
    for item in (outdated := _not_cached(absent)):
        _ = item.compiled
    mark_current(map(named, outdated))
    return len(absent)


def _report(absent: Iterable[Kernel], begin: float) -> None:
    done = 1.0 - _weight(_not_cached(absent)) / _weight(absent)
    left = (time.monotonic() - begin) * (1.0 / done - 1.0) if done > 0.0 else 0.0
    report_progress(f"{done:.0%}, about {left:.0f} s left" if left else "")


def import_kernels() -> None:
    """Import the modules of the package that define kernels: those with `@kernel(` in their text."""
    package = Path(__file__).parent
    for path in sorted(package.rglob("*.py")):
        if "\n@kernel(" in path.read_text(encoding="utf-8"):
            import_module(".".join([package.name, *path.relative_to(package).with_suffix("").parts]))


def missing() -> list[Kernel]:
    """Return the kernels of the modules imported so far that are not in the cache; none without a cache."""
    return _not_cached(item for item in entries() if not item.is_ready and not item.is_instruction)


def compile_named(names: Iterable[tuple[str, str]]) -> None:
    """Import the modules of kernels and compile the kernels by name."""
    for module, name in names:
        import_module(module)
        for item in loaded():
            if (item.function.__module__, item.__name__) == (module, name):
                _ = item.compiled


def shares(items: Sequence[Kernel], cores: int) -> list[list[Kernel]]:
    """Return the kernels for each of at most `cores` processes, this one's first; balanced, the longest first.

    Kernels of plug-ins stay with this process: another one may be unable to import them, or only with side effects.
    """
    own, groups = _groups(items)
    weights = [_weight(group) for group in groups]
    count = 1 + min(cores - 1, int(sum(weights) // _WORTH_A_PROCESS))
    if getattr(sys, "frozen", False) or not sys.executable:  # no Python executable to start
        count = 1
    made = [own, *([] for _ in range(count - 1))]
    loads = [_weight(own), *(_START for _ in range(count - 1))]
    for weight, group in sorted(zip(weights, groups, strict=True), key=lambda each: -each[0]):
        lightest = loads.index(min(loads))
        made[lightest] += group
        loads[lightest] += weight
    return [made[0], *filter(None, made[1:])]


def _groups(items: Sequence[Kernel]) -> tuple[list[Kernel], list[list[Kernel]]]:
    """Return the kernels of plug-ins and of those that share kernels with them; and groups of the others that do."""
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
    """Return a kernel and all kernels that it calls."""
    called = [other for other in item.called.values() if not other.is_instruction]
    return {item}.union(*map(_parts, called))


def _weight(items: Iterable[Kernel]) -> int:
    parts = set().union(*map(_parts, items))
    return sum(_ANY_KERNEL + len(part.function.__code__.co_code) for part in parts)


def _not_cached(items: Iterable[Kernel]) -> list[Kernel]:
    """Return the kernels that are not in numba's cache; empty without a cache."""
    functions = {named(item): item for item in items}
    return [functions[function] for function in not_cached(functions)]


def _start(share: Iterable[Kernel]) -> subprocess.Popen[bytes] | None:
    """Start a process that compiles these kernels; return None if none can be started. Its output is ignored."""
    names = [(item.function.__module__, item.__name__) for item in share]
    task = json.dumps([list(map(str, sys.path)), names])
    silent = subprocess.DEVNULL
    try:
        return subprocess.Popen([sys.executable, "-c", _CHILD, task], stdin=silent, stdout=silent, stderr=silent)
    except OSError:
        return None
