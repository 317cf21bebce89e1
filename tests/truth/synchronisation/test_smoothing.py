"""Local derivatives of signals with irregular clocks and gaps, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdtool.truth.synchronisation.smoothing import local_derivative


def jittered(rng: np.random.Generator, count: int, period: float = 1e-3) -> np.ndarray:
    return np.cumsum(rng.uniform(0.3 * period, 1.7 * period, count))


@given(st.integers(0, 1000), st.tuples(*[st.floats(-3.0, 3.0)] * 4))
def test_a_polynomial_of_the_fitted_degree_has_its_exact_derivatives(seed, coefficients):
    time = jittered(np.random.default_rng(seed), 300)
    at = np.array([0.12, 0.15])
    for order in (0, 1, 2):
        polynomial = np.polynomial.Polynomial(coefficients[: order + 2])
        expected = polynomial.deriv(order)(at) if order else polynomial(at)
        found = local_derivative(time, polynomial(time), at, 5e-3, order)
        assert found == pytest.approx(expected, abs=1e-6)


def test_a_gap_is_missing_and_a_missing_sample_is_not():
    time = np.arange(1000) * 1e-3
    values = 2.0 * time
    values[[400, 403]] = np.nan
    kept = (time < 0.6) | (time > 0.7)
    found = local_derivative(time[kept], values[kept], np.array([0.4, 0.65, 0.9]), 4e-3)
    assert found[[0, 2]] == pytest.approx([0.8, 1.8]) and np.isnan(found[1])
