"""benchmarks/structure.py on small generated packages, and on its own generated logs."""

from __future__ import annotations

import importlib
import itertools
from collections.abc import Callable, Mapping
from pathlib import Path
from textwrap import dedent
from types import ModuleType

import numpy as np
import pytest

import cdtool
from tests.project.pages import benchmark_script

_numbers = itertools.count()


@pytest.fixture(scope="module")
def script() -> ModuleType:
    return benchmark_script("structure")


@pytest.fixture
def package(tmp_path: Path) -> Callable[..., Path]:
    """Write a package of files by their paths below it, where PKG stands for its name."""

    def write(files: Mapping[str, str], name: str = "pkg") -> Path:
        root = tmp_path / name
        for file, text in files.items():
            path = root / file
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(dedent(text).replace("PKG", name), encoding="utf-8")
            for folder in (path.parent, *path.parent.parents):
                if folder.is_relative_to(root):
                    (folder / "__init__.py").touch()
        return root

    return write


def imported(script: ModuleType, root: Path) -> set[tuple[str, str, str]]:
    return {(item.importer, item.imported, item.kind) for item in script.imports_of(script.modules_of(root))}


def test_an_import_is_found_at_any_position_in_any_form(script, package):
    root = package(
        {
            "a.py": "from typing import TYPE_CHECKING\nfrom pkg import b\nif TYPE_CHECKING:\n    from pkg.c import C\n",
            "b.py": "import pkg.sub.d\nTABLE = {'c': 'pkg.c:C'}\n",
            "c.py": "def f():\n    from pkg.sub import d, THING\n    importlib.import_module('pkg.a')\n",
            "sub/d.py": "import os\nfrom otherwise import pkg\nTEXT = 'pkg.a'\n",
        }
    )
    assert imported(script, root) == {
        ("pkg.a", "pkg.b", "module"),
        ("pkg.a", "pkg.c", "types"),
        ("pkg.b", "pkg.sub.d", "module"),
        ("pkg.b", "pkg.c", "name"),
        ("pkg.c", "pkg.sub.d", "function"),
        ("pkg.c", "pkg.sub", "function"),  # THING is one of its names
        ("pkg.c", "pkg.a", "function"),
    }


def test_cycles_are_groups_of_modules_that_reach_one_another(script, package):
    root = package(
        {
            "a.py": "from pkg import b\n",
            "b.py": "from pkg import c\n",
            "c.py": "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from pkg import a\n",
            "into.py": "from pkg import a, x\n",
            "x.py": "from pkg import y\n",
            "y.py": "def f():\n    from pkg import x\n",
        }
    )
    imports = script.imports_of(script.modules_of(root))
    assert script.cycles(imports) == [["pkg.a", "pkg.b", "pkg.c"]]
    assert script.cycles(imports, ("module",)) == []
    every = ("module", "types", "function")
    assert script.cycles(imports, every) == [["pkg.a", "pkg.b", "pkg.c"], ["pkg.x", "pkg.y"]]


def test_a_single_caller_is_the_only_one_and_in_the_same_folder(script, package):
    root = package(
        {
            "sub/__init__.py": "from pkg.sub import of_the_package\nTABLE = {'one': 'pkg.sub.registered:One'}\n",
            "sub/of_the_package.py": "def f():\n    from pkg.sub import private\n",
            "sub/private.py": "from pkg.sub import shared\n",
            "sub/registered.py": "from pkg.sub import shared\n",
            "sub/shared.py": "",
            "sub/of_others.py": "",
            "top.py": "from pkg.sub import of_others\nimport pkg.sub\n",
        }
    )
    modules = script.modules_of(root)
    assert script.single_callers(modules, script.imports_of(modules)) == [
        ("pkg.sub", "pkg.sub.of_the_package"),
        ("pkg.sub.of_the_package", "pkg.sub.private"),
    ]


CODE = '''"""What it is.

More of it.
"""

from __future__ import annotations

from typing import (
    TYPE_CHECKING,
    Any,
)

if TYPE_CHECKING:
    import os

# A comment.
TEXT = """one
two"""  # counts twice


class Thing:
    """Documented."""

    value: int = 1
    """So is this."""

    def method(self) -> Any:
        """Return it."""
        import sys

        return (
            self.value,  # and a comment behind code
        )
'''


def test_code_lines_are_neither_docstrings_nor_imports_nor_comments_nor_blank(script, package):
    root = package({"sub/thing.py": CODE, "top.py": "a = 1\n\n# no\nb = 2; c = 3\n"})
    modules = script.modules_of(root)
    assert script.code_lines(modules["pkg.sub.thing"]) == 8
    assert script.lines_by_room(modules) == {"(top level)": (2, 2), "sub": (2, 8)}


def branches(name: str, count: int, decorator: str = "") -> str:
    return f"{decorator}def {name}(x):\n" + "".join(f"    if x == {k}:\n        x += 1\n" for k in range(count))


def test_functions_above_the_limits_are_listed_and_kernels_are_not(script, package):
    pytest.importorskip("ruff")
    eight = ", ".join("abcdefgh")
    text = (
        branches("within", 9)
        + branches("beyond", 12).replace("(x):", "(x):  # noqa: C901")
        + branches("compiled", 12, "@kernel('f8(f8)')\n")
        + branches("also", 12, "@numba.njit\n")
        + f"def seven({eight[:-3]}): ...\ndef eight({eight}): ...\n@njit()\ndef nine({eight}, i): ...\n"
    )
    found = script.excesses(package({"a.py": text}))
    assert [(item.rule, item.size) for item in found] == [("C901", 13), ("PLR0913", 8)]
    assert found[0].place.startswith("pkg/a.py:")


def step(script: ModuleType, caller: str, module: str, function: str = "f") -> object:
    return script.Call(caller, module, function)


def test_a_stay_is_a_change_of_module_and_a_return_is_a_stay_where_one_was_before(script):
    called = [("", "a"), ("a", "b"), ("a", "b"), ("a", "c"), ("c", "c"), ("a", "b"), ("b", "d"), ("d", "d")]
    walk = script.Walk.of([step(script, *names) for names in called], str)
    assert [name for name, _ in walk.stays] == ["a", "b", "c", "b", "d"]
    assert (walk.rooms, walk.returns) == (4, 1)


def test_the_package_of_a_format_is_one_room_and_the_modules_beside_it_are_not(script):
    def room(name: str) -> str:
        return script.room_of(name, "pkg.formats", "pkg.messages")

    assert room("pkg.formats.csv.table") == room("pkg.formats.csv") == "pkg.formats.csv"
    assert room("pkg.formats.mcap.log") == "pkg.formats.mcap"
    assert room("pkg.formats.source") == "pkg.formats.source"
    assert room("pkg.messages.columns.cdr") == room("pkg.messages.fields") == room("pkg.messages") == "pkg.messages"
    assert room("pkg.clock.stamps") == "pkg.clock.stamps" and room("pkg.formats") == "pkg.formats"
    inside = [("", "pkg.a"), ("pkg.a", "pkg.formats.csv"), ("pkg.formats.csv", "pkg.formats.csv.table")]
    back = [("pkg.formats.csv.table", "pkg.clock"), ("pkg.formats.csv", "pkg.formats.csv.table")]
    calls = [step(script, *names) for names in inside + back]
    assert (len(script.Walk.of(calls, room).stays), script.Walk.of(calls, room).returns) == (3, 0)
    assert (len(script.Walk.of(calls, str).stays), script.Walk.of(calls, str).returns) == (5, 1)


READING = {
    "start.py": """
        from PKG import helper, stage, values
        def read():
            made = stage.Stage(helper.of(2))
            total = sum(stage.numbers()) + _private()
            return made, total, method_of().refer()
        def _private():
            return values.public()
        def method_of():
            from PKG.method.machine import Machine
            return Machine()
    """,
    "helper.py": """
        from PKG import values
        def of(count):
            return values.public() + count
    """,
    "stage.py": """
        class Stage:
            def __init__(self, value):
                self.value = (lambda: value)()
        class _Hidden:
            def run(self): ...
        def numbers():
            yield 1
            _Hidden().run()
            yield 2
    """,
    "values.py": "def public(): return 1\n",
    "method/machine.py": """
        from PKG import values
        class Machine:
            def refer(self): return values.public()
    """,
}


@pytest.fixture
def calls(
    script: ModuleType, package: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> Callable[..., list[tuple[str, str, str]]]:
    """The calls made when the package above reads."""

    def record(utility: str = "", method: str = "") -> list[tuple[str, str, str]]:
        root = package(READING, f"made_for_walk_{next(_numbers)}")
        monkeypatch.syspath_prepend(root.parent)
        read, prefix = importlib.import_module(f"{root.name}.start").read, f"{root.name}."
        found = script.calls_of(read, root, [prefix + utility], prefix + method if method else "")
        return [(item.caller.removeprefix(prefix), item.module.removeprefix(prefix), item.function) for item in found]

    return record


def test_public_calls_are_recorded_with_the_module_that_made_them(calls):
    assert calls() == [
        ("", "start", "read"),
        ("start", "helper", "of"),
        ("helper", "values", "public"),
        ("start", "stage", "Stage.__init__"),
        ("start", "stage", "numbers"),
        ("start", "values", "public"),
        ("start", "start", "method_of"),
        ("start", "method.machine", "Machine.refer"),
        ("method.machine", "values", "public"),
    ]


def test_a_utility_is_passed_over_and_the_walk_ends_at_the_method(calls):
    assert calls(utility="helper", method="method") == [
        ("", "start", "read"),
        ("start", "values", "public"),
        ("start", "stage", "Stage.__init__"),
        ("start", "stage", "numbers"),
        ("start", "values", "public"),
        ("start", "start", "method_of"),
    ]


def test_reach_counts_private_functions_and_not_comprehensions(script, package, monkeypatch):
    name = f"made_for_reach_{next(_numbers)}"
    nested = {
        "start.py": """
            from PKG import inner
            def read():
                return [_one(i) for i in range(3)], sum(inner.numbers())
            def _one(i):
                return inner.two(i)
        """,
        "inner.py": """
            def two(i):
                return i
            def numbers():
                yield two(1)
                yield from (two(i) for i in range(2))
        """,
    }
    root = package(nested, name)
    monkeypatch.syspath_prepend(root.parent)
    reach = script.reach_of(importlib.import_module(f"{name}.start").read, root)
    called = [function.removeprefix(f"{name}.") for function in reach.functions]
    assert called == ["start:read", "start:_one", "inner:two", "inner:numbers"]
    assert (reach.modules, reach.depth) == (2, 3)


def test_the_logs_of_the_walk_have_two_clocks_declared_units_and_one_gap(script, tmp_path):
    logs = script.write_logs(tmp_path)
    read = {kind: cdtool.read(log, tmp_path / "machine.toml") for kind, log in logs.items()}
    assert set(read) == {"CSV", "MCAP"}
    for recording in read.values():
        steps = np.diff(recording["torque"].time)
        assert np.count_nonzero(steps > 0.05) == 1
        assert not np.array_equal(recording["torque"].time, recording["force"].time)
        assert np.ptp(np.diff(recording["force"].time)) < 1e-4
    for channel in ("torque", "speed", "force"):
        first, second = (read[kind][channel].values for kind in ("CSV", "MCAP"))
        np.testing.assert_allclose(first, second, rtol=1e-3, atol=1e-3)


def test_what_a_walk_passes_over_is_there_and_has_a_reason(script):
    modules = script.modules_of(script.PACKAGE)
    assert {*script.UTILITIES, script.FORMATS, script.METHOD} <= set(modules)
    assert all(script.UTILITIES.values())
