"""The friction-estimating EKF against the Riccati equation, its observability and its rules."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import solve_discrete_are

from cdtool.base.arrays import FloatArray
from cdtool.detectors.detection import Status
from cdtool.detectors.friction_ekf import FrictionEkf
from cdtool.detectors.friction_ekf_kernel import predict_covariance, update_second, update_third
from cdtool.recordings.recording import Recording, Series

# The filter of the closed-form case, on the motor side.
INERTIA, SPEED, FRICTION, PERIOD = 2e-3, 150.0, 1e-4, 1e-3
PROCESS, NOISE = (1e-10, 4.0, 1e-2), (900.0, 0.25)


def settled(process, noise, f21, f23, period, steps=30_000, start=(1e-8, 0.0, 0.0, 1.0, 0.0, 1.0)):
    """Predicted covariance and the first state's gains after many steps of the filter's own recursion."""
    p = start
    for _ in range(steps):
        p = predict_covariance(p, f21, f23, period, *process)
        predicted = p
        k = np.array([p[1], p[3], p[4]]) / (p[3] + noise[0])
        gain_a = k[0]
        p = update_second(p, *k, noise[0])
        k = np.array([p[2], p[4], p[5]]) / (p[5] + noise[1])
        gain_v = k[0]
        p = update_third(p, *k, noise[1])
    return predicted, gain_a, gain_v, p


def riccati(process, noise, f21, f23, period):
    transition = np.array([[1.0, 0.0, 0.0], [f21, 0.0, f23], [0.0, period, 1.0]])
    observation = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    return transition, observation, solve_discrete_are(transition.T, observation.T, np.diag(process), np.diag(noise))


def square(p):
    p11, p12, p13, p22, p23, p33 = p
    return np.array([[p11, p12, p13], [p12, p22, p23], [p13, p23, p33]])


def test_the_covariance_settles_on_the_solution_of_the_riccati_equation():
    f21, f23 = -SPEED / INERTIA, -FRICTION / INERTIA
    predicted, _, _, _ = settled(PROCESS, NOISE, f21, f23, PERIOD)
    _, observation, expected = riccati(PROCESS, NOISE, f21, f23, PERIOD)
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    # The oracle's own last digits hang on how the linear algebra shares its work: 5.7e-14 was seen.
    assert np.max(np.abs(square(predicted) - expected) / scale) < 2e-13
    assert predicted[0] == pytest.approx(4.028945e-9, rel=2e-7)
    gain = expected @ observation.T @ np.linalg.inv(observation @ expected @ observation.T + np.diag(NOISE))
    assert gain[0] == pytest.approx([-3.176172e-7, -4.530112e-6], rel=2e-6)


def test_the_poles_are_those_of_the_reference_case():
    # sigma_acceleration^2 = 900, sigma_speed^2 = 0.25, q_d = 1e-10 per sample.
    ekf = FrictionEkf(30.0, 0.5, np.sqrt(1e-10 / PERIOD), 2.0, 0.1)
    poles, variance = ekf.steady_state(INERTIA, SPEED, FRICTION, PERIOD)
    assert poles == pytest.approx([26.06, 199.58, 9908.0], rel=1e-3)
    assert variance == pytest.approx(4.028945e-9, rel=2e-7)


@pytest.mark.parametrize(("speed", "slow", "quick"), [(0.2, 22.1, 22.1), (0.1, 8.71, 28.05), (0.05, 4.27, 28.58)])
def test_the_gates_bandwidth_falls_in_proportion_to_its_speed(speed, slow, quick):
    ekf = FrictionEkf(friction_drift=7.0 / np.sqrt(1e-3))
    poles, variance = ekf.steady_state(1154.4, speed, 900.0, 1e-3)
    assert poles[:2] == pytest.approx([slow, quick], rel=3e-3)
    if speed == 0.2:
        assert variance == pytest.approx(3503.3, rel=1e-4)


def moving(speed: FloatArray, force: FloatArray, acceleration: FloatArray | None = None) -> Recording:
    time = np.arange(len(speed)) * 1e-3
    rate = np.gradient(speed, 1e-3) if acceleration is None else acceleration
    channels = {
        "torque": Series(time, force, "N"),
        "speed": Series(time, speed, "m/s"),
        "acceleration": Series(time, rate, "m/s2"),
    }
    return Recording("r", "r", ("gate",), channels)


def test_a_constant_friction_is_found(gate):
    n = 6000
    log = moving(np.full(n, 0.2), np.full(n, 0.2 * 900.0), np.zeros(n))
    signal = FrictionEkf().signal(log, gate)
    assert signal.unit == "N s/m"
    assert signal.values[-1, 0] == pytest.approx(900.0, rel=1e-4)
    assert signal.valid[-1, 0]


def test_standing_still_is_not_applicable_and_the_estimate_holds(gate):
    n = 9000
    speed = np.where(np.arange(n) < 4000, 0.2, 0.0)
    log = moving(speed, speed * 900.0, np.zeros(n))
    signal = FrictionEkf().signal(log, gate)
    assert (signal.status[4001:, 0] == Status.NOT_APPLICABLE).all()
    assert np.ptp(signal.values[4100:, 0]) < 1e-6 * 900.0


def test_after_re_entry_it_is_starting_up_until_its_bandwidth_has_had_three_time_constants(gate):
    n = 9000
    k = np.arange(n)
    speed = np.where((k > 3000) & (k < 4000), 0.0, 0.2)
    signal = FrictionEkf().signal(moving(speed, speed * 900.0, np.zeros(n)), gate)
    again = signal.status[4000:, 0]
    ready = int(np.flatnonzero(again == Status.VALID)[0])
    assert (again[:ready] == Status.START_UP).all()
    ekf = FrictionEkf()
    rate = ekf.friction_drift * 0.2 / 1154.4 / np.sqrt((0.1**2 + 9e-3**2) * 1e-3)
    assert ready == pytest.approx(3.0 / rate / 1e-3, rel=0.02)


def test_an_accelerometer_at_its_own_rate_is_used_at_its_own_times(gate):
    """A fast accelerometer helps: beside a 1 kHz speed a contact is seen earlier with 1 kHz than with 100 Hz."""
    n = 6000
    time = np.arange(n) * 1e-3
    force = np.full(n, 180.0)
    contact = np.where(time > 4.0, 300.0, 0.0)
    acceleration = -contact / 1154.4
    speed = 0.2 + np.cumsum(acceleration) * 1e-3
    log = moving(speed, force, acceleration)
    risen = {}
    for name, every, lag in (("fast", 1, 0.0), ("slow", 10, 0.0), ("between", 10, 0.0004)):
        series = Series(time[::every] + lag, acceleration[::every], "m/s2")
        signal = FrictionEkf().signal(replace(log, channels={**log.channels, "acceleration": series}), gate)
        before = signal.values[3990, 0]
        risen[name] = int(np.flatnonzero(signal.values[:, 0] > before + 200.0)[0])
    assert risen["fast"] < risen["slow"]
    assert abs(risen["between"] - risen["slow"]) <= 10


def test_a_million_hostile_samples_leave_the_estimate_finite(gate):
    rng = np.random.default_rng(5)
    n = 1_000_000
    speed = 0.2 * np.sin(np.arange(n) / 3000.0) + 0.01 * rng.standard_cauchy(n).clip(-1e3, 1e3)
    speed[rng.random(n) < 0.1] = np.nan
    acceleration = rng.standard_cauchy(n).clip(-1e6, 1e6)
    acceleration[rng.random(n) < 0.1] = np.nan
    force = 200.0 * rng.standard_cauchy(n).clip(-1e4, 1e4)
    force[rng.random(n) < 0.1] = np.nan
    signal = FrictionEkf().signal(moving(speed, force, acceleration), gate)
    assert np.isfinite(signal.values).all()
    assert 0.05 < signal.valid.mean() < 1.0


def test_after_a_rebound_it_starts_up_again_because_its_estimate_has_the_wrong_sign(gate):
    """The reversal takes 5 ms below the minimum speed: too short for a stop, but the direction has changed."""
    n = 6000
    k = np.arange(n)
    speed = np.interp(k, [0, 3000, 3030, n], [0.2, 0.2, -0.2, -0.2])
    signal = FrictionEkf().signal(moving(speed, speed * 900.0), gate)
    assert signal.status[2990, 0] == Status.VALID
    turned = np.flatnonzero(speed < -0.03)[5]
    assert (signal.status[turned : turned + 200, 0] == Status.START_UP).all()
    assert signal.status[-1, 0] == Status.VALID


def test_a_single_outlier_of_the_speed_does_not_restart_it(gate):
    n = 6000
    speed = np.full(n, 0.2)
    speed[4000] = -0.2
    signal = FrictionEkf().signal(moving(speed, np.full(n, 180.0), np.zeros(n)), gate)
    assert signal.valid[4001:4100].all()
