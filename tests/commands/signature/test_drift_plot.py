"""The figure of a season: runs, limit, trend, the map of the stroke over the runs, and the verdicts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cdtool.commands.signature import drift_plot
from cdtool.commands.signature.drift import DriftAudit, audit_drift
from cdtool.commands.signature.drift_plot import plot_drift
from cdtool.report.plots.figures import drawing
from tests.commands.signature.seasons import ACTIVATION, learned, season
from tests.report.hostile import HOSTILE
from tests.report.plots.svg import assert_harmless, assert_within, joined, texts

FITTED = learned(season(20, seed=100))


def audit(change=None, count: int = 30) -> DriftAudit:
    return audit_drift(FITTED, season(count, change, 1), ACTIVATION)


def obstructed(number: int, travel: np.ndarray) -> np.ndarray:
    return 0.3 * number * (np.abs(travel - 0.4) < 0.03)


@pytest.fixture(scope="module")
def steady() -> DriftAudit:
    return audit()


@pytest.fixture(scope="module")
def growing() -> DriftAudit:
    return audit(obstructed)


def drawn(found: DriftAudit):
    with drawing():
        return drift_plot._figure(found)


def marks(axes, marker: str) -> int:
    return sum(len(line.get_xdata()) for line in axes.lines if line.get_marker() == marker)


def test_runs_within_the_limit_and_runs_with_an_alarm_have_different_marks(growing):
    margin, *_ = drawn(growing).axes
    alarmed = len(growing.alarms)
    assert alarmed > 3
    assert marks(margin, "^") == alarmed and marks(margin, "o") == 30 - alarmed
    assert any(set(line.get_ydata()) == {100.0} for line in margin.lines)


def test_the_map_is_darkest_at_the_growing_location_in_the_last_runs(growing):
    places = drawn(growing).axes[2]
    image = places.get_images()[0].get_array()
    row, column = np.unravel_index(np.argmax(image), image.shape)
    assert growing.places[row] == pytest.approx(0.4, abs=0.04) and column > 20
    (edge,) = [line for line in places.lines if line.get_marker() == ">"]
    assert edge.get_ydata() == [growing.joints[0].local.place]


def test_the_trend_line_is_drawn_where_a_drift_is_shown_and_not_else(steady):
    drifting = drawn(audit(lambda number, _: 0.08 * number)).axes[1]
    lines = [line for line in drifting.lines if line.get_marker() == "None" and len(line.get_xdata()) == 30]
    assert len(lines) == 1 and np.ptp(np.diff(lines[0].get_ydata())) < 1e-9
    still = drawn(steady).axes[1]
    assert not [line for line in still.lines if line.get_marker() == "None" and len(line.get_xdata()) == 30]


def test_a_step_is_drawn_as_a_step():
    axes = drawn(audit(lambda number, _: 2.0 * (number >= 18))).axes[1]
    (stairs,) = [line for line in axes.lines if len(line.get_xdata()) == 4 and line.get_marker() == "None"]
    assert list(stairs.get_xdata()) == [1.0, 18.5, 18.5, 30.0]


def test_the_verdicts_are_written_above_the_panels(growing, steady, tmp_path):
    plot_drift(growing, tmp_path / "a.svg")
    shown = joined(tmp_path / "a.svg").replace("\n", " ")
    for expected in (
        "30 runs, safety factor 5.5",
        "grows at 0.4",
        "before relearning",
        "alarm",
        "travel [m]",
        "limit",
    ):
        assert expected in shown, expected
    plot_drift(steady, tmp_path / "b.svg")
    shown = joined(tmp_path / "b.svg")
    assert "no drift shown" in shown and "alarm" not in shown and "location that changes" not in shown


def test_of_many_joints_those_with_a_change_are_drawn_first(growing, steady, tmp_path):
    still = [replace(steady.joints[0], joint=f"still{i}") for i in range(4)]
    both = replace(growing, joints=(*still, replace(growing.joints[0], joint="stiff")))
    plot_drift(both, tmp_path / "a.svg")
    shown = texts(tmp_path / "a.svg")
    assert "stiff" in shown and "2 more joints are not drawn" in shown
    assert sum(f"still{i}" in shown for i in range(4)) == 2


def test_one_run_and_a_stroke_without_locations_are_drawn_too(tmp_path):
    one = audit(count=1)
    plot_drift(one, tmp_path / "one.svg")
    assert "too few to show a drift" in joined(tmp_path / "one.svg").replace("\n", " ")
    nowhere = replace(one.joints[0], places=np.empty(0), deviation=np.empty((1, 0)))
    plot_drift(replace(one, places=np.empty(0), joints=(nowhere,)), tmp_path / "nowhere.svg")


@pytest.mark.parametrize("suffix", [".png", ".svg", ".pdf"])
def test_the_same_input_gives_the_same_bytes(growing, tmp_path, suffix):
    for name in ("a", "b"):
        plot_drift(growing, tmp_path / f"{name}{suffix}")
    assert (tmp_path / f"a{suffix}").read_bytes() == (tmp_path / f"b{suffix}").read_bytes()


@pytest.mark.parametrize("kind", HOSTILE)
def test_hostile_names_are_drawn_as_plain_text(growing, tmp_path, kind):
    name = HOSTILE[kind]
    (joint,) = growing.joints
    runs = tuple(replace(run, name=name) for run in joint.runs)
    hostile = replace(joint, joint=name, runs=runs)
    plot_drift(replace(growing, joints=(hostile, joint)), tmp_path / "a.svg")
    assert_harmless(tmp_path / "a.svg", kind)


def test_nothing_is_clipped(growing):
    assert_within(drawn(growing))
