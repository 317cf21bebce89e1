"""Force curves and their limits: texts of the figure, plain, with the same bytes each time."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cdtool.report.plots import force_plot
from cdtool.report.plots.figures import drawing, save
from cdtool.report.plots.force_plot import force_figure
from cdtool.results.traced_force import TracedForce
from cdtool.truth.force.limits import ForceProfile, ForceStep
from tests.report.plots.force_panels import GAP, curve
from tests.report.plots.svg import joined

STIFF = {"stiff": (curve("stiff/1", 900.0), curve("stiff/2", 3521.0), curve("stiff/3", 300.0))}
SOFT = {"soft": (curve("soft/1", 200.0, until=1.2), curve("soft/2", 390.0))}


def drawn(tmp_path: Path, *groups: dict[str, tuple[TracedForce, ...]], profile: ForceProfile = GAP) -> str:
    every = {name: curves for group in groups for name, curves in group.items()}
    save(force_figure(every, profile), tmp_path / "a.svg")
    return joined(tmp_path / "a.svg")


def test_a_panel_shows_the_worst_contact_with_peak_time_budget_and_alarms(tmp_path):
    shown = drawn(tmp_path, STIFF)
    for expected in (
        "stiff",
        "3 contacts:\n2 fail, 1 pass",
        "worst: stiff/2",
        "3521 N at 55 ms",
        "4.0 ms",
        "first exceeded after 4.0 ms",
        "dynamic: 3521 of 400 N",
        "alarm friction_ekf 34 ms",
        "alarm momentum 66 ms",
        "dynamic ≤ 400 N",
        "\n≤ 150 N",
        "\n≤ 25 N",
        "time from contact onset [ms]; compressed right of the first grey line",
    ):
        assert expected in shown, expected
    assert shown.index("friction_ekf 34 ms") < shown.index("momentum 66 ms")


def test_a_contact_that_cannot_be_assessed_is_worse_than_one_that_passes(tmp_path):
    shown = drawn(tmp_path, SOFT)
    assert "2 contacts:\n1 not assessable, 1 pass" in shown
    assert "worst: soft/1" in shown
    assert "residual: not assessable" in shown
    assert "exceeded" not in shown


def test_the_footer_names_the_source_and_states_that_this_is_not_a_certificate(tmp_path):
    shown = drawn(tmp_path, SOFT)
    assert "EN 12453:2017+A1:2021" in shown
    assert "evidence, not a certificate; values to be checked against the standard" in shown
    shown = drawn(tmp_path, SOFT, profile=replace(GAP, checked=True, source="checked by hand"))
    assert "checked by hand\nevidence, not a certificate" in shown
    assert "to be checked" not in shown


def test_each_group_has_a_panel_and_an_empty_one_has_none(tmp_path):
    shown = drawn(tmp_path, STIFF, {"empty": ()}, SOFT)
    assert "stiff" in shown and "soft" in shown and "empty" not in shown
    assert "no contact with a load-cell force" in drawn(tmp_path, {"empty": ()})


def test_a_fast_impact_in_a_long_record_keeps_its_shape_on_the_wide_first_part():
    with drawing():
        (axes,) = force_figure(STIFF, GAP).axes
    worst = next(line for line in axes.lines if line.get_color() == force_plot._WORST and len(line.get_xdata()) > 9)
    early = np.asarray(worst.get_xdata())
    assert np.count_nonzero(early <= 0.2) == 201  # every sample of the first 200 ms


def test_a_short_record_with_its_limits_in_view_is_not_compressed(tmp_path):
    profile = ForceProfile("p", "p", "p", True, (ForceStep(0.0, 400.0, "a"), ForceStep(0.08, 100.0, "b")))
    brief = {"brief": (curve("x", 350.0, until=0.15, profile=profile),)}
    with drawing():
        (axes,) = force_figure(brief, profile).axes
    assert axes.get_xlim() == (0.0, pytest.approx(0.15))
    assert "compressed" not in drawn(tmp_path, brief, profile=profile)


@pytest.mark.parametrize("until", [0.3, 1.2, 6.5])
def test_all_steps_of_the_limit_are_drawn_and_the_time_after_the_record_is_hatched(tmp_path, until):
    cut = {"cut": (curve("x", 900.0, until=until, alarms={"momentum": 0.4}),)}
    with drawing():
        (axes,) = force_figure(cut, GAP).axes
    stairs = next(line for line in axes.lines if list(line.get_xdata())[:3] == [0.0, 0.75, 5.0])
    assert list(stairs.get_xdata()) == sorted(stairs.get_xdata())
    assert stairs.get_xdata()[-1] == axes.get_xlim()[1] == max(until, 6.0)
    assert ("record has ended" in drawn(tmp_path, cut)) == (until < 6.0)


def test_an_alarm_is_marked_on_the_curve_and_an_alarm_after_the_record_is_only_listed(tmp_path):
    late = {"late": (curve("x", 900.0, until=0.9, alarms={"momentum": 0.02, "direct": 1.5}),)}
    with drawing():
        (axes,) = force_figure(late, GAP).axes
    marks = {line.get_marker(): line for line in axes.lines if len(line.get_xdata()) == 1}
    assert set(marks) == {"o", "D"}  # the limit's crossing, and the momentum observer's alarm
    assert marks["D"].get_xdata()[0] == pytest.approx(0.02)
    assert marks["D"].get_ydata()[0] == pytest.approx(900.0 * np.sin(28.4 * 0.02), rel=1e-3)
    assert "alarm direct 1500 ms" in drawn(tmp_path, late)


def test_many_alarms_are_counted_after_the_first_four(tmp_path):
    alarms = {f"detector_{i}": 0.01 * (9 - i) for i in range(9)}
    shown = drawn(tmp_path, {"g": (curve("x", 900.0, alarms=alarms),)})
    assert "alarm detector_8 10 ms" in shown
    assert "alarm detector_5 40 ms" in shown
    assert "detector_4 50 ms" not in shown
    assert "and 5 later" in shown
