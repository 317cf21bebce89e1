"""The generalized momentum observer against its closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import lfilter

from cdtool.base.arrays import FloatArray
from cdtool.detectors.detection import Status
from cdtool.detectors.momentum import Momentum
from cdtool.recordings.recording import Recording, Series
from tests.synthetic.machines import machine_of

# One kilogram on the load side without friction: force and momentum in plain numbers.
UNIT_MASS = machine_of({"coordinates": "load", "load_mass": 1.0})


def recording(time: FloatArray, force: FloatArray, speed: FloatArray) -> Recording:
    channels = {"torque": Series(time, force, "N"), "speed": Series(time, speed, "m/s")}
    return Recording("r", "r", ("axis",), channels)


def residual(time: FloatArray, force: FloatArray, speed: FloatArray, bandwidth: float) -> FloatArray:
    return Momentum(bandwidth).signal(recording(time, force, speed), UNIT_MASS).values[:, 0]


def test_a_step_of_the_contact_force_is_followed_exactly_as_one_minus_exp():
    time = np.arange(501) * 1e-3
    # p falls by the impulse of a contact force of 1 N from t = 0 on.
    res = residual(time, np.zeros(501), -time, 20.0)
    assert np.max(np.abs(res - (1.0 - np.exp(-20.0 * time)))) < 1e-12
    assert res[50] == pytest.approx(0.632121, abs=5e-7)


def test_a_ramp_of_the_contact_force_is_followed_with_the_lag_of_the_filter():
    time = np.arange(501) * 1e-3
    res = residual(time, np.zeros(501), -0.5 * time**2, 20.0)
    expected = time - (1.0 - np.exp(-20.0 * time)) / 20.0
    assert np.max(np.abs(res - expected)) == pytest.approx(20.0 * 1e-6 / 12.0, rel=0.1)
    assert res[100] == pytest.approx(0.056767, abs=2e-6)


@pytest.mark.parametrize(("bandwidth", "expected"), [(10.0, 9.975), (30.0, 29.78), (100.0, 97.51)])
def test_white_noise_of_the_momentum_is_amplified_by_the_stated_gain(bandwidth, expected):
    time = np.arange(400_001) * 1e-3
    noise = np.random.default_rng(1).normal(size=len(time))
    res = residual(time, np.zeros(len(time)), noise, bandwidth)
    assert np.std(res[2000:]) == pytest.approx(expected, rel=5e-3)
    a = np.exp(-bandwidth * 1e-3)
    assert (1.0 - a) / 1e-3 * np.sqrt(2.0 / (1.0 + a)) == pytest.approx(expected, rel=5e-4)


@pytest.mark.parametrize("jitter", [0.0, 0.3, 0.8])
def test_jittering_time_stamps_enter_only_through_the_step_length(jitter):
    """A unit step seen as a ramp of p: exact from a sample on; between two samples the error is at most (K T)^2 / 8."""
    rng = np.random.default_rng(7)
    time = np.cumsum(1e-3 * (1.0 + jitter * rng.uniform(-1.0, 1.0, 2001)))
    between = 0.5 * (time[500] + time[501])
    for start, most in ((time[500], 1.2e-13), (between, (20.0 * 1e-3 * (1.0 + jitter)) ** 2 / 8.0)):
        res = residual(time, np.zeros(len(time)), -np.maximum(time - start, 0.0), 20.0)
        expected = np.where(time > start, 1.0 - np.exp(-20.0 * (time - start)), 0.0)
        assert np.max(np.abs(res - expected)) < most


def test_a_gap_of_50_ms_at_200_hz_costs_no_accuracy():
    time = np.arange(401) * 5e-3
    speed = -time.copy()
    speed[100:110] = np.nan
    signal = Momentum(20.0).signal(recording(time, np.zeros(401), speed), UNIT_MASS)
    res = signal.values[:, 0]
    present = np.isfinite(speed)
    assert np.max(np.abs(res - (1.0 - np.exp(-20.0 * time)))[present]) < 1e-14
    assert (signal.status[~present] == Status.GAP).all()


@settings(max_examples=40, deadline=None)
@given(
    bandwidth=st.floats(0.5, 300.0),
    steps=st.lists(st.floats(1e-4, 5e-2), min_size=3, max_size=60),
    force=st.floats(-1e3, 1e3),
)
def test_a_constant_contact_force_is_followed_exactly_for_any_step_lengths(bandwidth, steps, force):
    steps = [min(step, 2.9 / bandwidth) for step in steps]
    time = np.concatenate(([0.0], np.cumsum(steps)))
    res = residual(time, np.zeros(len(time)), -force * time, bandwidth)
    np.testing.assert_allclose(res, force * (1.0 - np.exp(-bandwidth * time)), atol=1e-9 * (1.0 + abs(force)))


def test_it_equals_a_linear_filter_of_force_minus_momentum_rate_on_a_uniform_clock():
    rng = np.random.default_rng(3)
    time = np.arange(5000) / 1024.0
    force, speed = rng.normal(size=5000), np.cumsum(rng.normal(size=5000)) * 1e-2
    a = np.exp(-15.0 / 1024.0)
    drive = 0.5 * (force[1:] + force[:-1]) - np.diff(speed) * 1024.0
    expected = np.concatenate(([0.0], lfilter([1.0 - a], [1.0, -a], drive)))
    np.testing.assert_allclose(residual(time, force, speed, 15.0), expected, atol=1e-10)


def test_a_resting_machine_under_static_torque_leaves_no_residual():
    """What the drive presses against standing friction, a slope or a counterweight is not a contact."""
    machine = machine_of({"coordinates": "load", "load_mass": 95.0, "coulomb_friction": 20.0, "constant_force": 12.0})
    time = np.arange(2000) * 1e-3
    for pressed in (12.0, 0.0, 25.0, 31.9):
        log = recording(time, np.full(2000, pressed), np.zeros(2000))
        assert np.max(np.abs(Momentum().signal(log, machine).values)) == 0.0
    beyond = recording(time, np.full(2000, 40.0), np.zeros(2000))
    assert Momentum().signal(beyond, machine).values[-1, 0] == pytest.approx(8.0, rel=1e-6)


def test_it_is_starting_up_for_three_time_constants_and_again_after_a_long_gap():
    time = np.arange(3000) * 1e-3
    speed = np.full(3000, 0.2)
    speed[1000:1400] = np.nan
    signal = Momentum(10.0).signal(recording(time, np.zeros(3000), speed), UNIT_MASS)
    status = signal.status[:, 0]
    assert (status[:300] == Status.START_UP).all() and (status[300:1000] == Status.VALID).all()
    assert (status[1000:1400] == Status.GAP).all() and (status[1400:1699] == Status.START_UP).all()
    assert (status[1701:] == Status.VALID).all()


def test_known_friction_is_taken_off():
    machine = machine_of({"coordinates": "load", "load_mass": 10.0, "viscous_friction": 50.0, "coulomb_friction": 5.0})
    time = np.arange(2000) * 1e-3
    log = recording(time, np.full(2000, 50.0 * 0.2 + 5.0 + 7.0), np.full(2000, 0.2))
    assert Momentum().signal(log, machine).values[-1, 0] == pytest.approx(7.0, rel=1e-6)
