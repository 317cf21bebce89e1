"""The Kalman filter on the momentum against the Riccati equation and the closed forms of its bandwidth."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import solve_discrete_are

from cdtool.base.arrays import FloatArray
from cdtool.detectors.detection import Status
from cdtool.detectors.kalman_momentum import KalmanMomentum
from cdtool.recordings.recording import Recording, Series
from tests.synthetic.machines import machine_of

PERIOD, MASS = 1e-3, 12.0
AXIS = machine_of({"coordinates": "load", "load_mass": MASS})
CASES = (
    KalmanMomentum(sigma_speed=1e-2, sigma_torque=1.0, contact_drift=30.0),
    KalmanMomentum(sigma_speed=1e-4, sigma_torque=50.0, contact_drift=20.0),
)


def estimated(detector: KalmanMomentum, force: FloatArray, speed: FloatArray):
    time = np.arange(len(force)) * PERIOD
    channels = {"torque": Series(time, force, "N"), "speed": Series(time, speed, "m/s")}
    return detector.signal(Recording("r", "r", ("axis",), channels), AXIS)


def steady_gain(detector: KalmanMomentum) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Transition, gain (2,) and eigenvalues of the estimator in the steady state."""
    transition = np.array([[1.0, -PERIOD], [0.0, 1.0]])
    drift, torque = detector.contact_drift**2, detector.sigma_torque**2
    # The drift of the contact torque during a step, integrated exactly, and the force's error of that step.
    process = drift * np.array([[PERIOD**3 / 3.0, -(PERIOD**2) / 2.0], [-(PERIOD**2) / 2.0, PERIOD]])
    process[0, 0] += torque * PERIOD**2
    noise = (MASS * detector.sigma_speed) ** 2
    unit = np.array([1.0, 1.0 / PERIOD])
    scaled = solve_discrete_are(
        (transition * unit / unit[:, np.newaxis]).T, np.array([[1.0], [0.0]]), process / np.outer(unit, unit), [[noise]]
    )
    covariance = scaled * np.outer(unit, unit)
    gain = covariance[:, 0] / (covariance[0, 0] + noise)
    return transition, gain, np.linalg.eigvals((np.eye(2) - np.outer(gain, [1.0, 0.0])) @ transition)


@pytest.mark.parametrize("detector", CASES)
def test_its_recursion_settles_on_the_filter_of_the_riccati_equation(detector):
    rng = np.random.default_rng(4)
    count = 12_000
    force, speed = rng.normal(size=count) * 5.0, np.cumsum(rng.normal(size=count)) * 1e-4
    transition, gain, _ = steady_gain(detector)
    state, expected = np.array([MASS * speed[0], 0.0]), np.zeros(count)
    for k in range(1, count):
        state = transition @ state + np.array([0.5 * PERIOD * (force[k] + force[k - 1]), 0.0])
        state = state + gain * (MASS * speed[k] - state[0])
        expected[k] = state[1]
    found = estimated(detector, force, speed).values[:, 0]
    late = slice(9000, None)
    np.testing.assert_allclose(found[late], expected[late], atol=1e-8 * np.abs(expected).max())


@pytest.mark.parametrize("detector", CASES)
def test_its_poles_are_those_of_the_riccati_equation(detector):
    _, _, eigenvalues = steady_gain(detector)
    expected = np.sort(np.abs(np.log(eigenvalues + 0j)) / PERIOD)
    assert detector.steady_state(MASS, PERIOD) == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("detector", CASES)
def test_a_contact_is_known_to_five_percent_three_time_constants_of_its_slowest_pole_after_it(detector):
    count, at = 8000, 4000
    time = np.arange(count) * PERIOD
    speed = -np.maximum(time - time[at], 0.0) / MASS  # 1 N takes the momentum
    found = estimated(detector, np.zeros(count), speed).values[:, 0]
    settled = 3.0 / detector.steady_state(MASS, PERIOD)[0]
    assert np.max(np.abs(found[: at + 1])) < 1e-12
    assert np.max(np.abs(found[time > time[at] + settled] - 1.0)) < 0.052
    assert found[time > time[at] + settled / 6.0][0] < 0.5


@pytest.mark.parametrize("detector", CASES)
def test_it_is_starting_up_for_three_time_constants_by_its_rule(detector):
    signal = estimated(detector, np.zeros(4000), np.zeros(4000))
    momentum_noise = (MASS * detector.sigma_speed) ** 2 * PERIOD
    rule = min(
        np.sqrt(detector.contact_drift) / momentum_noise**0.25,
        detector.contact_drift / np.sqrt(detector.sigma_torque**2 * PERIOD),
    )
    ready = int(np.flatnonzero(signal.status[:, 0] == Status.VALID)[0])
    assert (signal.status[:ready, 0] == Status.START_UP).all()
    assert ready * PERIOD == pytest.approx(3.0 / rule, abs=1.5 * PERIOD)


@pytest.mark.parametrize("lost", [2, 4, 7])
def test_lost_rows_leave_nothing_in_the_estimate_that_its_noise_does_not(lost):
    # Much torque noise: the estimate holds a share of each sample's noise, which the next one takes back.
    detector, count = CASES[1], 6000
    rng = np.random.default_rng(lost)
    force, speed = rng.normal(size=count), 1e-3 * rng.normal(size=count)
    whole = estimated(detector, force, speed).values[:, 0]
    time = np.arange(count) * PERIOD
    offsets = []
    for first in range(3000, 5000, 100):
        keep = np.ones(count, dtype=bool)
        keep[first : first + lost] = False
        channels = {
            "torque": Series(time[keep], force[keep], "N"),
            "speed": Series(time[keep], speed[keep], "m/s"),
        }
        found = detector.signal(Recording("r", "r", ("axis",), channels), AXIS).values[:, 0]
        # The mean over 20 samples behind the gap against the whole log's.
        offsets.append(float(np.mean(found[first : first + 20] - whole[first + lost : first + lost + 20])))
    usual = whole[3000:5000].reshape(-1, 20).mean(axis=1).std()
    assert np.abs(offsets).max() < 5.0 * usual


@pytest.mark.parametrize("detector", [KalmanMomentum(sigma_speed=0.34), CASES[1]])
@pytest.mark.parametrize("lost", ["rows", "speed", "torque"])
@pytest.mark.parametrize("missing", [5, 20, 50])
def test_behind_a_gap_it_is_where_it_would_have_been(detector, lost, missing):
    # A force that nothing knows of rises by 30 N/s: a straight line loses little of it within the filter's memory.
    count, first = 6000, 5000
    time = np.arange(count) * PERIOD
    force = np.full(count, 2.0)
    speed = (2.0 * time - 15.0 * time**2) / MASS
    whole = estimated(detector, force, speed).values[:, 0]
    assert np.ptp(whole[first : first + 200]) > 3.0
    hidden = slice(first, first + missing)
    keep = np.ones(count, dtype=bool)
    if lost == "rows":
        keep[hidden] = False
    else:
        (speed if lost == "speed" else force)[hidden] = np.nan
    channels = {
        "torque": Series(time[keep], force[keep], "N"),
        "speed": Series(time[keep], speed[keep], "m/s"),
    }
    found = detector.signal(Recording("r", "r", ("axis",), channels), AXIS).values[:, 0]
    behind = found[-(count - first - missing) :] - whole[first + missing :]
    assert np.abs(behind).max() < 0.05
