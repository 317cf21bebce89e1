"""Quantiles of more values than memory can hold."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from cdtool.recordings.distribution import Distribution

FINITE = st.floats(-1e12, 1e12, allow_subnormal=False)


def fed(values: np.ndarray, parts: int, most: int) -> Distribution:
    found = Distribution(most)
    for part in np.array_split(values, parts):
        found.add(part)
    return found


@given(arrays(np.float64, st.integers(1, 60), elements=FINITE), st.integers(1, 5), st.floats(0.0, 100.0))
def test_few_distinct_values_give_the_quantiles_of_numpy(values, parts, percent):
    found = fed(values, parts, most=64)
    assert found.resolution == 0.0 and found.count == len(values)
    assert found.median == np.median(values)
    assert found.percentile(percent) == pytest.approx(np.percentile(values, percent), rel=1e-12, abs=1e-9)


@given(arrays(np.float64, st.integers(100, 400), elements=FINITE, unique=True), st.integers(1, 5))
def test_many_distinct_values_are_right_to_the_resolution_that_it_states(values, parts):
    found = fed(values, parts, most=32)
    assert found.count == len(values)
    low, high = np.sort(values)[[(len(values) - 1) // 2, len(values) // 2]]
    slack = found.resolution * max(abs(low), abs(high))
    assert low - slack <= found.median <= high + slack
