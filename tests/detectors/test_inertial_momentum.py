"""The complementary filter and the inertial momentum observer against their closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from cdtool.base.arrays import FloatArray
from cdtool.detectors.inertial_momentum import InertialMomentum

IGM = InertialMomentum(crossover=10.0)  # k1 = 20, k2 = 100
TIME = np.arange(10_001) * 1e-3
NONE = np.zeros(len(TIME), dtype=bool)


def fused(speed: FloatArray, acceleration: FloatArray, standstill: float = -1.0) -> FloatArray:
    return IGM.fuse(TIME, speed, acceleration, NONE, standstill)[0]


def test_consistent_speed_and_acceleration_give_the_speed():
    speed = np.sin(2.0 * TIME) + 0.3 * np.sin(40.0 * TIME)
    acceleration = 2.0 * np.cos(2.0 * TIME) + 12.0 * np.cos(40.0 * TIME)
    later = TIME > 2.0
    assert np.max(np.abs(fused(speed, acceleration) - speed)[later]) < 4e-5
    assert np.max(np.abs(fused(speed, acceleration + 1.0) - speed)[later]) < 4e-5


def test_a_bias_rises_to_its_known_peak_and_is_then_rejected_completely():
    error = fused(np.zeros(len(TIME)), np.ones(len(TIME)))
    assert error.max() == pytest.approx(0.03679, abs=1e-5)
    assert TIME[np.argmax(error)] == pytest.approx(0.100, abs=1e-3)
    assert abs(error[-1]) < 1e-12


def test_a_standstill_at_the_start_shows_the_bias_before_it_can_do_harm():
    speed = np.where(TIME < 0.5, 0.0, 0.2)
    acceleration = np.full(len(TIME), 0.3)
    with_rest, ready = IGM.fuse(TIME, speed, acceleration, NONE, 1e-3)
    assert ready == pytest.approx(0.1, abs=2e-3)
    assert np.max(np.abs(with_rest[TIME < 0.5])) < 1e-12
    _, ready_without = IGM.fuse(TIME, speed + 0.1, acceleration, NONE, 1e-3)
    assert ready_without == pytest.approx(3.0 / 10.0)


def test_it_sees_a_contact_that_the_motor_speed_has_not_felt_yet(gate, simulated):
    """After a stiff impact the accelerometer leads the motor: the residual must lead the plain observer's."""
    from cdtool.detectors.momentum import Momentum

    recording = simulated("stiff", 1)
    plain = Momentum().signal(recording, gate)
    inertial = InertialMomentum().signal(recording, gate)
    onset = recording["force"].time[np.flatnonzero(recording["force"].values[:, 0] > 50.0)[0]]
    at = np.searchsorted(plain.time, onset + 0.03)
    before = np.searchsorted(plain.time, onset - 0.05)
    assert inertial.values[at, 0] - inertial.values[before, 0] > 3.0 * (plain.values[at, 0] - plain.values[before, 0])


@pytest.mark.parametrize("gains", [{"bandwidth": 100.0}, {"bandwidth": 300.0, "crossover": 60.0}])
@pytest.mark.parametrize("end", [0.03, 0.05, 0.08, 0.15, 0.3])
def test_the_standstill_at_the_start_is_used_only_once_it_has_been_seen(gate, simulated, gains, end):
    """A fast observer is ready early: whether the bias is known must not be known too early."""
    recording = simulated("none", 1)
    detector = InertialMomentum(**gains)
    whole, part = detector.signal(recording, gate), detector.signal(recording.between(-np.inf, end), gate)
    np.testing.assert_array_equal(part.status, whole.status[: len(part.time)])
    np.testing.assert_array_equal(part.values, whole.values[: len(part.time)])
