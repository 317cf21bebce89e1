"""All joints' channels on one clock, and the derivatives without delay."""

from __future__ import annotations

import numpy as np
import pytest

from cdtool.base.arrays import FloatArray
from cdtool.base.findings import Finding
from cdtool.commands.identify.robot.robot_run import central_derivative, robot_run
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
