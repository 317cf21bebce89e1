"""The dependencies of pyproject.toml: every import has one, and CI installs lower bounds that are not withdrawn."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from importlib.metadata import packages_distributions
from pathlib import Path

ROOT = Path(__file__).parents[2]
SCRIPT = ROOT / ".ci" / "lowest_versions.py"
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def pins(*extras: str) -> dict[str, str]:
    done = subprocess.run([sys.executable, SCRIPT, *extras], capture_output=True, text=True, check=True)
    return dict(line.split("==") for line in done.stdout.splitlines())


def distribution(requirement: str) -> str:
    return re.match(r"[A-Za-z0-9-]+", requirement)[0]


def test_every_dependency_is_pinned_to_its_lower_bound():
    found = pins()
    assert len(found) == len(PROJECT["dependencies"])
    for text in PROJECT["dependencies"]:
        assert f">={found[distribution(text)]}" in text


def test_extras_and_the_extras_that_they_name_are_pinned_too():
    others = ("all", "test", "dev", "benchmarks", "docs", "s3test", "release")
    named = [name for name in PROJECT["optional-dependencies"] if name not in others]
    of_extras = {distribution(text) for name in named for text in PROJECT["optional-dependencies"][name]}
    assert set(pins("all")) == {distribution(text) for text in PROJECT["dependencies"]} | of_extras


def imports(tree: ast.AST, place: str = "module") -> Iterator[tuple[str, str]]:
    """Yield (top-level module, "module", "function" or "typing") of each import below a node, also by name."""
    for node in ast.iter_child_nodes(tree):
        match node:
            case ast.Import(names=names):
                yield from ((each.name.partition(".")[0], place) for each in names)
            case ast.ImportFrom(module=str(name)):
                yield name.partition(".")[0], place
            case ast.Call(func=ast.Name(id="import_module" | "library"), args=[ast.Constant(value=str(name)), *_]):
                yield name.partition(".")[0], place
        is_function = isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda)
        is_typing = isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"
        yield from imports(node, "typing" if is_typing else "function" if is_function else place)


# A class of an extra's base class: its module is imported in functions only.
IN_FUNCTIONS = "cdtool.base.remote.ranges"


def imported() -> Iterator[tuple[str, str, str]]:
    """Yield (file, distribution, place) of each import of another package in cdtool/."""
    installed = {"pinocchio": ["pin"], **packages_distributions()}  # pin puts it where no record of files names it
    ours = {"cdtool", "_typeshed", *sys.stdlib_module_names}  # _typeshed is known to type checkers alone
    for path in sorted((ROOT / "cdtool").rglob("*.py")):
        text, file = path.read_text(encoding="utf-8"), path.relative_to(ROOT)
        assert not re.search(rf"^from {IN_FUNCTIONS} import", text, re.MULTILINE), f"{file}: import it in a function"
        later = ".".join(file.with_suffix("").parts) == IN_FUNCTIONS
        for name, place in imports(ast.parse(text)):
            if name not in ours:
                yield str(file), installed.get(name, [name])[0].lower(), "function" if later else place


def test_every_import_is_of_a_declared_dependency_and_every_dependency_is_imported():
    required, allowed = (set(map(str.lower, pins(*extras))) for extras in ((), ("all",)))
    found = list(imported())
    assert [each for each in found if each[1] not in (required if each[2] == "module" else allowed)] == []
    assert required == {name for _, name, _ in found} & required
