"""Causal alignment of channels, and the findings on time stamps, of whole clocks and piece by piece."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdtool.base.errors import RecordingError
from cdtool.base.findings import Finding
from cdtool.recordings.clock import clean_time, differentiate, epoch_start, previous_value
from cdtool.recordings.clock.stamps import ClockCleaner, gaps_in, gaps_of
from cdtool.recordings.recording import Series
from tests.base.findings.facts import fact_of


def series(time, values, unit="m"):
    return Series(np.asarray(time, float), np.asarray(values, float), unit)


def test_faulty_stamps_are_dropped_and_reported_together_with_their_rows():
    clean = clean_time([0.0, 1.0, 2.0, 2.0, 1.5, 3.0, np.nan, 4.0, 5.0, 6.0, 7.0, 8.0], first_row=2)
    np.testing.assert_array_equal(clean.time, [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0])
    np.testing.assert_array_equal(np.flatnonzero(clean.keep), [0, 1, 2, 5, 7, 8, 9, 10, 11])
    assert [fact_of(item) for item in clean.findings] == [
        ("unknown_stamps", {"count": 1, "rows": 12, "first": (8,), "row_name": "line"}),
        ("backward_stamps", {"count": 1, "rows": 12, "first": (6,), "row_name": "line", "restart": None}),
        ("repeated_stamps", {"count": 1, "rows": 12, "first": (5,), "row_name": "line"}),
    ]


@settings(max_examples=100, deadline=None)
@given(st.lists(st.floats(-1e3, 1e3) | st.just(float("nan")), max_size=40))
def test_cleaned_stamps_always_strictly_increase(stamps):
    try:
        clean = clean_time(stamps)
    except RecordingError as fault:
        assert "stands still" in str(fault)
        return
    assert np.all(np.diff(clean.time) > 0.0)
    assert clean.keep.sum() == len(clean.time)
    assert clean.keep.all() == (
        not any(
            item.kind in ("repeated_stamps", "unknown_stamps", "stray_stamps", "stuck_stamps", "backward_stamps")
            for item in clean.findings
        )
    )


RESTART, WRAP_16, WRAP_32 = {"wrapped_bits": 0}, {"wrapped_bits": 16}, {"wrapped_bits": 32}
# The stamps, and the only finding on them: kind, number of rows, the first of them, cause, severity.
DROPPED = {
    "restart": ([0, 1, 2, 3, 4, 5, 6, 0, 1, 2], "backward_stamps", 3, (7, 8, 9), RESTART, "loss"),
    "backward": ([*range(200), 150, *range(200, 400)], "backward_stamps", 1, (200,), None, "warning"),
    "twice": ([*range(200), 199, *range(200, 400)], "repeated_stamps", 1, (200,), "", "warning"),
    "few": ([*range(30), 29, *range(30, 40)], "repeated_stamps", 1, (30,), "", "loss"),
    "nan": ([*range(30), np.nan, np.nan, *range(30, 40)], "unknown_stamps", 2, (30, 31), "", "loss"),
    "uint16": ([*range(65500, 65536), *range(20)], "backward_stamps", 20, (36, 37, 38), WRAP_16, "loss"),
    "uint32": (
        [*range(2**32 - 30000, 2**32, 1000), *range(700, 9000, 1000)],
        *("backward_stamps", 9, (30, 31, 32), WRAP_32, "loss"),
    ),
    "int32": (
        [*range(2**31 - 30, 2**31), *range(-(2**31), 20 - 2**31)],
        *("backward_stamps", 20, (30, 31, 32), WRAP_32, "loss"),
    ),
    "no-wrap": ([*range(65490, 65500), *range(20)], "backward_stamps", 20, (10, 11, 12), RESTART, "loss"),
    "stray": ([*range(50), 60000, *range(50, 60)], "stray_stamps", 1, (50,), "", "loss"),
    "ahead": (
        [*range(99), *range(60000, 60051), *range(99, 600)],
        *("backward_stamps", 501, (150, 151, 152), RESTART, "loss"),
    ),
}


@pytest.mark.parametrize(("stamps", "kind", "count", "first", "restart", "severity"), DROPPED.values(), ids=DROPPED)
def test_dropped_stamps_are_reported_with_their_share_and_are_a_loss_unless_they_are_few(
    stamps, kind, count, first, restart, severity
):
    (finding,) = clean_time(np.array(stamps, dtype=float)).findings
    numbers = {"count": count, "rows": len(stamps), "first": first, "row_name": "sample"}
    numbers |= {"restart": restart} if kind == "backward_stamps" else {}
    assert (fact_of(finding), finding.severity) == ((kind, numbers), severity)


@pytest.mark.parametrize("stamps", [[0.0] * 40, [5.0, 5.0], [7.0, 7.0, 3.0, 2.0]])
def test_a_clock_that_stands_still_is_refused(stamps):
    with pytest.raises(RecordingError, match=r"the clock stands still .*rate_hz"):
        clean_time(stamps)


def test_a_single_sample_and_events_at_one_time_are_accepted():
    assert clean_time([5.0]).time.tolist() == [5.0]
    events = clean_time([1.0, 1.0, 4.0, 4.0, 9.0], sampled=False)
    assert events.time.tolist() == [1.0, 4.0, 9.0]
    assert events.findings[0].severity == "loss"


def test_the_start_of_an_epoch_is_returned_in_the_unit_of_the_stamps():
    assert epoch_start(np.array([np.nan, 1.7e12, 1.7e12 + 1.0]), 1e-3) == 1.7e12
    assert epoch_start(np.array([1.7e12]), 1e-6) == 0.0
    assert epoch_start(np.array([np.nan]), 1.0) == 0.0


def test_the_derivative_of_a_ramp_is_its_slope_and_a_missing_sample_is_skipped():
    time = np.arange(500) * 1e-3
    position = 3.0 * time
    position[100:110] = np.nan
    speed = differentiate(series(time, position), 50.0, "m/s")
    assert speed.unit == "m/s"
    present = np.isfinite(position)
    present[0] = False
    np.testing.assert_allclose(speed.values[present, 0], 3.0, rtol=1e-9)
    assert np.isnan(speed.values[100:110]).all()


def test_the_derivative_lags_by_its_two_low_passes_and_is_causal():
    time = np.arange(2000) * 1e-3
    position = 0.5 * time**2
    speed = differentiate(series(time, position), 50.0, "m/s").values[:, 0]
    lag = time[1999] - speed[1999]
    assert lag == pytest.approx(2.0 / (2.0 * np.pi * 50.0), rel=0.2)
    cut = differentiate(series(time[:900], position[:900]), 50.0, "m/s").values[:, 0]
    np.testing.assert_array_equal(cut, speed[:900])


def test_the_hold_time_of_a_value_depends_on_the_rate_so_far_and_not_on_a_later_rate():
    """If the rate of a log increases, the slow samples before do not expire earlier."""
    slow, fast = np.arange(20) * 0.01, 0.2 + np.arange(2000) * 1e-3
    time = np.concatenate((slow, fast))
    values = np.arange(len(time), dtype=float)
    clock = np.arange(0.0, 0.19, 1e-3)
    whole = previous_value(series(time, values), clock)
    part = previous_value(series(slow, values[:20]), clock)
    np.testing.assert_array_equal(whole, part)
    assert np.isfinite(whole).all()


@given(st.lists(st.sampled_from([0.9, 0.95, 1.0, 1.0, 1.0, 1.04, 1.05, 1.2, 2.5, 2.6, 9.0]), max_size=40))
def test_a_clock_seen_as_regular_at_first_sight_has_neither_gaps_nor_jitter(steps):
    time = np.cumsum([0.0, *steps])
    period = float(np.median(np.diff(time))) if steps else 0.0
    assert gaps_of(time, period, "time") == gaps_in([time], period, "time")


def as_shown(findings: Iterable[Finding]) -> list[tuple[str, str, str]]:
    """Return kind, severity and sentence: a number summed in another order is equal only to the digits shown."""
    return [(finding.kind, finding.severity, str(finding)) for finding in findings]


@st.composite
def clocks(draw: st.DrawFn) -> np.ndarray:
    """Draw time stamps with gaps, less than a fifth of which are missing, repeated or run backward.

    Some clocks are counters that wrap, some restart.
    """
    count = draw(st.integers(20, 120))
    time = np.cumsum(draw(st.lists(st.sampled_from([0.01, 0.01, 0.012, 0.5]), min_size=count, max_size=count)))
    for row in draw(st.lists(st.integers(1, count - 1), max_size=count // 10)):
        time[row] = draw(st.sampled_from([np.nan, time[row - 1], 0.0]))
    wrap = draw(st.integers(1, count - 1))
    kind = draw(st.sampled_from(["", "restarts", "wraps"]))
    if kind == "restarts":
        time[wrap:] -= time[wrap] if np.isfinite(time[wrap]) else 0.0
    return (np.arange(count) + 2.0**16 - wrap) % 2**16 if kind == "wraps" else time


@given(clocks(), st.integers(1, 9), st.sampled_from([0, 2]))
def test_a_clock_in_pieces_is_cleaned_as_a_whole_clock(stamps, parts, first_row):
    pieces = np.array_split(stamps, parts)
    cleaner = ClockCleaner()
    times = [cleaner.times(piece, piece) for piece in pieces]
    times.append(cleaner.times(np.empty(0), np.empty(0), final=True))
    whole = clean_time(stamps, first_row)
    assert np.array_equal(np.concatenate(times), whole.time)
    assert as_shown(cleaner.findings(first_row)) == as_shown(whole.findings)
    series = Series(whole.time, np.zeros(len(whole.time)), "s")
    assert as_shown(gaps_in(times, series.period, "time")) == as_shown(gaps_in([whole.time], series.period, "time"))
