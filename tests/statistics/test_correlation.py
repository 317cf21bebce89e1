"""The correlation of two series, bit by bit against numpy's."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdtool.statistics.correlation import correlation


@settings(max_examples=300, deadline=None)
@given(
    st.integers(2, 700), st.integers(0, 2**31), st.sampled_from([0.0, 1e-9, 0.3, 5.0]), st.sampled_from([1.0, 1e150])
)
def test_correlation_has_the_bits_of_numpy(count, seed, noise, scale):
    random = np.random.default_rng(seed)
    a = random.normal(size=count) * scale + random.normal()
    b = -0.1 * a + noise * random.normal(size=count)
    assert correlation(a, b) == np.corrcoef(a, b)[0, 1]
    assert correlation(a[::-1], b) == np.corrcoef(a[::-1], b)[0, 1]


@pytest.mark.parametrize("length", [0, 1, 5])
def test_correlation_of_a_constant_or_too_short_series_is_not_known(length):
    assert math.isnan(correlation(np.full(length, 0.5), np.arange(float(length))))
    assert math.isnan(correlation(np.arange(float(length)), np.zeros(length)))


def test_rounding_errors_do_not_correlate():
    rounded = 0.3 * (1.0 + 1e-16 * np.random.default_rng(1).standard_normal(50))
    assert math.isnan(correlation(rounded, np.arange(50.0))) and math.isnan(correlation(np.arange(50.0), rounded))
