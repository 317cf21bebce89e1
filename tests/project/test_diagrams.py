"""The block diagrams: written by their script, valid, described, and without overlapping text."""

from __future__ import annotations

import re
from itertools import combinations
from pathlib import Path
from types import ModuleType
from xml.etree import ElementTree

import matplotlib
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
def test_a_diagram_is_valid_small_and_has_a_text_description(name):
    path = DOCS / "images" / f"{name}.svg"
    root = ElementTree.fromstring(path.read_text(encoding="utf-8"))
    title, description = root.findtext(f"{SVG}title"), root.findtext(f"{SVG}desc")
    assert root.tag == f"{SVG}svg" and title and description and len(description) > 100
    assert path.stat().st_size < 60_000


@pytest.mark.parametrize("name", NAMES)
def test_a_diagram_of_the_docs_matches_its_script(name, made):
    words, formulas = content(made / f"{name}.svg")
    assert words and formulas
    assert content(DOCS / "images" / f"{name}.svg") == (words, formulas)


def test_the_same_script_gives_the_same_bytes(script, made):
    for name in NAMES:
        assert (made / f"{name}.svg").read_text(encoding="utf-8") == script.svg(name)


@pytest.mark.parametrize("name", NAMES)
def test_no_text_leaves_the_sheet_or_overlaps_another(name, script):
    with matplotlib.rc_context(script.STYLE):
        figure = script.diagram(name).figure
        boxes = {item: item.get_window_extent() for item in figure.axes[0].texts if item.get_text()}
    assert len(boxes) > 5
    for item, box in boxes.items():
        inside = figure.bbox.x0 <= box.x0 and box.x1 <= figure.bbox.x1
        assert inside and figure.bbox.y0 <= box.y0 and box.y1 <= figure.bbox.y1, item.get_text()
    for (one, box), (other, other_box) in combinations(boxes.items(), 2):
        assert not box.overlaps(other_box), (one.get_text(), other.get_text())


def test_a_wire_that_is_not_straight_is_an_error(script):
    sheet = script.Diagram(50)
    with pytest.raises(ValueError, match="neither horizontally nor vertically"):
        sheet.wire(sheet.block(20, 10, "one"), sheet.block(60, 40, "two"))
