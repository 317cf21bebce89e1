"""The rules for markers of tests: slow, starting programs, driving a browser, reading real recordings.

* `real_data`: the test names a recording with `needs_data`; it is skipped, by name, if the recording is missing.
* `browser`: the test, one of its fixtures or a function of tests/ that it uses names the module selenium.
* `external`: the same with the module subprocess: the test starts another program, or installs a package.
* `slow`: all cases of the test function together take longer than `BOUND_S` on two idle cores. slow_tests.txt lists
  these functions; `python -m tests.project.slow_tests` writes the list from the measured times of a run.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import pytest

from tests.data_folder import is_present

BOUND_S = 0.5
SLOW_TESTS = Path(__file__).with_name("slow_tests.txt")
ROOT = Path(__file__).parents[1]
MODULES = {"selenium": "browser", "subprocess": "external"}
"""What a test uses -> its marker."""


def mark(items: Iterable[pytest.Item]) -> None:
    """Add its markers to each collected test."""
    slow = set(slow_tests())
    for item in items:
        for absent in (name for found in item.iter_markers("real_data") for name in found.args if not is_present(name)):
            item.add_marker(pytest.mark.skip(reason=f"no recording {absent} (set CDTOOL_DATA)"))
        if isinstance(item, pytest.Function):
            for marker in sorted(markers_of(item.module.__name__, item.function.__name__)):
                item.add_marker(marker)
        if item.nodeid.partition("[")[0] in slow:
            item.add_marker("slow")


def slow_tests(path: Path = SLOW_TESTS) -> list[str]:
    """Return the functions listed as slow, `tests/test_files.py::test_a_link_stays`."""
    return [line for line in path.read_text(encoding="utf-8").splitlines() if line and not line.startswith("#")]


@cache
def markers_of(module: str, function: str) -> frozenset[str]:
    """Return the markers of a test function from the names used by it, its fixtures and the functions of tests/."""
    if not _relevant().intersection([module, *_conftests(module)]):
        return frozenset()
    return frozenset(MODULES[name] for name in _reached(module, function) if name in MODULES)


@cache
def _relevant() -> set[str]:
    """Return the modules of tests/ that name one of `MODULES`, directly or through another module."""
    texts = {
        ".".join(file.relative_to(ROOT).with_suffix("").parts): file.read_text(encoding="utf-8")
        for file in Path(__file__).parent.rglob("*.py")
    }
    del texts[__name__]
    found, words = set(), set(MODULES)
    while words:
        named = re.compile(rf"\b({'|'.join(words)})\b")
        new = {module for module, text in texts.items() if module not in found and named.search(text)}
        found, words = found | new, {module.rpartition(".")[2] for module in new}
    return found


def _reached(module: str, name: str) -> set[str]:
    """Return the names of modules outside tests/ that a name of a module reaches."""
    found, seen, waiting = set(), set(), [(module, name)]
    while waiting:
        place = waiting.pop()
        if place in seen:
            continue
        seen.add(place)
        text = _names(place[0])
        found |= text.outside.get(place[1], set())
        waiting += [(place[0], used) for used in text.uses.get(place[1], ())]
        if place[1] in text.imported:
            imported = text.imported[place[1]]
            whole = ".".join(imported)
            waiting += [imported] if _file(whole) is None else [(whole, used) for used in _names(whole).uses]
        elif place[1] not in text.uses:
            waiting += [(conftest, place[1]) for conftest in _conftests(place[0])]
    return found


@dataclass(frozen=True)
class _Names:
    """Return the names of a module: the names that each definition uses, and its imports."""

    uses: Mapping[str, set[str]] = field(default_factory=dict)
    outside: Mapping[str, set[str]] = field(default_factory=dict)
    imported: Mapping[str, tuple[str, str]] = field(default_factory=dict)


@cache
def _names(module: str) -> _Names:
    file = _file(module)
    if file is None:
        return _Names()
    uses: dict[str, set[str]] = {}
    outside: dict[str, set[str]] = {}
    imported: dict[str, tuple[str, str]] = {}
    for node in ast.parse(file.read_text(encoding="utf-8")).body:
        names, stored, imports = _parts(node)
        libraries = {(base or name).partition(".")[0] for base, name, _ in imports}
        imported |= {known: (base, name) for base, name, known in imports if base.startswith("tests")}
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            stored = {node.name}
        elif isinstance(node, ast.ImportFrom | ast.Import):
            stored = {known for _, _, known in imports}
        for defined in stored:
            uses.setdefault(defined, set()).update(names)
            outside.setdefault(defined, set()).update(libraries)
    return _Names(uses, outside, imported)


def _parts(node: ast.stmt) -> tuple[set[str], set[str], list[tuple[str, str, str]]]:
    """Return the names a statement uses (a parameter is a fixture), the names it binds, and (from, name, as)."""
    names, stored, imports = set(), set(), []
    for part in ast.walk(node):
        if isinstance(part, ast.Name):
            (stored if isinstance(part.ctx, ast.Store) else names).add(part.id)
        elif isinstance(part, ast.arg):
            names.add(part.arg)
        elif isinstance(part, ast.ImportFrom | ast.Import):
            base = getattr(part, "module", None) or ""
            imports += [(base, item.name, (item.asname or item.name).partition(".")[0]) for item in part.names]
    return names, stored, imports


def _file(module: str) -> Path | None:
    """Return the file of a module of tests/; a package's is empty, and modules outside tests/ are not searched."""
    file = ROOT.joinpath(*module.split(".")).with_suffix(".py")
    return file if file.is_file() else None


def _conftests(module: str) -> list[str]:
    """Return the conftest modules that apply to a module, the nearest first."""
    parts = module.split(".")[:-1]
    return [".".join([*parts[:count], "conftest"]) for count in range(len(parts), 0, -1)]
