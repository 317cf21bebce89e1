"""The rules for markers of tests: slow, starting programs, driving a browser, reading real recordings.

* `real_data`: the test names a recording with `needs_data`; it is skipped, by name, if the recording is missing.
* `browser`: the test, one of its fixtures or a function of tests/ that it uses names the module selenium.
* `external`: the same with the module subprocess: the test starts another program, or installs a package.
* `slow`: all cases of the test function together take longer than `BOUND_S` on two idle cores. slow_tests.txt lists
  these functions; `python -m tests.project.slow_tests` writes the list from the measured times of a run.
"""

from __future__ import annotations

import dis
import inspect
import sys
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Any

import pytest

from tests.data_folder import is_present

BOUND_S = 0.4
SLOW_TESTS = Path(__file__).with_name("slow_tests.txt")
ROOT = Path(__file__).parents[1]
MODULES = {"selenium": "browser", "subprocess": "external"}
"""What a test uses -> its marker."""
NOTHING = ModuleType("nothing")


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
    """Return the functions listed as slow, `tests/base/files/test_files.py::test_a_link_stays`."""
    return [line for line in path.read_text(encoding="utf-8").splitlines() if line and not line.startswith("#")]


@cache
def markers_of(module: str, function: str) -> frozenset[str]:
    """Return the markers of a function of an imported module, from the names used by its code and its fixtures."""
    return frozenset(MODULES[name] for name in _reached(module, function))


def _reached(module: str, name: str) -> set[str]:
    """Return the modules of MODULES that a name of a module reaches through functions and fixtures of tests/."""
    found, seen, waiting = set(), set(), [(module, name)]
    while waiting:
        place = waiting.pop()
        names = vars(sys.modules.get(place[0], NOTHING))
        if place in seen or place[1] not in names:
            continue
        seen.add(place)
        value = _unwrapped(names[place[1]])
        home = value.__name__ if isinstance(value, ModuleType) else getattr(value, "__module__", None) or place[0]
        library = home.partition(".")[0]
        if library in MODULES:
            found.add(library)
        elif library == "tests":
            for code in _codes(value):
                found |= _imported(code) & MODULES.keys()
                waiting += _used(code, home)
    return found


def _used(code: CodeType, module: str) -> Iterator[tuple[str, str]]:
    """Yield as (module, name) what a code uses: names of its module, of modules that these are, and fixtures."""
    names = vars(sys.modules[module])
    for name in code.co_names:
        yield module, name
        if isinstance(names.get(name), ModuleType) and names[name].__name__.startswith("tests."):
            yield from ((names[name].__name__, attribute) for attribute in code.co_names)
    parts = module.split(".")[:-1]
    conftests = [".".join([*parts[:count], "conftest"]) for count in range(len(parts), 0, -1)]
    for fixture in code.co_varnames[: code.co_argcount + code.co_kwonlyargcount]:
        yield from ((place, fixture) for place in (module, *conftests))


def _imported(code: CodeType) -> set[str]:
    """Return the libraries that a code imports."""
    if not any(name.partition(".")[0] in MODULES for name in code.co_names):  # nearly always
        return set()
    return {step.argval.partition(".")[0] for step in dis.get_instructions(code) if step.opname == "IMPORT_NAME"}


def _unwrapped(value: Any) -> Any:
    """Return the function within its decorators, fixtures and hypothesis included."""
    value = inspect.unwrap(value) if callable(value) else value
    drawn = getattr(getattr(value, "hypothesis", None), "inner_test", None)
    return value if drawn is None else inspect.unwrap(drawn)


def _codes(value: Any) -> Iterator[CodeType]:
    """Yield the codes of a function or of the methods of a class, those nested in them included."""
    functions = map(_unwrapped, vars(value).values()) if isinstance(value, type) else [value]
    waiting = [function.__code__ for function in functions if isinstance(function, FunctionType)]
    while waiting:
        code = waiting.pop()
        yield code
        waiting += [constant for constant in code.co_consts if isinstance(constant, CodeType)]
