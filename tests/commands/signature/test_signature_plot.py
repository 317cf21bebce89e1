"""The figure of a signature: mean, limits now and as first learned, number of runs by location."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cdtool.commands.signature import signature_plot
from cdtool.commands.signature.signature_plot import plot_signature
from cdtool.detectors.detection import Status
from cdtool.recordings.motion import MotionClass
from cdtool.report.plots.figures import drawing
from tests.commands.signature.seasons import learned, season
from tests.report.hostile import HOSTILE
from tests.report.plots.svg import assert_harmless, assert_within, joined

RUNS = season(14)
FIRST = learned(RUNS)
NOW = FIRST
for item, found in season(6, lambda number, _: 0.5 * number, 3):
    NOW = NOW.with_run(item.recording, found)


def drawn(current, first):
    with drawing():
        return signature_plot._figure([(current, first)], "N", "momentum")


def heights(axes, dashes: str) -> list[np.ndarray]:
    return [line.get_ydata() for line in axes.lines if line.get_linestyle() == dashes]


def test_mean_and_limit_are_those_of_the_signature_in_time_and_travel():
    time, travel, *_ = drawn(FIRST, FIRST).axes
    for axes, curve in ((time, FIRST.by_time), (travel, FIRST.by_position)):
        (mean,), (limit,) = heights(axes, "-"), heights(axes, "--")
        assert np.nanmax(mean) == pytest.approx(np.nanmax(curve.band(True)[0]))
        assert np.nanmax(limit) == pytest.approx(np.nanmax(FIRST.limits(curve)[1]))
    assert time.get_ylim() == travel.get_ylim()


def test_the_first_limits_are_drawn_once_runs_were_added(tmp_path):
    plot_signature([NOW], [FIRST], "N", "momentum", tmp_path / "now.svg")
    assert "limit as first learned" in joined(tmp_path / "now.svg")
    assert "20 runs, limit: mean + 5.5 spreads" in joined(tmp_path / "now.svg")
    plot_signature([FIRST], [FIRST], "N", "momentum", tmp_path / "first.svg")
    assert "first learned" not in joined(tmp_path / "first.svg")
    travel = drawn(NOW, FIRST).axes[1]
    dotted = [line for line in travel.lines if line.get_color() == "black"]
    assert np.nanmax(dotted[0].get_ydata()) == pytest.approx(np.nanmax(FIRST.limits(FIRST.by_position)[1]))


def test_two_sides_have_two_limits_and_a_backward_stroke_has_the_lower_one():
    two, back = learned(RUNS, sides="two"), learned(season(12, direction=-1))
    assert len(heights(drawn(two, two).axes[1], "--")) == 2
    (limit,) = heights(drawn(back, back).axes[1], "--")
    assert np.nanmax(limit) < np.nanmin(back.by_position.band(True)[0])


def test_locations_with_too_few_valid_runs_are_hatched():
    blind = season(12)
    for _, found in blind[:6]:
        found.status[2400:2800] = Status.GAP
    with_gap = drawn(learned(blind), learned(blind)).axes[3]
    hatched = [item for item in with_gap.collections if item.get_hatch()]
    spans = [path.vertices[:, 0] for item in hatched for path in item.get_paths()]
    assert any(span.min() == pytest.approx(0.315, abs=0.02) and np.ptp(span) > 0.05 for span in spans)


def test_with_one_alignment_there_is_one_column():
    for alignment, word in (("time", "time since the motion began [s]"), ("position", "travel [m or rad]")):
        only = learned(RUNS, alignment=alignment)
        figure = drawn(only, only)
        assert len(figure.axes) == 2 and figure.axes[1].get_xlabel() == word


def test_more_classes_than_fit_are_counted(tmp_path):
    many = [replace(FIRST, motion=MotionClass(1, 0.1 * number)) for number in range(1, 9)]
    plot_signature(many, many, "N", "momentum", tmp_path / "a.svg")
    assert "2 more classes and joints are not drawn" in joined(tmp_path / "a.svg")


@pytest.mark.parametrize("suffix", [".png", ".svg", ".pdf"])
def test_the_same_input_gives_the_same_bytes(tmp_path, suffix):
    for name in ("a", "b"):
        plot_signature([NOW], [FIRST], "N", "momentum", tmp_path / f"{name}{suffix}")
    assert (tmp_path / f"a{suffix}").read_bytes() == (tmp_path / f"b{suffix}").read_bytes()


@pytest.mark.parametrize("kind", HOSTILE)
def test_hostile_names_are_drawn_as_plain_text(tmp_path, kind):
    hostile = replace(FIRST, joints=(HOSTILE[kind],))
    plot_signature([hostile], [hostile], HOSTILE[kind], HOSTILE[kind], tmp_path / "a.svg")
    assert_harmless(tmp_path / "a.svg", kind)


def test_nothing_is_clipped():
    assert_within(drawn(NOW, FIRST))
