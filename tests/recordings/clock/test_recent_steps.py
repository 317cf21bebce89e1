"""The usual step of a clock: the bits of a median over sliding windows, and once for each array of times."""

from __future__ import annotations

import gc

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from cdtool.recordings.clock import recent_steps
from cdtool.recordings.clock.recent_steps import RECENT_STEPS, recent_medians, usual_steps
from cdtool.recordings.recording import Series

STEPS = st.lists(st.sampled_from([0.0, 0.001, 0.00101, 0.002, 0.5, 1e9, np.inf, np.nan]), max_size=40)


@given(STEPS, st.sampled_from([0.001, 0.5, np.nan]))
def test_medians_are_the_bits_of_sliding_windows(steps, before):
    values = np.array(steps, dtype=np.float64)
    padded = np.concatenate((np.full(RECENT_STEPS - 1, before), values))
    windows = [padded[k : k + RECENT_STEPS] for k in range(len(values))]
    expected = [np.median(window) for window in windows]
    np.testing.assert_array_equal(recent_medians(values, before), expected)


def test_the_steps_of_a_series_are_computed_once_and_released_with_it():
    series = Series(np.arange(100) * 1e-3, np.zeros(100), "m")
    gc.collect()  # those of other tests
    before = len(recent_steps._kept)
    first = usual_steps(series.time)
    assert usual_steps(series.time) is first and len(recent_steps._kept) == before + 1
    del series, first
    gc.collect()
    assert len(recent_steps._kept) == before


def test_an_array_that_can_be_written_to_is_computed_each_time():
    time = np.arange(10) * 1e-3
    first = usual_steps(time)
    time[5:] += 1.0
    assert usual_steps(time)[5] == first[5] and usual_steps(np.array([0.0, 2.0]))[1] == 2.0
    assert not first.flags.writeable and np.isinf(usual_steps(time[:1])[0]) and not len(usual_steps(time[:0]))
