"""The usual step of a clock: the bits of a median over sliding windows, and once for each array of times."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from cdtool.recordings.clock.recent_steps import RECENT_STEPS, recent_medians

STEPS = st.lists(st.sampled_from([0.0, 0.001, 0.00101, 0.002, 0.5, 1e9, np.inf, np.nan]), max_size=40)


@given(STEPS, st.sampled_from([0.001, 0.5, np.nan]))
def test_medians_are_the_bits_of_sliding_windows(steps, before):
    values = np.array(steps, dtype=np.float64)
    padded = np.concatenate((np.full(RECENT_STEPS - 1, before), values))
    windows = [padded[k : k + RECENT_STEPS] for k in range(len(values))]
    expected = [np.median(window) for window in windows]
    np.testing.assert_array_equal(recent_medians(values, before), expected)
