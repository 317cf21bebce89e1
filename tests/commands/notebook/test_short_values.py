"""What a notebook prints for a value: one short line, and for the results a small table."""

from __future__ import annotations

import pytest

import cdtool
from tests.commands.notebook.values import LOG, MACHINE, returned_values

LONGEST = 200


@pytest.fixture(scope="module")
def returned(tmp_path_factory):
    return returned_values(tmp_path_factory.mktemp("returned"))


def faults_of(value: object) -> str:
    text = repr(value)
    if "array(" in text or "\n" in text:
        return f"{type(value).__name__}: {text[:80]}"
    return f"{type(value).__name__}: {len(text)} characters" if len(text) > LONGEST else ""


def test_the_repr_of_what_a_function_returns_is_one_short_line(returned):
    assert not [fault for fault in map(faults_of, returned.values()) if fault]


def test_the_repr_of_the_main_values_says_what_they_are(returned):
    assert repr(returned["benchmark"]) == (
        f"BenchmarkResult(2 detectors, 3 groups, 12 recordings: {returned['benchmark'].headline})"
    )
    assert repr(returned["detect"]) == "DetectionResult(03.csv, friction_ekf: alarm, 1 alarm, 1 contact)"
    assert repr(returned["detect of many"]) == "DetectionResults(2 logs, friction_ekf: 1 alarm)"
    assert repr(returned["read"]["speed"]) == "Series(7200 samples, 1 column, unit='m/s')"


@pytest.mark.parametrize("name", ["detect", "detect of many", "benchmark", "score"])
def test_a_notebook_shows_a_small_table_below_a_line(returned, name):
    text = returned[name]._repr_html_()
    assert text.startswith("<p>") and text.count("<table") == text.count("</table>") == 1
    assert len(text) < 6000


def test_text_from_files_is_escaped_in_a_notebook(tmp_path):
    hostile = tmp_path / "<b>.csv"
    hostile.write_bytes(LOG.read_bytes())
    text = cdtool.detect([hostile], MACHINE, detector="pt", settings={"threshold.limits": 1e6})._repr_html_()
    assert "<b>" not in text and "&lt;b&gt;" in text
