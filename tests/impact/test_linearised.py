"""Transfer functions of the driven load: reference values, and agreement with the simulated small motion."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from cdtool.base.errors import UsageError
from cdtool.impact.control_loop import control_by_force, torque_by_force
from cdtool.impact.examples import chapter_4 as example
from cdtool.impact.linearised import (
    linearised_contact,
    motor_by_penetration,
    motor_by_torque,
    penetration_by_momentum,
    resonances,
)
from cdtool.impact.rigidity import rigidity
from cdtool.impact.transmissions.transfer import Transfer, second_order

BODE_4_4 = [
    (0.1, 112.7, 692.6, 0.0922),
    (1, 356.5, 1231.7, 0.0519),
    (10, 1127.4, 2190.3, 0.0312),
    (50, 2520.9, 3275.2, 0.0347),
    (91, 3400.8, 3804.2, 0.0490),
]
TABLE_4_36 = [
    (0.01, 0.0998, 1.322, 1.010),
    (0.05, 0.2212, 1.334, 1.051),
    (0.1, 0.3093, 1.349, 1.106),
    (0.3, 0.5107, 1.415, 1.353),
    (1, 0.7780, 1.696, 2.533),
    (10, 0.9782, 4.265, 23.2),
]
LIMIT = 1.0444e6


def about(depth_um: float, speed: float = 0.25) -> Transfer:
    return motor_by_torque(example.TRANSMISSION, linearised_contact(example.CONTACT, 1e-6 * depth_um, speed))


@pytest.mark.parametrize(("depth", "stiffness", "natural", "ratio"), BODE_4_4)
def test_figure_4_4_has_the_reference_values(depth, stiffness, natural, ratio):
    found = second_order(about(depth))
    assert 1.0 / found.gain == pytest.approx(stiffness, rel=1e-3)
    assert found.natural_frequency == pytest.approx(natural, rel=1e-3)
    assert found.damping_ratio == pytest.approx(ratio, abs=1e-4)


def test_in_contact_the_gain_is_one_over_k_and_above_it_falls_by_40_db_a_decade():
    found = about(10)
    assert abs(found.response(np.array([1e-3]))[0]) == pytest.approx(found.gain, rel=1e-6)
    high = np.array([1e6, 1e7])
    size = np.abs(found.response(high))
    assert size == pytest.approx(1.0 / (2.35e-4 * high**2), rel=1e-3)
    assert 20.0 * math.log10(size[1] / size[0]) == pytest.approx(-40.0, abs=0.01)


def test_before_the_contact_there_is_a_pole_at_the_origin_and_one_of_friction():
    found = motor_by_torque(example.TRANSMISSION)
    assert sorted(found.poles.real) == pytest.approx([-127.66, 0.0], abs=0.01)
    assert found.gain == pytest.approx(1.0 / 0.03)
    with pytest.raises(UsageError, match="no second order"):
        second_order(found)


def test_no_linear_contact_is_given_where_nothing_touches():
    with pytest.raises(UsageError, match="penetration"):
        linearised_contact(example.CONTACT, 0.0, 0.1)
    with pytest.raises(UsageError, match="no contact force"):
        linearised_contact(example.CONTACT, 1e-6, -10.0)


def test_figure_4_7_has_its_gains_antiresonance_and_slopes():
    free, own = example.ELASTIC, example.ELASTIC.transmission_frequency
    for contact in (1e4, 1e5, 1e6, 1e7):
        found = penetration_by_momentum(free, contact)
        assert found.gain == pytest.approx(1.0 / contact)
        assert np.abs(found.zeros.imag) == pytest.approx([own, own])
        lower, upper = resonances(free, contact)
        assert lower < own < upper
        # Between the resonances lies that of the drive: there 4.29 is -(k_el/r)^2, below 0, whatever K_c is.
        assert np.polyval(found.denominator, 1j * own) == pytest.approx(-((100.0 / 0.015) ** 2), rel=1e-9)
        assert lower * upper == pytest.approx(math.sqrt(contact * 100.0 / (1e-4 * 0.6)), rel=1e-9)
    follow = motor_by_penetration(free)
    assert 0.015 * follow.gain == pytest.approx(1.0)
    assert 0.015 * abs(follow.response(np.array([math.sqrt(2.0) * own]))[0]) == pytest.approx(1.0)
    for damping, slope in ((0.0, -40.0), (0.01, -20.0)):
        size = np.abs(motor_by_penetration(replace(free, damping=damping)).response(np.array([1e6, 1e7])))
        assert 20.0 * math.log10(size[1] / size[0]) == pytest.approx(slope, abs=0.2)


@pytest.mark.parametrize(("share", "lower", "upper", "ratio"), TABLE_4_36)
def test_the_condition_4_36_has_the_reference_values(share, lower, upper, ratio):
    found = rigidity(example.ELASTIC, share * LIMIT)
    assert found.limit == pytest.approx(LIMIT, rel=1e-4)
    assert found.lower_resonance / found.transmission_frequency == pytest.approx(lower, abs=1e-4)
    assert found.upper_resonance / found.transmission_frequency == pytest.approx(upper, abs=1e-3)
    assert found.motion_ratio == pytest.approx(ratio, rel=2e-3)
    assert found.rigid == (share <= 0.1)
    assert ("may be taken as rigid" in found.words) == found.rigid


def test_the_motor_moves_at_the_lower_resonance_as_much_more_as_the_condition_says():
    for share in (0.05, 0.3, 1.0):
        found = rigidity(example.ELASTIC, share * LIMIT)
        response = motor_by_penetration(example.ELASTIC).response(np.array([found.lower_resonance]))[0]
        assert 0.015 * abs(response) == pytest.approx(found.motion_ratio, rel=1e-9)


def test_a_force_reaches_the_torque_as_in_the_example_of_4_39():
    found = torque_by_force(example.TRANSMISSION, example.SPEED_LOOP)
    poles = sorted(found.poles, key=lambda pole: (round(pole.real, 3), pole.imag))
    assert [pole.real for pole in poles] == pytest.approx([-307.27, -307.27, -13.12], abs=0.01)
    assert [pole.imag for pole in poles] == pytest.approx([-260.26, 260.26, 0.0], abs=0.01)
    time = np.arange(0.0, 1.0, 1e-3)
    answer = found.step(time)
    assert answer[5] == pytest.approx(0.006971, abs=1e-6)
    assert answer[20] == pytest.approx(0.010841, abs=1e-6)
    assert answer[-1] == pytest.approx(0.015, rel=1e-4) == found.gain
    # A ramp of force is followed by its integral.
    ramp = found.ramp(time)
    steps = np.concatenate([[0.0], np.cumsum(0.5e-3 * (answer[1:] + answer[:-1]))])
    assert ramp == pytest.approx(steps, abs=1e-6)


def test_the_control_action_is_ahead_of_the_torque_by_the_actuator():
    torque = torque_by_force(example.TRANSMISSION, example.SPEED_LOOP)
    control = control_by_force(example.TRANSMISSION, example.SPEED_LOOP)
    frequency = np.geomspace(0.1, 1e4, 50)
    lag = 1.0 / (0.002j * frequency + 1.0)
    assert control.response(frequency) * lag == pytest.approx(torque.response(frequency), rel=1e-9)
    time = np.arange(0.0, 0.02, 1e-4)
    assert np.all(control.step(time)[1:] > torque.step(time)[1:])
