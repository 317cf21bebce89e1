"""The latency figure: a mark per contact, open if missed, the median with its interval, and the counts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cdtool.report.plots import latency_plot
from cdtool.report.plots.figures import drawing, save
from cdtool.report.plots.latency_plot import latency_figure
from cdtool.results.evaluated import evaluate
from cdtool.results.results import Results
from tests.report.bench import contact, contacts_of
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


def test_counts_are_listed_next_to_the_latencies(evaluated, tmp_path):
    save(latency_figure(evaluated), tmp_path / "a.svg")
    shown = texts(tmp_path / "a.svg")
    for expected in ("stiff", "soft", "friction_ekf", "momentum", "3 of 4", "2 of 3", "30 of 30", "missed"):
        assert expected in shown
    assert "34.0 (–)" in shown
    assert "1 in 40 op." in shown and "in holdout" in shown
    assert "holdout" not in shown


def test_every_detected_contact_has_a_filled_mark_and_every_missed_one_an_open_mark(results):
    filled, opened = marks(drawn(of(results, [30.0, 34.0, 50.0, None, None, "blind"])))
    assert sorted(filled) == [30.0, 34.0, 50.0]
    assert len(opened) == 2


def test_missed_contacts_are_drawn_in_a_strip_with_the_duration_of_their_monitoring(results, tmp_path):
    one = of(results, [30.0, 34.0, None])
    figure = drawn(one)
    _, opened = marks(figure)
    low, high = figure.axes[0].get_xlim()
    assert low < 34.0 < opened[0] < high < 1000.0
    save(latency_figure(evaluate(one)), tmp_path / "a.svg")
    assert "> 1000 ms" in joined(tmp_path / "a.svg")
    assert "open if missed" in joined(tmp_path / "a.svg")
    lasting = tuple(replace(item, watched_ms=400.0 + 10.0 * i) for i, item in enumerate(one.contacts))
    save(latency_figure(evaluate(replace(one, contacts=lasting))), tmp_path / "b.svg")
    assert "> 420 ms" in joined(tmp_path / "b.svg")


def test_a_missed_contact_monitored_for_less_than_other_latencies_is_drawn_at_its_time(results):
    rows = of(results, [30.0, 60.0, None]).contacts
    cut_off = tuple(replace(item, watched_ms=45.0) if item.outcome == "missed" else item for item in rows)
    _, opened = marks(drawn(replace(of(results, []), contacts=cut_off)))
    assert opened.tolist() == [45.0]


def test_without_a_miss_there_is_neither_a_strip_nor_a_note_on_it(results, tmp_path):
    save(latency_figure(evaluate(of(results, [30.0, 34.0]))), tmp_path / "a.svg")
    shown = joined(tmp_path / "a.svg")
    assert "open" not in shown
    assert "> " not in shown
    assert "black: median; no bar with fewer than 10 contacts" in shown


def test_the_median_has_a_bar_only_with_ten_or_more_contacts(results, tmp_path):
    for count in (1, 4, 9, 10):
        figure = drawn(of(results, [30.0 + i for i in range(count)]))
        bars = [line for line in figure.axes[0].lines if line.get_color() == "black" and line.get_linewidth() != TICK]
        ticks = [line for line in figure.axes[0].lines if line.get_linewidth() == TICK]
        assert (len(bars), len(ticks)) == (int(count >= 10), 1), count
    save(latency_figure(evaluate(of(results, [30.0 + i for i in range(10)]))), tmp_path / "a.svg")
    assert "black: median and its 95 % interval" in joined(tmp_path / "a.svg")


def test_a_median_that_is_not_reached_is_written_and_has_no_tick(results, tmp_path):
    one = of(results, [30.0, None, None, None])
    save(latency_figure(evaluate(one)), tmp_path / "a.svg")
    assert any(text.startswith("not reached") for text in texts(tmp_path / "a.svg"))
    assert not [line for line in drawn(one).axes[0].lines if line.get_linewidth() == TICK]


def test_a_median_between_the_last_detection_and_the_end_of_monitoring_is_in_the_strip(results):
    one = of(results, [30.0, 34.0, None, None])
    median = evaluate(one).summaries[0].median.value
    assert median > 100.0
    figure = drawn(one)
    ticks = [line.get_xdata() for line in figure.axes[0].lines if line.get_linewidth() == TICK]
    assert 34.0 < ticks[0][0] < figure.axes[0].get_xlim()[1] < median


def test_latencies_over_more_than_a_decade_get_a_logarithmic_axis(results):
    wide, narrow = drawn(results), drawn(replace(results, groups=("stiff",)))
    assert {axes.get_xscale() for axes in wide.axes} == {"log"}
    assert {axes.get_xscale() for axes in narrow.axes} == {"linear"}
    assert narrow.axes[0].get_xlim()[0] == 0.0


def test_a_latency_of_zero_is_drawn_on_a_logarithmic_axis_and_explained(results, tmp_path):
    more = replace(results, contacts=(*results.contacts, contact("momentum", "stiff", 0.0)))
    save(latency_figure(evaluate(more)), tmp_path / "a.svg")
    assert "below 1 ms drawn there" in joined(tmp_path / "a.svg")


def test_a_detector_without_exposure_has_no_count_of_false_alarms(results, tmp_path):
    blind = tuple(replace(item, hours=0.0) for item in results.exposure)
    save(latency_figure(evaluate(replace(results, exposure=blind, false_alarms=()))), tmp_path / "a.svg")
    assert not any(text.endswith("op.") for text in texts(tmp_path / "a.svg"))


def test_no_contact_only_missed_and_a_single_one_are_drawn_too(results, tmp_path):
    save(latency_figure(evaluate(replace(results, contacts=()))), tmp_path / "none.svg")
    assert "no contact in any group" in joined(tmp_path / "none.svg")
    save(latency_figure(evaluate(of(results, [None] * 30))), tmp_path / "missed.svg")
    assert "0 of 30" in texts(tmp_path / "missed.svg")
    _, opened = marks(drawn(of(results, [None] * 30)))
    assert set(opened) == {1000.0}
    save(latency_figure(evaluate(of(results, [25.0]))), tmp_path / "one.svg")
    assert "1 of 1" in texts(tmp_path / "one.svg")


def test_thousands_of_contacts_are_thinned_to_marks_that_span_them_and_this_is_stated(results, tmp_path):
    many = of(results, [float(x) for x in np.linspace(20.0, 90.0, 2000)])
    filled, _ = marks(drawn(many))
    assert len(filled) == 400
    assert (filled.min(), filled.max()) == (20.0, 90.0)
    save(latency_figure(evaluate(many)), tmp_path / "a.svg")
    assert "(at most 400 are drawn)" in joined(tmp_path / "a.svg")
    save(latency_figure(evaluate(of(results, [20.0, 30.0]))), tmp_path / "b.svg")
    assert "are drawn)" not in joined(tmp_path / "b.svg")
