"""The structure of the code: downward imports, light imports, a docstring in every module."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest
import typer.main

ROOT = Path(__file__).parents[2]
# Files that name public functions: code, pages, and templates of the report's page.
SHOWS_NAMES = (".py", ".md", ".js", ".j2")
HEAVY = ("numba", "pandas", "scipy", "matplotlib", "mcap", "typer", "rich")


def loaded_after(statement: str) -> set[str]:
    code = f"import sys\n{statement}\nprint(*sorted({{name.split('.')[0] for name in sys.modules}}))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    return set(done.stdout.split())


def test_importing_cdtool_loads_nothing_heavy():
    assert not loaded_after("import cdtool") & {*HEAVY, "numpy"}


@pytest.mark.parametrize(
    "module",
    [
        "cdtool.commands.scoring.benchmark",
        "cdtool.detectors.friction_ekf",
        "cdtool.formats.channels.reading",
        "cdtool.report.outputs",
    ],
)
def test_importing_a_module_loads_no_library_that_only_its_use_needs(module):
    assert not loaded_after(f"import {module}") & set(HEAVY)


def test_the_command_line_loads_typer_and_nothing_heavier():
    assert not loaded_after("import cdtool.commands.app") & (set(HEAVY) - {"typer", "rich"})


def test_imports_run_downward():
    pytest.importorskip("importlinter")
    # In a process of its own: import-linter disables all loggers that exist, which tests of warnings need.
    code = "from importlinter.cli import lint_imports; raise SystemExit(lint_imports())"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False, cwd=ROOT)
    assert done.returncode == 0, done.stdout + done.stderr


def test_every_module_has_a_docstring():
    for path in sorted((ROOT / "cdtool").rglob("*.py")):
        assert path.read_text(encoding="utf-8").startswith('"""'), path


def test_the_tests_mirror_the_package():
    """A folder of tests mirrors one of cdtool/, or describes its content in its __init__.py."""
    tests, package = ROOT / "tests", ROOT / "cdtool"
    for file in sorted(tests.rglob("test_*.py")):
        folder = file.parent
        if not (package / folder.relative_to(tests)).is_dir():
            assert (folder / "__init__.py").read_text(encoding="utf-8").startswith('"""'), file
        elif folder == tests:
            tested = package / file.stem.removeprefix("test_")
            assert tested.is_dir() or tested.with_suffix(".py").is_file(), file


def words_of(*folders: Path) -> Counter[str]:
    files = [file for folder in folders for file in sorted(folder.rglob("*")) if file.suffix in SHOWS_NAMES]
    return Counter(word for file in files for word in re.findall(r"\w+", file.read_text(encoding="utf-8")))


def test_public_names_are_used_or_documented_outside_tests():
    code, shown = words_of(ROOT / "cdtool"), words_of(ROOT / "docs", ROOT / "benchmarks")
    shown["emit"] = shown["format_commands"] = 1  # called by logging and click
    for path in sorted((ROOT / "cdtool").rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("_"):
                assert code[node.name] > 1 or shown[node.name], (path, node.name)


def test_the_python_api_names_functions_that_exist_and_every_command_has_one():
    import cdtool
    from cdtool.commands.app import app

    assert all(callable(getattr(cdtool, name)) for name in cdtool.__all__ if name != "__version__")
    members = typer.main.get_command(app).commands.items()  # type: ignore[attr-defined]
    # A command with subcommands has several functions.
    commands = {name.replace("-", "_") for name, command in members if not hasattr(command, "commands")}
    # `report` writes files from the results of `benchmark`; `list` shows the registries, `schema` the models; of
    # `simulate` each machine has a function.
    assert commands - {"report", "list", "schema", "simulate"} <= set(cdtool.__all__)
