"""Momentum and energy observers on an arm whose motion is integrated from Lagrange's equations."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from cdtool.base.arrays import FloatArray
from cdtool.detectors.base import drive_on_speed_clock, observe_momentum
from cdtool.detectors.energy import Energy
from cdtool.detectors.momentum import Momentum
from cdtool.recordings.recording import Recording, Series
from tests.synthetic.machines import arm_of

ARM = arm_of(
    {
        "coordinates": "load",
        "link_mass": [1.3, 1.6],
        "link_length": 0.3,
        "centre_of_mass": [0.14, 0.18],
        "link_inertia": [0.012, 0.018],
    }
)
# The same numbers, repeated: the motion must not come from the code under test.
M11, M22, H, G1, G2 = 0.18148, 0.06984, 0.0864, 6.49422, 2.82528
BANDWIDTH, CONTACT_AT, END = 50.0, 0.3, 0.8
READY = np.full(2, -np.inf)


def drive_torque(t: FloatArray, state: FloatArray) -> FloatArray:
    """Gravity held, a swing on each joint, and some damping by the controller (2, n) [N m]."""
    q1, q2, v1, v2 = state[:4]
    return np.array(
        [G1 * np.cos(q1) + 1.2 * np.sin(3.0 * t) - 0.5 * v1, G2 * np.cos(q2) + 0.5 * np.cos(5.0 * t) - 0.5 * v2]
    )


def slopes(t: float, state: FloatArray, contact: float) -> FloatArray:
    """Angles, speeds, and the power that the contact takes through the filter K / (s + K)."""
    q1, q2, v1, v2, power = state
    cosine, sine = H * np.cos(q2 - q1), H * np.sin(q2 - q1)
    torque = drive_torque(t, state)
    right = np.array(
        [
            torque[0] - contact - G1 * np.cos(q1) + sine * v2**2,
            torque[1] - G2 * np.cos(q2) - sine * v1**2,
        ]
    )
    a1 = (M22 * right[0] - cosine * right[1]) / (M11 * M22 - cosine**2)
    a2 = (M11 * right[1] - cosine * right[0]) / (M11 * M22 - cosine**2)
    return np.array([v1, v2, a1, a2, BANDWIDTH * (contact * v1 - power)])


@dataclass(frozen=True)
class Motion:
    """The arm's log, and the contact's power through the energy observer's filter (n,) [W]."""

    log: Recording
    filtered_power: FloatArray


@pytest.fixture(scope="module")
def motions() -> dict[float, Motion]:
    """By sample period [s]: 1 N m on joint 1 from 0.3 s on."""
    free = solve_ivp(
        slopes, (0.0, CONTACT_AT), [0.8, 1.6, 0.5, -0.4, 0.0], args=(0.0,), dense_output=True, rtol=1e-12, atol=1e-13
    )
    hit = solve_ivp(slopes, (CONTACT_AT, END), free.y[:, -1], args=(1.0,), dense_output=True, rtol=1e-12, atol=1e-13)
    found = {}
    for period in (2e-3, 1e-3, 5e-4):
        time = np.arange(round(END / period) + 1) * period
        state = np.where(time < CONTACT_AT, free.sol(time), hit.sol(time))
        channels = {
            "torque": Series(time, drive_torque(time, state).T, "N m"),
            "position": Series(time, state[:2].T, "rad"),
            "speed": Series(time, state[2:4].T, "rad/s"),
        }
        found[period] = Motion(Recording("arm", "integrated", ARM.joints, channels), state[4])
    return found


def expected(time: FloatArray) -> FloatArray:
    """The residual of joint 1: the contact through K / (s + K)."""
    return np.where(time > CONTACT_AT, 1.0 - np.exp(-BANDWIDTH * (time - CONTACT_AT)), 0.0)


def errors(motion: Motion) -> tuple[float, float]:
    """Largest error of each joint's residual [N m]."""
    signal = Momentum(BANDWIDTH).signal(motion.log, ARM)
    first = np.max(np.abs(signal.values[:, 0] - expected(signal.time)))
    return float(first), float(np.max(np.abs(signal.values[:, 1])))


def observed(motion: Motion, net_force: FloatArray, momentum: FloatArray) -> FloatArray:
    """The momentum observer on another form of the balance."""
    return observe_momentum(drive_on_speed_clock(motion.log, ARM), net_force, momentum.copy(), BANDWIDTH, READY)[0]


def values(motion: Motion) -> tuple[FloatArray, ...]:
    """Time, angles, speeds and torques."""
    log = motion.log
    return (log["torque"].time, *(log[name].values for name in ("position", "speed", "torque")))


def test_the_arm_has_the_parameters_that_the_motion_was_integrated_with():
    assert ARM.nominal_inertia == pytest.approx([M11, M22], rel=1e-12)
    assert pytest.approx(H, rel=1e-12) == ARM.coupling
    assert ARM.gravity_torque == pytest.approx([G1, G2], rel=1e-12)


def test_a_step_of_the_contact_torque_on_one_joint_is_followed_as_one_minus_exp(motions):
    error, cross_talk = errors(motions[1e-3])
    assert error < 1e-5
    assert cross_talk < 1e-5


def test_half_the_sample_period_leaves_a_quarter_of_the_error(motions):
    worst = np.array([errors(motions[period]) for period in (2e-3, 1e-3, 5e-4)])
    assert worst[:-1] / worst[1:] == pytest.approx(4.0, rel=0.1)


def test_the_energy_observer_follows_the_power_that_the_contact_takes_with_its_sign(motions):
    worst = []
    for period in (2e-3, 1e-3, 5e-4):
        motion = motions[period]
        signal = Energy(BANDWIDTH, 1e-6).signal(motion.log, ARM)
        worst.append(np.max(np.abs(signal.values[:, 0] - motion.filtered_power)))
    assert np.abs(motions[1e-3].filtered_power).max() > 0.5
    assert worst[1] < 1e-4
    assert worst[0] / worst[1] == pytest.approx(4.0, rel=0.25)
    assert worst[1] / worst[2] == pytest.approx(4.0, rel=0.25)
