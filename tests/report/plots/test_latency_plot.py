"""The latency figure: a mark per contact, open if missed, the median with its interval, and the counts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cdtool.report.plots import latency_plot
from cdtool.report.plots.figures import drawing, save
from cdtool.report.plots.latency_plot import latency_figure
from cdtool.results.evaluated import evaluate
from cdtool.results.results import ExposureResult, Results
from tests.report.bench import contacts_of
from tests.report.plots.svg import joined, texts

# The width of the lines that mark medians, and of no other.
TICK = 2.0


def of(results: Results, stiff: Sequence[float | str | None], detector: str = "momentum") -> Results:
    """One detector and one group with these latencies."""
    return replace(
        results, detectors=(detector,), groups=("stiff",), contacts=tuple(contacts_of(detector, "stiff", stiff))
    )


def marks(figure, panel: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Times of the filled and of the open marks."""
    found = {True: [np.empty(0)], False: [np.empty(0)]}
    for line in figure.axes[panel].lines:
        if line.get_color() != "black" and line.get_marker() not in ("None", ">"):
            found[line.get_markerfacecolor() != "white"].append(line.get_xdata())
    return np.concatenate(found[True]), np.concatenate(found[False])


def drawn(results: Results):
    with drawing():
        return latency_plot.latency_figure(evaluate(results))


def test_every_detected_contact_has_a_filled_mark_and_every_missed_one_an_open_mark(results):
    filled, opened = marks(drawn(of(results, [30.0, 34.0, 50.0, None, None, "blind"])))
    assert sorted(filled) == [30.0, 34.0, 50.0]
    assert len(opened) == 2


def test_the_median_has_a_bar_only_with_ten_or_more_contacts(results, tmp_path):
    for count in (1, 4, 9, 10):
        figure = drawn(of(results, [30.0 + i for i in range(count)]))
        bars = [line for line in figure.axes[0].lines if line.get_color() == "black" and line.get_linewidth() != TICK]
        ticks = [line for line in figure.axes[0].lines if line.get_linewidth() == TICK]
        assert (len(bars), len(ticks)) == (int(count >= 10), 1), count
    save(latency_figure(evaluate(of(results, [30.0 + i for i in range(10)]))), tmp_path / "a.svg")
    assert "black: median and its 95 % interval" in joined(tmp_path / "a.svg")


def test_no_contact_only_missed_and_a_single_one_are_drawn_too(results, tmp_path):
    save(latency_figure(evaluate(replace(results, contacts=()))), tmp_path / "none.svg")
    assert "no contact in any group" in joined(tmp_path / "none.svg")
    save(latency_figure(evaluate(of(results, [None] * 30))), tmp_path / "missed.svg")
    assert "0 of 30" in texts(tmp_path / "missed.svg")
    _, opened = marks(drawn(of(results, [None] * 30)))
    assert set(opened) == {1000.0}
    save(latency_figure(evaluate(of(results, [25.0]))), tmp_path / "one.svg")
    assert "1 of 1" in texts(tmp_path / "one.svg")


def test_the_words_below_the_axis_begin_within_the_figure(results):
    with drawing():
        figure = latency_figure(evaluate(of(results, [None] * 4, "A")))
        figure.canvas.draw()
        assert figure.axes[-1].xaxis.label.get_window_extent().x0 >= 0.0


def test_false_alarms_are_counted_among_the_operations_in_which_they_would_count(results, tmp_path):
    free = (ExposureResult("stiff", "A", 4, 4, 0.5), ExposureResult("holdout", "A", 20, 20, 0.5, 5))
    partly = replace(of(results, [30.0] * 4, "A"), groups=("stiff", "holdout"), exposure=free)
    save(drawn(partly), tmp_path / "partly.svg")
    assert "0 in 15 op." in texts(tmp_path / "partly.svg")
