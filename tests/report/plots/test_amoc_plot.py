"""The figure of latency against false alarms: rates, zone without any, factor in use, medians not reached."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from cdtool.report.plots import amoc_plot
from cdtool.report.plots.amoc_plot import amoc_figure
from cdtool.report.plots.figures import drawing, save
from cdtool.report.plots.style import look_of
from cdtool.results.curves.sweep import MULTIPLES
from cdtool.results.evaluated import Evaluated, evaluate
from cdtool.results.results import Results, SweepResult
from tests.report.bench import contacts_of
from tests.report.plots.svg import joined, texts
from tests.results.sweeps import CONTACTS, swept

QUIET_FROM = 0.7


def alarms(multiple: float) -> int:
    return int(20 / multiple) if multiple < QUIET_FROM else 0


def none(_: float) -> int:
    return 0


def of(
    rows: Sequence[SweepResult], names: Sequence[str] = ("momentum",), groups: Sequence[str] = ("stiff",)
) -> Evaluated:
    contacts = [row for group in groups for name in names for row in contacts_of(name, group, [30.0, 40.0])]
    return evaluate(Results({}, tuple(names), tuple(groups), tuple(contacts), (), (), sweep=tuple(rows)))


def drawn(evaluated: Evaluated):
    with drawing():
        return amoc_plot.amoc_figure(evaluated)


def small_marks(figure, open_marks: bool) -> np.ndarray:
    """Points (n, 2) of the small marks that are open, or filled."""
    lines = [line for line in figure.axes[0].lines if line.get_markersize() == 3.2]
    chosen = [line for line in lines if (line.get_markerfacecolor() == "white") == open_marks]
    return np.concatenate([np.column_stack(line.get_data()) for line in chosen] or [np.empty((0, 2))])


def in_use(figure) -> list:
    return [line for line in figure.axes[0].lines if line.get_markeredgecolor() == "black"]


def arrows(figure) -> list:
    return [text for text in figure.axes[0].texts if getattr(text, "arrow_patch", None) is not None]


def test_every_safety_factor_is_a_mark_at_its_rate_and_median():
    figure = drawn(of(swept("momentum", "stiff", lambda m: 60.0 * m, alarms, hours=0.1)))
    marks = small_marks(figure, False)
    assert len(marks) == len(MULTIPLES)
    assert marks[:, 1] == pytest.approx(60.0 * MULTIPLES)
    loud = MULTIPLES < QUIET_FROM
    assert marks[loud, 0] == pytest.approx([alarms(multiple) / 0.1 for multiple in MULTIPLES[loud]])


def test_points_without_a_false_alarm_are_left_of_all_rates_in_a_zone_with_its_bound(tmp_path):
    evaluated = of(swept("momentum", "stiff", lambda m: 60.0 * m, alarms, operations=40, hours=0.1))
    marks = small_marks(drawn(evaluated), False)
    loud = MULTIPLES < QUIET_FROM
    assert len(set(marks[~loud, 0])) == 1
    assert marks[~loud, 0].max() < 1.0 / 0.1 < marks[loud, 0].min()
    save(amoc_figure(evaluated), tmp_path / "a.svg")
    shown = joined(tmp_path / "a.svg")
    for expected in ("none in 40 operations", "0.100 h", "(at most 30.0 per hour)", "false alarms per hour"):
        assert expected in shown


def test_detectors_with_different_exposure_have_a_range_of_bounds(tmp_path):
    rows = swept("momentum", "stiff", lambda m: 60.0 * m, alarms, hours=0.1)
    rows += swept("direct", "stiff", lambda m: 70.0 * m, none, operations=30, hours=0.05)
    save(amoc_figure(of(rows, ("momentum", "direct"))), tmp_path / "a.svg")
    shown = joined(tmp_path / "a.svg")
    assert "none in 30 to 40 operations" in shown
    assert "(at most 30.0 to 59.9 per hour)" in shown


def test_the_factor_in_use_is_marked_on_each_curve_and_its_results_are_listed(tmp_path):
    evaluated = of(swept("momentum", "stiff", lambda m: 62.0 * m, alarms, lambda _: 1, not_assessable=2))
    (mark,) = in_use(drawn(evaluated))
    assert mark.get_ydata() == pytest.approx([62.0])
    save(amoc_figure(evaluated), tmp_path / "a.svg")
    shown = texts(tmp_path / "a.svg")
    for expected in ("momentum", "5.50", "62.0", "1 of 20", "2", "0 in 40 op."):
        assert expected in shown


def test_marks_are_open_where_contacts_were_missed(tmp_path):
    evaluated = of(swept("momentum", "stiff", lambda m: 60.0 * m, alarms, lambda m: 3 if m > 1.5 else 0))
    figure = drawn(evaluated)
    assert len(small_marks(figure, True)) == np.count_nonzero(MULTIPLES > 1.5)
    assert len(small_marks(figure, False)) == np.count_nonzero(MULTIPLES <= 1.5)
    assert in_use(figure)[0].get_markerfacecolor() == look_of("momentum").colour
    save(amoc_figure(evaluated), tmp_path / "a.svg")
    assert "open: contacts were missed" in joined(tmp_path / "a.svg")


def test_a_curve_whose_median_is_not_reached_ends_with_an_arrow_up(tmp_path):
    evaluated = of(
        swept("momentum", "stiff", lambda m: None if m > 2.0 else 60.0 * m, alarms, lambda m: 12 if m > 2.0 else 0)
    )
    figure = drawn(evaluated)
    (arrow,) = arrows(figure)
    last = MULTIPLES[MULTIPLES <= 2.0].max()
    assert arrow.xy[1] == pytest.approx(60.0 * last)
    assert arrow.xyann[1] > 0.0
    save(amoc_figure(evaluated), tmp_path / "a.svg")
    assert "arrow: the median is not reached" in joined(tmp_path / "a.svg")


def test_a_factor_in_use_whose_median_is_not_reached_is_drawn_at_the_top_and_explained(tmp_path):
    evaluated = of(
        swept("momentum", "stiff", lambda m: 60.0 if m < 0.5 else None, alarms, lambda m: 0 if m < 0.5 else 15)
    )
    figure = drawn(evaluated)
    (mark,) = in_use(figure)
    assert mark.get_markerfacecolor() == "white"
    assert mark.get_transform() == figure.axes[0].get_xaxis_transform()
    assert len(arrows(figure)) == 2
    save(amoc_figure(evaluated), tmp_path / "a.svg")
    assert "not reached" in texts(tmp_path / "a.svg") and "15 of 20" in texts(tmp_path / "a.svg")


def test_a_detector_without_a_curve_is_in_the_key_with_its_contacts_not_assessable(tmp_path):
    contacts = [*contacts_of("momentum", "stiff", [30.0]), *contacts_of("direct", "stiff", ["blind"] * 3)]
    rows = tuple(swept("momentum", "stiff", lambda m: 60.0 * m, alarms))
    evaluated = evaluate(Results({}, ("momentum", "direct"), ("stiff",), tuple(contacts), (), (), sweep=rows))
    save(amoc_figure(evaluated), tmp_path / "a.svg")
    shown = texts(tmp_path / "a.svg")
    assert shown[shown.index("direct") + 1 :][:5] == ["–", "–", "–", "3", "–"]


def test_rates_are_per_operation_where_the_budget_is(tmp_path):
    rows = tuple(swept("momentum", "stiff", lambda m: 60.0 * m, alarms))
    results = Results({"false_alarm_budget": "1/1000op"}, ("momentum",), ("stiff",), (), (), (), sweep=rows)
    save(amoc_figure(evaluate(results)), tmp_path / "a.svg")
    assert "false alarms per operation" in joined(tmp_path / "a.svg")
    assert "per operation)" in joined(tmp_path / "a.svg")


def test_no_sweep_no_false_alarm_everything_missed_and_nothing_assessable_are_drawn_too(tmp_path):
    save(amoc_figure(of([])), tmp_path / "none.svg")
    assert "no impact-free hold-out" in joined(tmp_path / "none.svg")
    assert len(small_marks(drawn(of(swept("momentum", "stiff", lambda m: 60.0 * m, none))), False)) == len(MULTIPLES)
    missed = of(swept("momentum", "stiff", lambda _: None, none, lambda _: CONTACTS))
    assert len(small_marks(drawn(missed), True)) == 0
    save(amoc_figure(missed), tmp_path / "missed.svg")
    assert "20 of 20" in texts(tmp_path / "missed.svg")
    blind = swept("momentum", "stiff", lambda _: None, none, lambda _: CONTACTS, not_assessable=CONTACTS)
    figure = drawn(of([replace(row, missed=0) for row in blind]))
    assert in_use(figure) == [] and arrows(figure) == []


def test_a_median_of_zero_is_drawn_at_the_lower_end_of_a_logarithmic_axis_and_explained(tmp_path):
    rows = [
        *swept("quick", "stiff", lambda _: 0.0, alarms, hours=0.1),
        *swept("slow", "stiff", lambda m: 60.0 * m, alarms, hours=0.1),
    ]
    evaluated = of(rows, ("quick", "slow"))
    figure = drawn(evaluated)
    axes = figure.axes[0]
    assert axes.get_yscale() == "log"
    low, high = axes.get_ylim()
    marks = small_marks(figure, False)
    assert len(marks) == 2 * len(MULTIPLES)
    assert ((marks[:, 1] > low) & (marks[:, 1] < high)).all()
    assert np.count_nonzero(marks[:, 1] == 1.0) == len(MULTIPLES)
    assert sorted(float(line.get_ydata()[0]) for line in in_use(figure)) == pytest.approx([1.0, 60.0])
    save(amoc_figure(evaluated), tmp_path / "a.svg")
    assert "medians below 1 ms are drawn there" in joined(tmp_path / "a.svg")
    save(amoc_figure(of(rows[len(MULTIPLES) :], ("slow",))), tmp_path / "b.svg")
    assert "drawn there" not in joined(tmp_path / "b.svg")
