"""The block diagrams: written by their script, valid, described, and without overlapping text."""

from __future__ import annotations

import re
from pathlib import Path
from types import ModuleType
from xml.etree import ElementTree

import pytest

from tests.project.pages import DOCS, docs_script

SVG = "{http://www.w3.org/2000/svg}"
# docs/make_layers.py draws the layers, see test_layers.py.
NAMES = sorted(path.stem for path in (DOCS / "images").glob("*.svg") if path.stem != "layers")


@pytest.fixture(scope="module")
def script() -> ModuleType:
    """docs/make_diagrams.py with the drawings of make_impact_diagrams.py."""
    diagrams = docs_script("make_diagrams")
    docs_script("make_impact_diagrams")
    return diagrams


@pytest.fixture(scope="module")
def made(script, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("diagrams")
    assert script.main(folder) == 0
    return folder


def content(path: Path) -> tuple[list[str], list[str]]:
    """Return the words and formulas of a drawing, which are the same in all versions of matplotlib."""
    text = path.read_text(encoding="utf-8")
    words = [element.text or "" for element in ElementTree.fromstring(text).iter(f"{SVG}text")]
    return words, re.findall(r"<!-- (\$.*?\$) -->", text)


def test_the_scripts_make_exactly_the_diagrams_of_the_docs(made):
    assert NAMES and sorted(path.stem for path in made.glob("*.svg")) == NAMES


@pytest.mark.parametrize("name", NAMES)
def test_a_diagram_of_the_docs_matches_its_script(name, made):
    words, formulas = content(made / f"{name}.svg")
    assert words and formulas
    assert content(DOCS / "images" / f"{name}.svg") == (words, formulas)
