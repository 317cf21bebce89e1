"""The figure of latency against false alarms: rates, zone without any, factor in use, medians not reached."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from cdtool.report.plots import amoc_plot
from cdtool.report.plots.amoc_plot import amoc_figure
from cdtool.report.plots.figures import drawing, save
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
    lines = [line for axes in figure.axes for line in axes.lines if line.get_markersize() == 3.2]
    chosen = [line for line in lines if (line.get_markerfacecolor() == "white") == open_marks]
    return np.concatenate([np.column_stack(line.get_data()) for line in chosen] or [np.empty((0, 2))])


def in_use(figure) -> list:
    return [line for axes in figure.axes for line in axes.lines if line.get_markeredgecolor() == "black"]


def arrows(figure) -> list:
    return [text for axes in figure.axes for text in axes.texts if getattr(text, "arrow_patch", None) is not None]


def test_every_safety_factor_is_a_mark_at_its_rate_and_median():
    figure = drawn(of(swept("momentum", "stiff", lambda m: 60.0 * m, alarms, operations=40)))
    marks = small_marks(figure, False)
    assert len(marks) == len(MULTIPLES)
    assert sorted(marks[:, 1]) == pytest.approx(60.0 * MULTIPLES)
    loud = marks[marks[:, 1] < 60.0 * QUIET_FROM]
    assert loud[:, 0] == pytest.approx([alarms(median / 60.0) / 40 for median in loud[:, 1]])


def test_points_without_a_false_alarm_are_in_a_strip_of_their_own_with_their_bound(tmp_path):
    evaluated = of(swept("momentum", "stiff", lambda m: 60.0 * m, alarms, operations=40, hours=1.0))
    rates, strip = drawn(evaluated).axes
    quiet = [line for line in strip.lines if line.get_markersize() == 3.2]
    assert sum(len(line.get_xdata()) for line in quiet) == np.sum(MULTIPLES >= QUIET_FROM)
    assert strip.get_position().x1 < rates.get_position().x0
    save(amoc_figure(evaluated), tmp_path / "a.svg")
    shown = joined(tmp_path / "a.svg")
    for expected in ("0\nin 1.00 h:\nat most 3.00 per hour", "false alarms per hour, in the hold-out"):
        assert expected in shown


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
