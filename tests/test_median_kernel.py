"""Medians and quantiles by kernels against numpy's, bit by bit."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from cdtool.median_kernel import median_of, median_of_known, quantile_of
from tests.bits import VALUES, assert_same_bits

_FINITE = st.sampled_from([0.0, -0.0, 1.0, -1.0, 2.5, 1e300, -1e-300])


@settings(max_examples=300, deadline=None)
@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # of numpy, for empty input and infinite values
@given(st.integers(0, 90).flatmap(lambda n: arrays(np.float64, n, elements=st.one_of(VALUES, _FINITE))))
def test_a_median_has_the_bits_of_numpys(values):
    scratch = np.concatenate((values, [np.nan, -5.0]))
    assert_same_bits(np.array(median_of(scratch, len(values))), np.array(np.median(values)))
    np.testing.assert_array_equal(np.sort(scratch[: len(values)]), np.sort(values))  # reordered, none lost


@settings(max_examples=300, deadline=None)
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@given(
    st.integers(1, 90).flatmap(lambda n: arrays(np.float64, n, elements=st.one_of(VALUES, _FINITE))),
    st.sampled_from([0.0, 1.0 / 3.0, 0.5, 0.95, 1.0]),
)
def test_a_quantile_has_the_bits_of_numpys_the_sign_of_a_zero_apart(values, share):
    ours, theirs = quantile_of(values.copy(), len(values), share), np.quantile(values, share)
    assert_same_bits(np.array(0.0 + ours), np.array(0.0 + theirs))


@pytest.mark.parametrize("count", [1, 2, 40, 5001, 1_000_000])
@pytest.mark.parametrize("order", ["ascending", "descending", "equal", "there and back", "valley", "ramps", "random"])
def test_no_order_of_the_values_is_slow_or_wrong(count, order):
    # In n^2 steps, the longest ones would take half an hour.
    ascending = np.arange(count, dtype=float)
    there_and_back = np.minimum(ascending, ascending[::-1])
    made = {
        "ascending": ascending,
        "descending": ascending[::-1],
        "equal": 0.0 * ascending,
        "there and back": there_and_back,
        "valley": -there_and_back,
        "ramps": np.minimum(there_and_back, count // 4),
        "random": np.random.default_rng(1).normal(size=count),
    }
    values = np.array(made[order])
    assert median_of(values.copy(), count) == np.median(values)


KNOWN_OR_NOT = st.sampled_from([0.0, 0.5, 1.0, 1.0 + 1e-15, 1.5, -1.0, -2.0, np.inf, -np.inf, np.nan])


@given(st.lists(KNOWN_OR_NOT, max_size=40), st.integers(1, 12))
def test_the_median_of_known_values_is_numpys(values, least):
    samples = np.array(values, dtype=np.float64)
    known = samples[np.isfinite(samples)]
    expected = np.median(known) if len(known) >= least else np.nan
    np.testing.assert_array_equal(median_of_known(samples, np.empty(len(samples)), least), expected)
