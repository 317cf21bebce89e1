"""Channels on another clock and their lost samples: the bits of searching, sliding medians and masks over arrays."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.detectors.base import held_on, missing_after_first
from cdtool.recordings.clock import HOLD_PERIODS, previous_value
from cdtool.recordings.clock.held_samples import hold_last
from cdtool.recordings.clock.lost_samples import lost_samples
from cdtool.recordings.clock.recent_steps import RECENT_STEPS
from cdtool.recordings.recording import Recording, Series

# Steps [ms]: jitter, lost samples, pauses and bursts.
STEPS = st.lists(st.sampled_from([1.0, 1.0, 1.01, 0.98, 1.3, 2.0, 3.1, 4.9, 5.0, 9.0, 40.0, 0.001]), max_size=70)
VALUES = st.sampled_from([1.0, -2.5, 0.0, 7.25, np.nan, np.inf, -np.inf])


@st.composite
def channels_and_clocks(draw) -> tuple[Series, FloatArray]:
    """A channel of one or two joints, and a clock: its own, some of its times, or another one."""
    time = draw(st.floats(0.0, 0.02)) + 1e-3 * np.cumsum(draw(STEPS))
    joints = draw(st.integers(1, 2))
    values = np.array(draw(st.lists(VALUES, min_size=joints * len(time), max_size=joints * len(time))))
    kind = draw(st.sampled_from(["own", "some", "other"]))
    clock = draw(st.floats(0.0, 0.02)) + 1e-3 * np.cumsum(draw(STEPS)) if kind == "other" else time.copy()
    if kind == "some" and len(clock):
        clock = clock[draw(st.lists(st.booleans(), min_size=len(clock), max_size=len(clock)))]
    return Series(time, values.reshape(len(time), joints), "N"), clock


def usual_and_longest(time: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The median and the longest of the last 9 steps, infinite at the first sample."""
    usual, longest = np.full(len(time), np.inf), np.full(len(time), np.inf)
    steps = np.diff(time)
    if len(steps):
        padded = np.concatenate((np.full(RECENT_STEPS - 1, steps[0]), steps))
        windows = np.lib.stride_tricks.sliding_window_view(padded, RECENT_STEPS)
        usual[1:], longest[1:] = np.median(windows, axis=1), windows.max(axis=1)
    return usual, longest


def expected_values(series: Series, clock: FloatArray) -> FloatArray:
    if np.array_equal(series.time, clock):
        return series.values
    if not len(series):
        return np.full((len(clock), series.joint_count), np.nan)
    at = np.searchsorted(series.time, clock, side="right") - 1
    newest = np.maximum(at, 0)
    too_old = clock - series.time[newest] > HOLD_PERIODS * usual_and_longest(series.time)[0][newest]
    return np.where(((at < 0) | too_old)[:, np.newaxis], np.nan, series.values[newest])


def expected_lost(series: Series, clock: FloatArray) -> BoolArray:
    missing = ~np.isfinite(series.values)
    if np.array_equal(series.time, clock):
        return missing
    at = np.searchsorted(series.time, clock, side="right") - 1
    newest = np.maximum(at, 0)
    age = clock - series.time[newest]
    usual, longest = usual_and_longest(series.time)
    late = age > 1.5 * np.minimum(longest, 2.0 * usual)[newest]
    shared = np.array([np.count_nonzero(age[max(k - 20, 0) : k] == 0.0) >= 15 for k in range(len(clock))], dtype=bool)
    late |= shared & (age > 0.0)
    return (missing[newest] | late[:, np.newaxis]) & (at >= 0)[:, np.newaxis]


@given(channels_and_clocks())
def test_values_on_another_clock_are_the_bits_of_a_search(case):
    series, clock = case
    expected = expected_values(series, clock)
    np.testing.assert_array_equal(previous_value(series, clock), expected)
    held, missing = held_on(clock, series)
    np.testing.assert_array_equal(missing, ~np.isfinite(expected))
    last = np.zeros(series.joint_count)
    for row, marks, found in zip(expected, missing, held, strict=True):
        last = np.where(marks, last, row)
        np.testing.assert_array_equal(found, last)


@given(channels_and_clocks())
def test_lost_samples_are_the_bits_of_masks_over_arrays(case):
    series, clock = case
    recording = Recording("run", "", tuple("ab"[: series.joint_count]), {"torque": series})
    found = lost_samples(recording, ("torque", "speed"), clock)
    expected = expected_lost(series, clock) if len(series) else np.zeros((len(clock), series.joint_count), dtype=bool)
    if found is None:
        assert not expected.any()
    else:
        np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize("clock", [[5.0, 1.0, 3.0, 0.5, 99.5], [99.0, 98.0], [-1.0, 50.0, -1.0], []])
def test_times_that_jump_far_ahead_or_go_back_are_searched_for(clock):
    series = Series(np.arange(100.0), np.arange(100.0), "N")
    np.testing.assert_array_equal(previous_value(series, np.array(clock)), expected_values(series, np.array(clock)))


@given(st.lists(st.tuples(st.booleans(), st.booleans()), max_size=12))
def test_what_is_missing_is_held_and_marked_once_there_was_a_sample(marks):
    missing = np.array(marks, dtype=bool).reshape(-1, 2)
    values = np.arange(1.0, 2.0 * len(missing) + 1.0).reshape(-1, 2)
    rows = np.maximum.accumulate(np.where(missing, -1, np.arange(len(missing))[:, np.newaxis]), axis=0)
    expected = np.where(rows < 0, 0.0, np.take_along_axis(values, np.maximum(rows, 0), axis=0)) if len(rows) else values
    np.testing.assert_array_equal(hold_last(values, missing), expected)
    np.testing.assert_array_equal(missing_after_first(missing), missing & (rows >= 0))
