"""What a notebook prints for a value: one short line, and for the results a small table."""

from __future__ import annotations

import ast
import dataclasses
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

import cdtool
from cdtool.recordings.recording import Recording, Series
from tests.commands.notebook.values import GATE, LOG, MACHINE, is_plain_row, returned_values, values_in

# Rooms with values that no function of the API returns.
INTERNAL = (
    "formats",
    "machines/robot_model",
    "machines/axis_model",
    "commands/simulate",
    "commands/inject",
    "report",
    "recordings/clock",
)
LONGEST = 200


@pytest.fixture(scope="module")
def returned(tmp_path_factory):
    return returned_values(tmp_path_factory.mktemp("returned"))


def faults_of(value: object) -> str:
    text = repr(value)
    if "array(" in text or "\n" in text:
        return f"{type(value).__name__}: {text[:80]}"
    return f"{type(value).__name__}: {len(text)} characters" if len(text) > LONGEST else ""


def test_the_repr_of_everything_that_a_function_returns_is_one_short_line(returned):
    seen: dict[int, object] = {}
    kinds, faults = set(), set()
    for value in returned.values():
        faults.add(faults_of(value))
        for inner in values_in(value, seen):
            kinds.add(type(inner))
            if not is_plain_row(inner):
                faults.add(faults_of(inner))
    assert len(kinds) > 80
    assert not {fault for fault in faults if fault}


def test_every_value_with_arrays_has_a_short_repr():
    package = Path(cdtool.__file__).parent
    without = []
    for path in sorted(package.rglob("*.py")):
        if any(path.is_relative_to(package / room) for room in INTERNAL):
            continue
        text = path.read_text(encoding="utf-8")
        if "Array" not in text and "ndarray" not in text:
            continue
        for node in ast.walk(ast.parse(text)):
            if not isinstance(node, ast.ClassDef) or not any(
                "dataclass" in ast.unparse(d) for d in node.decorator_list
            ):
                continue
            types = [ast.unparse(item.annotation) for item in node.body if isinstance(item, ast.AnnAssign)]
            names = {
                ast.unparse(target) for item in node.body if isinstance(item, ast.Assign) for target in item.targets
            }
            if any("Array" in text or "ndarray" in text for text in types) and "__repr__" not in names:
                without.append(f"{path.name}: {node.name}")
    assert not without, "add `__repr__ = short_repr`"


def test_a_value_with_an_array_is_found():
    @dataclasses.dataclass
    class Curve:
        values: np.ndarray

    assert faults_of(Curve(np.zeros(3)))


def test_the_repr_of_the_main_values_says_what_they_are(returned):
    assert repr(returned["benchmark"]) == (
        f"BenchmarkResult(2 detectors, 3 groups, 12 recordings: {returned['benchmark'].headline})"
    )
    assert repr(returned["detect"]) == "DetectionResult(03.csv, friction_ekf: alarm, 1 alarm, 1 contact)"
    assert repr(returned["detect of many"]) == "DetectionResults(2 logs, friction_ekf: 1 alarm)"
    assert repr(returned["read"]["speed"]) == "Series(time=<7200 floats>, values=<7200 x 1 floats>, unit='m/s')"


class Tables(HTMLParser):
    """The texts of a table's captions and cells, and whether its elements are closed in order."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.captions, self.scopes, self.cells = [], [], 0
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        self.open.append(tag)
        self.scopes += [dict(attributes).get("scope")] if tag == "th" else []
        self.cells += tag == "td"

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, text):
        if self.open and self.open[-1] == "caption":
            self.captions.append(text)


@pytest.mark.parametrize("name", ["read", "learn_signature", "detect", "detect of many", "benchmark", "score"])
def test_a_notebook_shows_a_small_table_with_caption_and_headings(returned, name):
    text = returned[name]._repr_html_()
    table = Tables(text)
    assert not table.open and len(table.captions) == 1 and table.cells
    assert set(table.scopes) == {"col", "row"}
    assert len(text) < 6000


def test_text_from_files_is_escaped_in_a_notebook():
    time = np.arange(3.0)
    hostile = Recording("<script>alert(1)</script>", "", ("<b>",), {"speed": Series(time, time, "<i>")})
    assert "<script>" not in hostile._repr_html_() and "<b>" not in hostile._repr_html_()
    assert "&lt;script&gt;" in hostile._repr_html_()


def test_a_long_table_is_cut_and_says_so():
    found = cdtool.detect([LOG] * 25, MACHINE, detector="pt", limit=[1e6])
    assert len(found) == 25 and Tables(found._repr_html_()).scopes.count("row") == 20
    assert "5 more rows" in found._repr_html_()
    assert GATE.is_dir()
