"""Coefficients of restitution: definitions, the exact relation of Hunt and Crossley's law, closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdtool.base.errors import UsageError
from cdtool.impact.restitution import (
    coefficients,
    damping_for_restitution,
    goldsmith,
    hunt_crossley_damping,
    hunt_crossley_damping_number,
    hunt_crossley_restitution,
    kelvin_voigt_restitution,
    lankarani_nikravesh_damping,
    newton,
    poisson,
    rate_from_force,
    stronge,
)

NUMBERS = (0.01, 0.075, 0.15, 0.3, 0.6, 1.0, 2.0)
RESTITUTIONS = (0.993377, 0.952370, 0.909016, 0.832870, 0.711950, 0.593624, 0.410720)


@settings(deadline=None)
@given(st.floats(0.01, 10.0), st.floats(0.01, 100.0), st.floats(0.0, 1.0))
def test_the_three_definitions_agree_in_a_direct_impact(mass, speed, e):
    # 3.6 and 3.9 with v_i = -speed, v_f = e speed.
    compression, whole = mass * speed, mass * (e * speed + speed)
    restored = 0.5 * mass * speed**2 * (1.0 - whole / compression) ** 2
    assert newton(-speed, e * speed) == pytest.approx(e, abs=1e-12)
    assert poisson(compression, whole) == pytest.approx(e, abs=1e-12)
    assert stronge(-0.5 * mass * speed**2, restored) == pytest.approx(e, abs=1e-9)


def test_an_impact_that_does_not_approach_has_no_restitution():
    for wrong in (lambda: newton(0.0, 1.0), lambda: poisson(0.0, 1.0), lambda: stronge(0.1, 0.1)):
        with pytest.raises(UsageError):
            wrong()


def test_a_measured_half_sine_of_force_gives_its_coefficients():
    # A free mass of 2 kg, 0.5 m/s, and a force that ends when 1.8 times the momentum has been taken: e = 0.8.
    time = np.linspace(0.0, 1e-3, 2001)
    force = np.sin(np.pi * time / 1e-3) * (1.8 * 2.0 * 0.5) * np.pi / 2e-3
    rate = rate_from_force(time, force, 2.0, 0.5)
    found = coefficients(time, rate, force)
    assert found.newton == pytest.approx(0.8, abs=1e-5)
    assert found.poisson == pytest.approx(0.8, abs=1e-5)
    assert found.stronge == pytest.approx(0.8, abs=1e-5)


@pytest.mark.parametrize("rate", [[-1.0, -1.0, -1.0], [1.0, 0.5, 0.1]])
def test_half_a_contact_is_refused(rate):
    with pytest.raises(UsageError, match="rate"):
        coefficients(np.array([0.0, 1.0, 2.0]), np.array(rate), np.ones(3))
    with pytest.raises(UsageError, match="shapes"):
        coefficients(np.zeros(3), np.zeros(2), np.zeros(3))


def test_goldsmiths_relation_takes_the_magnitude_of_the_speed_and_ends_where_nothing_is_left():
    assert goldsmith(-0.25, 0.2) == pytest.approx(math.sqrt(1.0 - 0.2 * 0.25), rel=1e-12)
    assert goldsmith(-0.25, 0.2, 0.2) == goldsmith(0.25, 0.2, 0.2)
    assert np.isnan(goldsmith(np.array([4.9, 5.1]), 0.2)).tolist() == [False, True]
    # To first order it is e = 1 - (alpha/2) v: half the alpha of 3.21.
    assert 1.0 - goldsmith(1e-3, 0.2) == pytest.approx(1e-4, rel=1e-3)


def test_the_exact_relation_has_the_reference_values():
    assert hunt_crossley_restitution(np.array(NUMBERS)) == pytest.approx(np.array(RESTITUTIONS), abs=6e-7)
    wanted = np.array([0.9, 0.8, 0.7, 0.5])
    assert hunt_crossley_damping_number(wanted) == pytest.approx([0.166482, 0.373146, 0.634828, 1.432751], abs=6e-7)


@settings(deadline=None)
@given(st.floats(1e-3, 10.0))
def test_the_exact_relation_is_kept(x):
    e = float(hunt_crossley_restitution(x))
    # As exponentials: the logarithm of 1 - e x is ill conditioned where it is nearly 0.
    assert (1.0 - e * x) * math.exp(x * (1.0 + e)) == pytest.approx(1.0 + x, rel=1e-8)


@settings(deadline=None)
@given(st.floats(1e-9, 1.0))
def test_the_damping_of_a_restitution_gives_it_back(e):
    assert hunt_crossley_restitution(hunt_crossley_damping_number(e)) == pytest.approx(e, rel=1e-10)


def test_the_series_meets_the_closed_form_where_they_change():
    around = np.array([0.02 - 1e-9, 0.02 + 1e-9])
    # Their difference is that of the slopes, 0.6492 and 1.5617, to a part in a hundred: no step in between.
    assert -np.diff(hunt_crossley_restitution(around)) == pytest.approx([2e-9 * 0.6492], rel=0.01)
    assert np.diff(hunt_crossley_damping_number(1.0 - around)) == pytest.approx([2e-9 * 1.5617], rel=0.01)


def test_the_ends_of_the_exact_relation_are_elastic_and_endless_damping():
    assert hunt_crossley_restitution(0.0) == 1.0
    assert hunt_crossley_damping_number(1.0) == 0.0
    assert hunt_crossley_damping_number(0.0) == math.inf
    assert hunt_crossley_restitution(1e9) == pytest.approx(1e-9, rel=1e-6)
    for wrong in (-0.1, 1.1):
        with pytest.raises(UsageError):
            hunt_crossley_damping_number(wrong)
    with pytest.raises(UsageError):
        hunt_crossley_restitution(-0.1)


def test_the_first_order_relations_have_the_reference_values_and_are_too_small():
    stated = {0.9: (0.15, 0.1425), 0.8: (0.30, 0.27), 0.7: (0.45, 0.3825), 0.5: (0.75, 0.5625)}
    for e, (first, second) in stated.items():
        assert hunt_crossley_damping(e, 1.0, 1.0) == pytest.approx(first, abs=1e-12)
        assert lankarani_nikravesh_damping(e, 1.0, 1.0) == pytest.approx(second, abs=1e-12)
        assert second < first < damping_for_restitution(e, 1.0, 1.0)
    for x in (0.01, 0.05, 0.1, 0.149):
        assert hunt_crossley_restitution(x) == pytest.approx(1.0 - 2.0 * x / 3.0, abs=0.01)
    # Only there: at 0.3 it is three times as far off.
    assert hunt_crossley_restitution(0.3) - (1.0 - 0.2) > 0.03


def test_kelvin_voigt_has_the_reference_restitution_with_and_without_tension():
    ratios = np.array([0.05, 0.1, 0.3])
    assert kelvin_voigt_restitution(ratios) == pytest.approx([0.858758, 0.744079, 0.450975], abs=6e-7)
    assert kelvin_voigt_restitution(ratios, tension=True) == pytest.approx([0.854468, 0.729248, 0.372326], abs=6e-7)
    stated = [
        math.exp(-z / math.sqrt(1 - z * z) * (math.pi - math.atan2(2 * z * math.sqrt(1 - z * z), 1 - 2 * z * z)))
        for z in ratios
    ]
    assert kelvin_voigt_restitution(ratios) == pytest.approx(stated, rel=1e-12)
