"""Local derivatives of signals with irregular clocks and gaps, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdtool.truth.synchronisation.smoothing import Grid, local_derivative


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


@pytest.mark.parametrize("order", [1, 2])
def test_the_derivative_is_that_of_the_smoothed_signal(order):
    time, width, rate = np.arange(4000) * 1e-3, 8e-3, 40.0
    signal = np.sin(rate * time)
    true = np.cos(rate * time) * rate if order == 1 else -np.sin(rate * time) * rate**2
    at = np.arange(1.0, 2.0, 0.01)
    derived, smoothed = local_derivative(time, signal, at, width, order), local_derivative(time, true, at, width)
    assert derived == pytest.approx(smoothed, abs=5e-3 * rate**order)


def test_a_gap_is_missing_and_a_missing_sample_is_not():
    time = np.arange(1000) * 1e-3
    values = 2.0 * time
    values[[400, 403]] = np.nan
    kept = (time < 0.6) | (time > 0.7)
    found = local_derivative(time[kept], values[kept], np.array([0.4, 0.65, 0.9]), 4e-3)
    assert found[[0, 2]] == pytest.approx([0.8, 1.8]) and np.isnan(found[1])


@pytest.mark.parametrize("count", [0, 1, 2])
def test_too_few_samples_are_missing(count):
    assert np.isnan(local_derivative(np.arange(count) * 0.1, np.ones(count), np.array([0.1]), 0.05)).all()


def test_a_burst_of_samples_does_not_displace_the_others(monkeypatch):
    time = np.sort(np.concatenate((np.arange(500) * 1e-3, 0.25 + np.arange(3000) * 1e-7)))
    values = np.sin(20.0 * time)
    at = np.linspace(0.1, 0.4, 200)
    whole = local_derivative(time, values, at, 4e-3)
    monkeypatch.setattr("cdtool.truth.synchronisation.smoothing._BLOCK", 5000)
    assert np.array_equal(local_derivative(time, values, at, 4e-3), whole, equal_nan=True)


def test_grids_of_one_step_share_their_points():
    first, second = Grid.over(0.013, 1.0, 0.01), Grid.over(-0.2, 2.0, 0.01)
    assert np.isin(np.round(first.times / 0.01), np.round(second.times / 0.01)).all()
    assert Grid.over(1.0, 0.5, 0.01).count == 0
