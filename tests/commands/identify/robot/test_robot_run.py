"""All joints' channels on one clock, and the derivatives without delay."""

from __future__ import annotations

import numpy as np
import pytest

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import RecordingError
from cdtool.base.findings import Finding
from cdtool.commands.identify.robot.robot_run import RobotRun, central_derivative, robot_run
from cdtool.recordings.recording import Recording, Series

RATES = np.array([1.0, 2.0])


def clock(period: float, count: int, seed: int, offset: float = 0.0) -> FloatArray:
    rng = np.random.default_rng(seed)
    return offset + period * (np.arange(count) + rng.uniform(-0.3, 0.3, count))


def recording(findings: tuple[Finding, ...] = (), **left_out: bool) -> Recording:
    fast, slow = clock(2e-3, 2000, 1, 0.1), clock(4e-3, 1000, 2)
    channels = {
        "torque": Series(fast, np.column_stack((fast, 2.0 * fast)), "N m"),
        "position": Series(slow, np.sin(slow[:, np.newaxis] * RATES), "rad"),
        "speed": Series(slow, RATES * np.cos(slow[:, np.newaxis] * RATES), "rad/s"),
    }
    kept = {name: series for name, series in channels.items() if name not in left_out}
    return Recording("log", "log", ("a", "b"), kept, findings=findings)


def test_all_joints_come_to_the_slowest_channels_clock() -> None:
    run = robot_run(recording())
    assert run.torque.shape == run.position.shape == run.speed.shape == (len(run), 2)
    assert run.period == pytest.approx(4e-3, rel=0.1)
    known = np.isfinite(run.position).all(axis=1)
    assert known.mean() > 0.99
    np.testing.assert_allclose(run.position[known], np.sin(run.time[known, np.newaxis] * RATES), atol=2e-5)
    np.testing.assert_allclose(run.torque[:, 1], 2.0 * run.torque[:, 0], rtol=1e-12)


@pytest.mark.parametrize("is_in_the_log", [True, False])
def test_a_speed_from_a_causal_derivative_is_replaced_by_one_without_delay(is_in_the_log: bool) -> None:
    if is_in_the_log:
        log = recording((Finding("derived_speed", "speed", {"low_pass": 50.0}),))
        delayed = log["speed"].with_values(np.roll(log["speed"].values, 3, axis=0), "rad/s")
        log = Recording(log.name, log.source, log.joints, {**log.channels, "speed": delayed}, findings=log.findings)
    else:
        log = recording(speed=True)
    run = robot_run(log)
    known = np.isfinite(run.speed).all(axis=1)
    assert known.mean() > 0.95
    np.testing.assert_allclose(run.speed[known], RATES * np.cos(run.time[known, np.newaxis] * RATES), atol=2e-3)


def test_the_central_derivative_is_exact_for_cubics_and_leaves_gaps_open() -> None:
    time = 0.01 * np.arange(100.0)
    values = np.column_stack((time**3 - time, 1.0 + 0.5 * time**2))
    values[60, 0] = np.nan
    slope = central_derivative(values, 0.01)
    wanted = np.column_stack((3.0 * time**2 - 1.0, time))
    known = np.isfinite(slope)
    np.testing.assert_allclose(slope[known], wanted[known], rtol=1e-9, atol=1e-10)
    assert not known[:5].any()
    assert not known[55:66, 0].any()
    assert known[5:-5, 1].all()


def test_white_noise_is_averaged_by_the_derivative() -> None:
    noise = np.random.default_rng(3).normal(size=(5000, 1))
    plain = np.std(np.diff(noise, axis=0) / 0.001)
    assert np.nanstd(central_derivative(noise, 0.001)) < 0.01 * plain


def test_a_log_shorter_than_the_window_has_no_derivative() -> None:
    assert np.isnan(central_derivative(np.zeros((6, 2)), 0.05)).all()


def test_excluded_samples_have_no_torque_and_keep_their_motion() -> None:
    run = robot_run(recording())
    excluded = run.time > 2.0
    rest = run.without(excluded)
    assert np.isnan(rest.torque[excluded]).all()
    np.testing.assert_array_equal(rest.torque[~excluded], run.torque[~excluded])
    assert rest.position is run.position


@pytest.mark.parametrize(("missing", "message"), [("position", "no position"), ("torque", "no torque")])
def test_a_robot_needs_torque_and_pose(missing: str, message: str) -> None:
    with pytest.raises(RecordingError, match=message) as caught:
        robot_run(recording(**{missing: True}))
    assert "\n" not in str(caught.value)


def test_channels_of_different_shape_are_refused() -> None:
    with pytest.raises(RecordingError, match="differ in shape"):
        RobotRun("log", 0.0, 0.01, np.zeros((9, 2)), np.zeros((9, 3)), np.zeros((9, 2)))


def test_a_sample_is_slow_below_three_times_the_noise_and_below_two_percent_of_the_fastest() -> None:
    time = np.arange(0.0, 20.0, 0.01)
    speed = np.column_stack((np.sin(time), np.sin(time), np.zeros_like(time)))
    speed[:, 1] += 0.02 * np.random.default_rng(1).normal(size=len(time))
    slow = RobotRun("run", 0.0, 0.01, *np.zeros((2, *speed.shape)), speed).slow((1e-3,) * 3)
    assert np.max(np.abs(speed[slow[:, 0], 0])) == pytest.approx(0.02, abs=0.01)
    assert np.max(np.abs(speed[slow[:, 1], 1])) == pytest.approx(0.06, rel=0.1)
    assert slow[:, 2].all()
