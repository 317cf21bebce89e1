"""Friction over speed and position: means, standard errors between strokes, random profiles."""

from __future__ import annotations

import numpy as np
import pytest

from cdtool.commands.identify.evidence import friction_curve, speed_edges


def test_the_curve_of_a_line_is_the_line():
    speed = np.linspace(-0.3, 0.3, 6001)
    edges = speed_edges(speed)
    curve = friction_curve(speed, 200.0 * speed, np.arange(6001) % 5, edges)
    assert len(curve.mean) == len(edges) - 1
    np.testing.assert_allclose(curve.mean, 200.0 * curve.abscissa, atol=0.05)
    assert curve.count.sum() == 6001


def test_the_standard_error_is_that_between_strokes_not_between_samples():
    rng = np.random.default_rng(1)
    stroke = np.repeat(np.arange(16), 200)
    force = rng.standard_normal(16)[stroke] + 0.1 * rng.standard_normal(3200)
    curve = friction_curve(np.full(3200, 0.5), force, stroke, np.array([0.0, 1.0]))
    assert curve.standard_error[0] == pytest.approx(0.25, rel=0.4)
