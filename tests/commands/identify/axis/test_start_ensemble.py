"""Starts from rest: found, aligned, grouped by motion, averaged."""

from __future__ import annotations

import numpy as np
import pytest

from cdtool.base.arrays import FloatArray
from cdtool.commands.identify.axis.start_ensemble import start_ensembles
from cdtool.machines.axis_model.axis_run import AxisRun

PERIOD = 2e-3


def ramp(start: float, speed: float, seconds: float = 4.0) -> FloatArray:
    time = PERIOD * np.arange(round(seconds / PERIOD))
    return np.clip((time - start) / 0.5, 0.0, 1.0) * speed


def a_run(speed: FloatArray, rng: np.random.Generator | None = None) -> AxisRun:
    noise = rng.normal(0.0, 2e-3, len(speed)) if rng else np.zeros(len(speed))
    torque = np.gradient(speed, PERIOD) + 3.0 * np.sign(speed)
    return AxisRun("run", 0.0, PERIOD, torque=torque, speed=speed + noise, position=np.cumsum(speed) * PERIOD)


def test_starts_at_different_times_come_to_lie_on_each_other() -> None:
    rng = np.random.default_rng(0)
    starts = rng.uniform(0.5, 1.2, 12)
    (ensemble,) = start_ensembles([a_run(ramp(start, 0.2), rng) for start in starts])
    assert (ensemble.count, ensemble.direction) == (12, 1)
    assert ensemble.nominal_speed == pytest.approx(0.2, rel=0.02)
    speed = ensemble.mean["speed"]
    rising = np.flatnonzero((speed > 0.04) & (speed < 0.16))
    assert np.polyfit(rising * PERIOD, speed[rising], 1)[0] == pytest.approx(0.4, rel=0.02)
    assert np.sqrt(np.mean(ensemble.deviation["speed"] ** 2)) < 2.6e-3
    assert [member[0] for member in ensemble.members] == list(range(12))


def test_directions_and_speeds_are_ensembles_of_their_own_the_largest_first() -> None:
    runs = [a_run(ramp(1.0, speed)) for speed in (0.2, 0.2, 0.2, -0.2, -0.2, 0.1)]
    found = [(item.count, item.direction, round(item.nominal_speed, 3)) for item in start_ensembles(runs)]
    assert found == [(3, 1, 0.2), (2, -1, 0.2), (1, 1, 0.1)]


def test_a_start_with_a_long_gap_is_left_out() -> None:
    run = a_run(ramp(1.0, 0.2))
    torque = run.torque.copy()
    torque[600:900] = np.nan
    with_gap = AxisRun("gap", 0.0, PERIOD, torque=torque, speed=run.speed, position=run.position)
    (ensemble,) = start_ensembles([run, with_gap])
    assert ensemble.count == 1
