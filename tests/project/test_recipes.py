"""The recipes: what the page shows can be copied, passes the contract tests and its own, and its commands run."""

from __future__ import annotations

import json
import os
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from cdtool.commands.list_known.command import _KINDS
from tests.command import cdtool
from tests.project.pages import DOCS, ROOT, check_detector_page, docs_script, name_of
from tests.project.recipes import Recipe, install, read_recipes, registry_of, write_files

RECIPES = read_recipes()


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """The files of all recipes."""
    folder = tmp_path_factory.mktemp("recipes")
    for recipe in RECIPES:
        write_files(recipe, folder)
    return folder


@pytest.fixture
def installed(folder, monkeypatch) -> None:
    for recipe in RECIPES:
        install(recipe, folder, monkeypatch)
        module = f"{recipe.package}.{recipe.name}"
        monkeypatch.delitem(sys.modules, module, raising=False)


def test_there_is_a_recipe_for_each_kind_of_class_that_cdtool_lists():
    assert sorted(f"{registry_of(recipe).kind}s" for recipe in RECIPES) == sorted(_KINDS)


@pytest.mark.parametrize("recipe", RECIPES, ids=lambda recipe: recipe.name)
def test_a_recipe_adds_no_file_that_exists_and_tests_it_where_its_tests_belong(recipe: Recipe):
    assert f"{recipe.package.replace('.', '/')}/{recipe.name}.py" in recipe.files
    for path in recipe.files:
        assert not (ROOT / path).exists() and (ROOT / path).parent.is_dir(), path
    for text in (text for path, text in recipe.files.items() if path.endswith(".py")):
        assert max(map(len, text.splitlines())) <= 120
    words = [shlex.split(line) for line in recipe.commands]
    (tests,) = [line[3:] for line in words if line[:3] == ["python", "-m", "pytest"]]
    chosen = tests[-1]
    assert recipe.name in chosen
    for path in (word for word in tests[:-2] if word.startswith("tests/")):
        assert (ROOT / path).exists() or path in recipe.files, path


def test_what_the_recipes_add_passes_the_contract_tests_and_its_own(folder):
    chosen = [recipe.name for recipe in RECIPES] + ["registered_in_a_module_of_its_name", "same_colour"]
    done = subprocess.run(
        [
            *(sys.executable, "-m", "pytest", "-q", "-rN", "-p", "no:cacheprovider", "-n0"),
            *("-c", ROOT / "pyproject.toml", "-p", "tests.project.recipes", "-k", " or ".join(chosen)),
            *("tests/contracts", "tests/project/test_docstrings.py", folder / "tests"),
        ],
        capture_output=True,
        text=True,
        cwd=ROOT,
        env={**os.environ, "RECIPES": str(folder), "PYTHONPATH": str(ROOT), "PYTEST_ADDOPTS": ""},
        check=False,
    )
    assert done.returncode == 0, done.stdout[-5000:]
    assert int(done.stdout.rpartition(" passed")[0].split()[-1].split("\n")[-1]) > 80


@pytest.mark.parametrize("recipe", RECIPES, ids=lambda recipe: recipe.name)
@pytest.mark.usefixtures("installed")
def test_the_commands_of_a_recipe_run_and_name_what_it_adds(recipe: Recipe, tmp_path, monkeypatch):
    (tmp_path / "sample_logs").symlink_to(ROOT / "sample_logs")
    monkeypatch.chdir(tmp_path)
    lines = [shlex.split(line) for line in recipe.commands if line.startswith("cdtool ")]
    (listed,) = [line for line in lines if line[1] == "list"]
    assert recipe.name in cdtool(*listed[1:]).out
    for line in lines:
        logs = sorted(Path("sample_logs/gate/free").iterdir())
        done = cdtool(*(name for word in line[1:] for name in (logs if word.endswith("free/*") else [word])))
        assert done.status == 0 and "Traceback" not in done.err, (line, done.err)


@pytest.mark.usefixtures("installed")
def test_the_lists_of_the_docs_take_up_the_detector_and_the_format(folder, tmp_path, monkeypatch):
    for path in (*DOCS.rglob("*.md"), ROOT / "README.md", ROOT / "pyproject.toml"):
        (tmp_path / name_of(path)).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(path, tmp_path / name_of(path))
    shutil.copytree(folder / "docs", tmp_path / "docs", dirs_exist_ok=True)
    script = docs_script("make_lists")
    monkeypatch.setattr(script, "DOCS", tmp_path / "docs")
    made = {path.name: text for path, text in script.files().items()}
    assert all("[Net force](" in made[name] for name in ("README.md", "index.md"))
    assert "| `f64log` | F64 logs | `.f64` |" in made["containers.md"]
    (detector,) = [
        item for item in json.loads(cdtool("list", "detectors", "--json").out) if item["name"] == "net_force"
    ]
    check_detector_page(detector, (folder / "docs" / "detectors" / "net-force.md").read_text(encoding="utf-8"))
