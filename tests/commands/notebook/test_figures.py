"""The figures of results: a notebook shows them, without pyplot."""

from __future__ import annotations

from dataclasses import replace

import pytest
from matplotlib.figure import Figure

import cdtool
from cdtool.base.errors import UsageError
from tests.commands.notebook.values import GATE, LOG, MACHINE

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


def test_a_picture_in_a_notebook_is_that_of_the_report(result, tmp_path):
    result.save(tmp_path / "latency.png")
    assert result.plot.latency()._repr_png_()[0] == (tmp_path / "latency.png").read_bytes()


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
