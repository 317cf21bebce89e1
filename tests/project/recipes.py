"""The recipes of docs/recipes as what they tell to do: files to write, and a line for the table of a room.

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

FOLDER = pages.DOCS / "recipes"
_FILE = re.compile(r"`(?P<path>[\w./-]+)`:\n\n```\w+\n(?P<text>.*?)^```$", re.MULTILINE | re.DOTALL)


@dataclass(frozen=True)
class Recipe:
    """A page: the files that it shows, the package whose table it extends, its line in the table, and its commands."""

    page: Path
    files: dict[str, str]
    package: str
    name: str
    entry: str | tuple[str, str]
    commands: tuple[str, ...]


def read_recipe(page: Path) -> Recipe:
    """The recipe of a page; raises AssertionError where the page has no table, or several entries."""
    text = page.read_text(encoding="utf-8")
    files = {found["path"]: found["text"] for found in _FILE.finditer(text)}
    ((path, line),) = [(path, files.pop(path)) for path in list(files) if path.endswith("/__init__.py")]
    ((name, entry),) = ast.literal_eval(f"{{{line}}}").items()
    (shell,) = [block["body"] for block in pages.FENCE.finditer(text) if block["kind"] == "bash"]
    package = path.removesuffix("/__init__.py").replace("/", ".")
    return Recipe(page, files, package, name, entry, tuple(shell.splitlines()))


def read_recipes() -> list[Recipe]:
    """All recipes, by the names of their pages."""
    return [read_recipe(page) for page in sorted(FOLDER.glob("*.md")) if page.name != "index.md"]


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
    patch.setattr(pages, "MACHINE_PAGES", [*pages.MACHINE_PAGES, recipe.page])


def pytest_configure(config: Any) -> None:
    """Install all recipes before the tests are collected, until the end of the run."""
    patch = pytest.MonkeyPatch()
    config.add_cleanup(patch.undo)
    for recipe in read_recipes():
        install(recipe, Path(os.environ["RECIPES"]), patch)
