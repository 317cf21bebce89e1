"""The low-pass against closed forms, gaps, least squares, instrumental variables, standard errors."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdtool.commands.identify.axis.filtered_regression import (
    LowPass,
    block_covariance,
    fit_linear,
)

PERIOD = 1e-3
TIME = np.arange(4000) * PERIOD


@given(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.sampled_from([5.0, 20.0, 80.0]))
def test_the_derivatives_of_a_parabola_are_exact(offset, slope, curvature, corner):
    low_pass = LowPass(corner, PERIOD)
    time = TIME[:1500]
    signal = offset + slope * time + 0.5 * curvature * time**2
    inside = slice(low_pass.reach, -low_pass.reach)
    np.testing.assert_allclose(low_pass.slope(signal)[inside], (slope + curvature * time)[inside], atol=1e-8)
    np.testing.assert_allclose(low_pass.curvature(signal)[inside], curvature, atol=1e-5)


@pytest.mark.parametrize("corner", [5.0, 20.0, 60.0])
def test_the_corner_of_the_low_pass_is_where_it_is_stated(corner):
    low_pass = LowPass(corner, PERIOD)
    assert low_pass.corner_hz == pytest.approx(corner, rel=0.15)
    wave = np.sin(2.0 * math.pi * low_pass.corner_hz * TIME)
    assert np.nanmax(low_pass.value(wave)) == pytest.approx(math.sqrt(0.5), rel=0.04)


def test_instruments_remove_the_bias_of_noise_in_the_regressors():
    """Errors in variables: least squares is low by the factor var(x) / (var(x) + var(noise)) = 0.8."""
    rng = np.random.default_rng(2)
    truth = rng.standard_normal(40_000)
    measured = truth + 0.5 * rng.standard_normal(40_000)
    force = 3.0 * truth
    plain = fit_linear(measured[:, None], force)
    cured = fit_linear(measured[:, None], force, truth[:, None])
    assert plain.coefficients[0] == pytest.approx(2.4, rel=0.02)
    assert cured.coefficients[0] == pytest.approx(3.0, rel=0.01)


def test_the_block_covariance_is_the_jackknife():
    rng = np.random.default_rng(6)
    regressors, force = rng.standard_normal((120, 2)) * [1.0, 50.0], rng.standard_normal(120)
    block = np.repeat(np.arange(6), 20)
    fit = fit_linear(regressors, force)
    changes = np.array(
        [fit.coefficients - fit_linear(regressors[block != g], force[block != g]).coefficients for g in range(6)]
    )
    np.testing.assert_allclose(block_covariance(fit, block), 5.0 / 6.0 * changes.T @ changes, rtol=1e-6)


def test_block_standard_errors_cover_a_level_per_block():
    rng = np.random.default_rng(8)
    block = np.repeat(np.arange(10), 50)
    inside = []
    for _ in range(200):
        force = 4.0 + rng.standard_normal(10)[block] + rng.standard_normal(500)
        fit = fit_linear(np.ones((500, 1)), force)
        error = math.sqrt(block_covariance(fit, block)[0, 0])
        inside.append(abs(fit.coefficients[0] - 4.0) / error)
    assert np.mean(np.array(inside) < 1.0) >= 0.55
    assert np.mean(np.array(inside) < 2.0) >= 0.85
