"""The level of a channel: the mean of the samples in the 50 ms up to each one."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdtool.recordings.recording import Series
from cdtool.thresholds.normal_motion import FILLED, LEVEL_SECONDS, levels_of

VALUES = st.sampled_from([0.0, 1.0, -2.5, 1e3, 0.1, 1e-9, np.nan, np.nan, np.inf])


def _without_lone_spikes(values):
    """The median of each known value with its two neighbours; itself where one of them is not known."""
    result = values.copy()
    for k in range(1, len(values) - 1):
        for j in range(values.shape[1]):
            three = values[k - 1 : k + 2, j]
            if not np.isnan(three).any() and np.isfinite([three[1], np.median(three)]).all():
                result[k, j] = np.median(three)
    return result


@given(st.data(), st.integers(2, 60), st.integers(1, 3), st.sampled_from([1e-3, 0.0123, 0.05, 0.2]))
def test_a_level_is_the_mean_of_the_last_samples_and_unknown_after_a_gap(data, count, joints, period):
    steps = data.draw(st.lists(st.sampled_from([0.5, 1.0, 1.0, 1.3, 7.0]), min_size=count, max_size=count))
    time = period * np.cumsum(np.array(steps))
    flat = data.draw(st.lists(VALUES, min_size=count * joints, max_size=count * joints))
    series = Series(time, np.array(flat).reshape(count, joints), "N")
    enough = max(FILLED * min(LEVEL_SECONDS / series.period, count), 1.0)
    found, values = levels_of(series), _without_lone_spikes(series.values)
    for k in range(count):
        for j in range(joints):
            last = values[: k + 1, j][time[: k + 1] > time[k] - LEVEL_SECONDS]
            known = last[np.isfinite(last)]
            expected = known.mean() if len(known) >= enough else np.nan
            np.testing.assert_allclose(found[k, j], expected, rtol=1e-9, atol=1e-9)


def test_a_level_keeps_its_digits_at_a_large_offset():
    time = np.arange(1000) * 1e-3
    series = Series(time, 1e9 + 1e-3 * np.arange(1000.0), "N")
    assert levels_of(series)[500, 0] - 1e9 == pytest.approx(0.4755, abs=1e-6)


def test_a_single_sample_is_its_own_level():
    assert levels_of(Series(np.zeros(1), np.full((1, 2), 3.0), "N")).tolist() == [[3.0, 3.0]]
