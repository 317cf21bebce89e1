"""A decimated series draws the same as the whole one."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from cdtool.base.arrays import FloatArray
from cdtool.results.traces.decimation import decimate

numbers = st.one_of(st.floats(-1e6, 1e6), st.just(float("nan")))
series = st.integers(1, 600).flatmap(lambda n: arrays(np.float64, n, elements=numbers, fill=st.floats(-1.0, 1.0)))
pixels = st.integers(2, 40)


def clock(values: FloatArray) -> FloatArray:
    steps = np.random.default_rng(len(values)).uniform(0.5, 1.5, len(values))
    return np.cumsum(steps)


@given(series, pixels)
def test_least_largest_first_and_last_value_stay_and_the_size_is_bounded(values, pixels):
    time = clock(values)
    kept_time, kept = decimate(time, values, pixels)
    assert len(kept) <= 4 * pixels
    assert np.all(np.diff(kept_time) > 0.0)
    for ours, whole in ((kept[0], values[0]), (kept[-1], values[-1])):
        np.testing.assert_equal(ours, whole)
    present = values[~np.isnan(values)]
    if len(present):
        assert np.nanmin(kept) == present.min()
        assert np.nanmax(kept) == present.max()
    else:
        assert np.isnan(kept).all()


def test_a_spike_and_the_extremes_of_each_column_survive_a_million_samples():
    time = np.arange(1_000_000) * 1e-3
    values = np.sin(time)
    values[123_456] = 9.0
    values[700_000:800_000] = np.nan
    kept_time, kept = decimate(time, values, 500)
    assert 500 < len(kept) <= 2000
    assert 9.0 in kept
    inside = (kept_time > 701.0) & (kept_time < 799.0)
    assert inside.any()
    assert np.isnan(kept[inside]).all()
