"""What a notebook shows: a short line for a value, a small table for results, figures, and errors with a next step."""

from __future__ import annotations

import pydoc
import re
from dataclasses import replace
from types import FunctionType

import pytest
from matplotlib.figure import Figure

import cdtool
from cdtool.base.errors import UsageError
from tests.commands.notebook.values import FREE, GATE, LOG, MACHINE, ROOT, returned_values

LONGEST = 200


@pytest.fixture(scope="module")
def returned(tmp_path_factory):
    return returned_values(tmp_path_factory.mktemp("returned"))


def faults_of(value: object) -> str:
    text = repr(value)
    if "array(" in text or "\n" in text:
        return f"{type(value).__name__}: {text[:80]}"
    return f"{type(value).__name__}: {len(text)} characters" if len(text) > LONGEST else ""


def test_the_package_has_the_api_only_and_help_shows_each_function_by_its_name():
    names = set(cdtool.__all__)
    assert set(dir(cdtool)) == names and not names & {"commands", "report", "results", "annotations"}
    text = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
    for name in names - {"__version__"}:
        value = getattr(cdtool, name)
        assert value.__name__ == name and value.__doc__, name
        if isinstance(value, FunctionType):
            assert re.search(rf"^{name}\(", pydoc.render_doc(value, renderer=pydoc.plaintext), re.MULTILINE), name
            assert re.search(rf"`(cdtool\.)?{name}\b|cdtool\.{name}\(", text), name


def test_the_repr_of_what_a_function_returns_is_one_short_line(returned):
    assert not [fault for fault in map(faults_of, returned.values()) if fault]


@pytest.mark.parametrize("name", ["detect", "detect of many", "benchmark", "score"])
def test_a_notebook_shows_a_small_table_below_a_line(returned, name):
    text = returned[name]._repr_html_()
    assert text.startswith("<p style=") and text.count("<table") == text.count("</table>") == 1
    assert len(text) < 6000


def test_text_from_files_is_escaped_in_a_notebook(tmp_path):
    hostile = tmp_path / "<b>.csv"
    hostile.write_bytes(LOG.read_bytes())
    text = cdtool.detect([hostile], MACHINE, detector="pt", settings={"threshold.limits": 1e6})._repr_html_()
    assert "<b>" not in text and "&lt;b&gt;" in text


PNG = b"\x89PNG"


@pytest.fixture(scope="module")
def result():
    return cdtool.benchmark(GATE / "benchmark.toml", detectors=["momentum", "pure_torque"])


@pytest.mark.parametrize("name", ["latency", "survival", "amoc", "triggers"])
def test_a_figure_shows_itself_with_a_description(result, name):
    figure = getattr(result.plot, name)()
    assert isinstance(figure, Figure)
    picture, about = figure._repr_png_()
    assert picture.startswith(PNG) and about["alt"]
    assert figure._repr_png_() == (picture, about)


def test_the_triggers_of_a_recording_are_found_by_any_ending_of_one(result):
    (trace, *_) = result.traces
    traces = tuple(replace(trace, recording=name) for name in ("a/01.csv#1", "a/01.csv#2", "b/01.csv", "b/21.csv"))
    of_two = replace(result, traces=traces)
    assert "a/01.csv#" in of_two.plot.triggers("a/01.csv").description
    assert "a/01.csv#2" in of_two.plot.triggers("01.csv#2").description
    assert "b/21.csv" in of_two.plot.triggers("21.csv").description
    with pytest.raises(UsageError, match=r"'01\.csv' fits a/01\.csv, b/01\.csv"):
        of_two.plot.triggers("01.csv")
    with pytest.raises(UsageError, match=r"no curves of '1\.csv' were kept"):
        of_two.plot.triggers("1.csv")


def test_a_detection_is_drawn_as_by_the_command():
    found = cdtool.detect(LOG, MACHINE, detector="gm", settings={"threshold.limits": 400.0})
    figure = found.plot()
    assert isinstance(figure, Figure) and figure._repr_png_()[0].startswith(PNG)
    assert "03.csv" in figure.description


def shown(call):
    with pytest.raises(cdtool.CdtoolError) as caught:
        call()
    return caught.value._render_traceback_()


def test_an_error_is_shown_with_the_line_of_the_caller_and_a_next_step_and_without_the_frames_of_cdtool():
    lines = shown(lambda: cdtool.read(GATE / "stif" / "03.csv", MACHINE))
    assert len(lines) == 3
    assert lines[0].startswith("line ") and 'cdtool.read(GATE / "stif" / "03.csv", MACHINE)' in lines[0]
    assert lines[1] == f"RecordingError: {GATE / 'stif' / '03.csv'}: no such file"
    assert lines[2] == "next step: check the path"


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: cdtool.learn_signature(sorted(GATE.glob("fre/*")), MACHINE, "momentum"), "no log is given"),
        (lambda: cdtool.learn_signature(str(FREE[0]), MACHINE, "momentum"), "a single path, not a list of logs"),
        (lambda: cdtool.learn_signature(GATE / "free", MACHINE, "momentum"), "a single path, not a list of logs"),
        (lambda: cdtool.detect([], MACHINE, detector="gm", settings={"threshold.limits": 400}), "no log is given"),
        (lambda: cdtool.detect(LOG, MACHINE, settings={"threshold.limits": 400}), "no detector is given"),
        (lambda: cdtool.detect(LOG, MACHINE, detector="momentum"), "no threshold is given"),
        (lambda: cdtool.init_study([], "study"), "no log is given"),
        (lambda: cdtool.identify("free/*.csv", MACHINE, "out.toml"), "a single path, not a list of logs"),
    ],
)
def test_a_list_that_is_empty_or_is_no_list_is_refused_with_what_to_give(call, words):
    assert words in "\n".join(shown(call))
