"""The recipes of docs/recipes.md as what they tell to do: files to write, and a line for the table of a room.

As a pytest plug-in, `-p tests.project.recipes`, it installs all of them from the folder in RECIPES.
"""

from __future__ import annotations

import ast
import os
import re
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

from cdtool.base.registry import Registry
from tests.project import pages

PAGE = pages.DOCS / "recipes.md"
_FILE = re.compile(r"`(?P<path>[\w./-]+)`:\n\n```\w+\n(?P<text>.*?)^```$", re.MULTILINE | re.DOTALL)


@dataclass(frozen=True)
class Recipe:
    """A section: the files that it shows, the package whose table it extends, its line in the table, its commands."""

    files: dict[str, str]
    package: str
    name: str
    entry: str | tuple[str, str]
    commands: tuple[str, ...]


def read_recipe(text: str) -> Recipe:
    """The recipe of a section; raises AssertionError where it has no table, or several entries."""
    files = {found["path"]: found["text"] for found in _FILE.finditer(text)}
    ((path, line),) = [(path, files.pop(path)) for path in list(files) if path.endswith("/__init__.py")]
    ((name, entry),) = ast.literal_eval(f"{{{line}}}").items()
    (shell,) = [block["body"] for block in pages.FENCE.finditer(text) if block["kind"] == "bash"]
    package = path.removesuffix("/__init__.py").replace("/", ".")
    return Recipe(files, package, name, entry, tuple(shell.splitlines()))


def read_recipes() -> list[Recipe]:
    """All recipes, in the order of their page."""
    _, *sections = re.split(r"^(?=## Add )", PAGE.read_text(encoding="utf-8"), flags=re.MULTILINE)
    return [read_recipe(section) for section in sections]


def registry_of(recipe: Recipe) -> Registry:
    """The registry that the recipe extends: the only one of its package."""
    (registry,) = (item for item in vars(import_module(recipe.package)).values() if isinstance(item, Registry))
    return registry


def write_files(recipe: Recipe, folder: Path) -> None:
    """Write the files of a recipe below a folder."""
    for path, text in recipe.files.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(text, encoding="utf-8")


def install(recipe: Recipe, folder: Path, patch: pytest.MonkeyPatch) -> None:
    """Make the recipe's module one of its package, written below `folder`, and add its line to the table."""
    package, registry = import_module(recipe.package), registry_of(recipe)
    below = str(folder / recipe.package.replace(".", "/"))
    patch.setattr(package, "__path__", [*package.__path__, below])
    short, target = recipe.entry if isinstance(recipe.entry, tuple) else ("", recipe.entry)
    patch.setitem(registry.table, recipe.name, target)
    if short:
        patch.setitem(registry.short_names, short, recipe.name)
    patch.setattr(pages, "MACHINE_PAGES", [*dict.fromkeys([*pages.MACHINE_PAGES, PAGE])])


def pytest_configure(config: Any) -> None:
    """Install all recipes before the tests are collected, until the end of the run."""
    patch = pytest.MonkeyPatch()
    config.add_cleanup(patch.undo)
    for recipe in read_recipes():
        install(recipe, Path(os.environ["RECIPES"]), patch)
