"""docs/architecture.md, CONTRIBUTING.md and the recipes name rooms, files and functions that exist."""

from __future__ import annotations

import re
import sys
from importlib import import_module
from types import CodeType, FrameType
from typing import Any

import pytest

from tests.command import cdtool
from tests.project.pages import DOCS, FENCE, ROOT, docs_script, name_of
from tests.project.recipes import read_recipes

PAGE = DOCS / "architecture.md"
PAGES = [PAGE, ROOT / "CONTRIBUTING.md", DOCS / "recipes.md"]
_DOTTED = re.compile(r"`(cdtool(?:\.\w+)+)(?:\(\))?`")
_PATH = re.compile(r"`((?:cdtool|tests|docs|benchmarks|sample_logs|\.ci)/[\w./-]*)`")


def resolve(dotted: str) -> Any:
    """The module, class or function of a dotted name; raises AttributeError for an unknown name."""
    parts = dotted.split(".")
    for length in range(len(parts), 0, -1):
        try:
            found = import_module(".".join(parts[:length]))
        except ModuleNotFoundError:
            continue
        for name in parts[length:]:
            found = getattr(found, name)
        return found
    raise AttributeError(dotted)


def walk() -> list[str]:
    """The functions in the table of the recording's path, in its order."""
    section = PAGE.read_text(encoding="utf-8").partition("## The path of a recording")[2].partition("\n## ")[0]
    return [name for line in section.splitlines() if line.startswith("| ") for name in _DOTTED.findall(line)]


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_a_page_for_contributors_names_modules_functions_and_files_that_exist(page):
    text = FENCE.sub("", page.read_text(encoding="utf-8"))
    for dotted in _DOTTED.findall(text):
        assert resolve(dotted) is not None
    made = {path for recipe in read_recipes() for path in recipe.files}
    for path in _PATH.findall(text):
        assert path in made or (ROOT / path).exists(), path


def test_the_map_names_every_room_and_the_layers_name_no_other():
    rooms = {room for layer in docs_script("make_layers").read_contract() for room in layer}
    named = re.findall(r"^\| `cdtool/(\w+)(?:/|\.py)` \|", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    assert sorted(named) == sorted(rooms)


def test_a_benchmark_calls_every_function_of_the_recordings_path(tmp_path):
    gate = ROOT / "sample_logs" / "gate"
    (tmp_path / "benchmark.toml").write_text(
        f'''machine = "{gate}/machine.toml"
detectors = ["gm"]
[learn]
logs = ["{gate}/free/*"]
[impacts.stiff]
logs = ["{gate}/stiff/03.csv"]
''',
        encoding="utf-8",
    )
    called = called_by_command("benchmark", tmp_path / "benchmark.toml", "-o", tmp_path / "report.html")
    functions = walk()
    assert len(functions) > 20
    for name in functions:
        assert resolve(name).__code__ in called, name


def called_by_command(*arguments: object) -> set[CodeType]:
    """The code of every function that a command calls in this thread."""
    called: set[CodeType] = set()

    def note(frame: FrameType, event: str, _: object) -> None:
        if event == "call":
            called.add(frame.f_code)

    before = sys.getprofile()
    sys.setprofile(note)
    try:
        done = cdtool(*arguments)
    finally:
        sys.setprofile(before)
    assert done.status == 0, done.err
    return called
