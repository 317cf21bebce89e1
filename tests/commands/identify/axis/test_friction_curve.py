"""Friction over speed and position: means, standard errors between strokes, random profiles."""

from __future__ import annotations

import math

import numpy as np
import pytest

from cdtool.commands.identify.axis.filtered_regression import fit_linear
from cdtool.commands.identify.axis.friction_curve import friction_curve, profile_covariance, speed_edges


def test_the_curve_of_a_line_is_the_line():
    speed = np.linspace(-0.3, 0.3, 6001)
    edges = speed_edges(speed)
    curve = friction_curve(speed, 200.0 * speed, np.arange(6001) % 5, edges)
    assert len(curve) == len(edges) - 1
    np.testing.assert_allclose(curve.mean, 200.0 * curve.abscissa, atol=0.05)
    assert curve.count.sum() == 6001


def test_speeds_of_both_signs_are_never_in_one_interval():
    edges = speed_edges(np.array([-0.13, 0.29]))
    assert np.min(np.abs(edges)) == 0.0


def test_an_interval_without_equations_is_left_out():
    curve = friction_curve(np.array([0.1, 0.9]), np.array([1.0, 2.0]), np.array([0, 1]), np.linspace(0.0, 1.0, 11))
    assert curve.abscissa.tolist() == pytest.approx([0.15, 0.95])
    assert np.isnan(curve.standard_error).all()


def test_missing_forces_are_left_out():
    curve = friction_curve(np.full(3, 0.5), np.array([1.0, np.nan, 3.0]), np.array([0, 0, 1]), np.array([0.0, 1.0]))
    assert curve.mean.tolist() == [2.0]
    assert curve.count.tolist() == [2]


def test_the_standard_error_is_that_between_strokes_not_between_samples():
    rng = np.random.default_rng(1)
    stroke = np.repeat(np.arange(16), 200)
    force = rng.standard_normal(16)[stroke] + 0.1 * rng.standard_normal(3200)
    curve = friction_curve(np.full(3200, 0.5), force, stroke, np.array([0.0, 1.0]))
    assert curve.standard_error[0] == pytest.approx(0.25, rel=0.4)


def test_random_profiles_act_as_the_true_profiles_do():
    """A coefficient of a force over position: its spread over true profiles is at most overestimated."""
    rng = np.random.default_rng(2)
    position = np.linspace(0.0, 1.0, 1000)
    direction = np.ones(1000)
    regressors = np.column_stack((np.sin(3.0 * position), np.ones(1000)))
    slopes, stated = [], []
    for _ in range(60):
        force = np.zeros(1000)
        for _ in range(5):
            length, phase = rng.uniform(0.05, 0.5), rng.uniform(0.0, 2.0 * math.pi)
            force += np.sin(2.0 * math.pi * position / length + phase)
        fit = fit_linear(regressors, force)
        slopes.append(fit.coefficients[0])
        covariance = profile_covariance(fit.influence, fit.residuals, position, direction, count=30)
        stated.append(covariance[0, 0])
    assert 0.9 < np.sqrt(np.mean(stated)) / np.std(slopes) < 3.0


def test_without_residuals_the_profile_adds_nothing():
    position = np.linspace(0.0, 1.0, 500)
    fit = fit_linear(np.column_stack((position, np.ones(500))), 3.0 * position)
    covariance = profile_covariance(fit.influence, fit.residuals, position, np.ones(500))
    assert np.abs(covariance).max() < 1e-20
