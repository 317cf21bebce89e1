"""Samples that are held until the next, rows that are samples of a lower rate, and the usual step of a clock."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdtool.recordings.clock import previous_value
from cdtool.recordings.clock.held_samples import hold_last
from cdtool.recordings.clock.lower_rate import sampled_rows
from cdtool.recordings.clock.recent_steps import RECENT_STEPS, recent_medians
from cdtool.recordings.recording import Series


@st.composite
def series_and_times(draw):
    steps = draw(st.lists(st.floats(0.01, 2.0), min_size=1, max_size=25))
    values = draw(
        st.lists(st.sampled_from([0.0, -0.0, 1.5, math.nan, math.inf]), min_size=len(steps), max_size=len(steps))
    )
    clock = np.cumsum(draw(st.lists(st.floats(0.01, 3.0), max_size=20))) - draw(st.floats(0.0, 3.0))
    return Series(np.cumsum(steps), values, "m/s"), clock


@given(series_and_times())
def test_the_value_held_depends_on_no_later_time(drawn):
    series, clock = drawn
    period = np.full(len(series), np.inf)
    if len(series) > 1:
        steps = np.diff(series.time)
        period[1:] = recent_medians(steps, float(steps[0]))
    at = np.searchsorted(series.time, clock, side="right") - 1
    newest = np.maximum(at, 0)
    is_missing = (at < 0) | (clock - series.time[newest] > 5.0 * period[newest])
    expected = np.where(is_missing[:, np.newaxis], np.nan, series.values[newest])
    assert previous_value(series, clock).tobytes() == expected.tobytes()


@given(st.lists(st.tuples(st.booleans(), st.booleans()), max_size=12))
def test_what_is_missing_is_held(marks):
    missing = np.array(marks, dtype=bool).reshape(-1, 2)
    values = np.arange(1.0, 2.0 * len(missing) + 1.0).reshape(-1, 2)
    last = np.zeros(2)
    for k, held in enumerate(hold_last(values, missing)):
        last = np.where(missing[k], last, values[k])
        assert held.tolist() == last.tolist()


STEPS = st.lists(st.sampled_from([0.0, 0.001, 0.00101, 0.002, 0.5, 1e9, np.inf, np.nan]), max_size=40)


@given(STEPS, st.sampled_from([0.001, 0.5, np.nan]))
def test_medians_are_the_bits_of_sliding_windows(steps, before):
    values = np.array(steps, dtype=np.float64)
    padded = np.concatenate((np.full(RECENT_STEPS - 1, before), values))
    windows = [padded[k : k + RECENT_STEPS] for k in range(len(values))]
    expected = [np.median(window) for window in windows]
    np.testing.assert_array_equal(recent_medians(values, before), expected)


def every(count, step, start=0):
    values = np.full(count, np.nan)
    values[start::step] = np.arange(len(values[start::step]))
    return values


@pytest.mark.parametrize("step", [2, 3, 4, 10])
@pytest.mark.parametrize("start", [0, 1])
def test_the_rows_with_a_value_are_the_samples_of_a_lower_rate(step, start):
    values = every(100, step, start)
    assert np.flatnonzero(sampled_rows(values)).tolist() == list(range(start, 100, step))


def test_a_lost_sample_of_a_lower_rate_stays_a_pause():
    values = every(100, 4)
    values[40] = np.nan
    assert np.flatnonzero(sampled_rows(values)).tolist() == [i for i in range(0, 100, 4) if i != 40]
