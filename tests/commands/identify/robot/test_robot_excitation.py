"""What a robot's runs excite, joint by joint."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from cdtool.commands.identify.robot.robot_excitation import measure_joint_motion
from cdtool.commands.identify.robot.robot_run import RobotRun
from tests.commands.identify.robot_motion import planar_arm

ARM = planar_arm(coulomb_slope=50.0)


def ramp(speeds: tuple[float, ...], period: float = 0.01, noise: float = 0.0) -> RobotRun:
    """Joint 0 moves at these speeds, 2 s each, after a rest of 1 s; joint 1 rests."""
    speed = np.concatenate((np.zeros(100), *(np.full(200, v) for v in speeds)))
    both = np.column_stack((speed, np.zeros_like(speed)))
    both = both + noise * np.random.default_rng(0).normal(size=both.shape)
    position = np.column_stack((np.cumsum(speed) * period, np.full(len(speed), 0.4)))
    return RobotRun("ramp", 0.0, period, np.ones_like(position), position, both)


def test_speeds_directions_and_range_are_those_of_the_motion() -> None:
    moved, still = measure_joint_motion([ramp((0.5, -0.25, 1.0))], ARM)
    assert moved.excitation.speeds == pytest.approx((0.25, 0.5, 1.0), rel=0.02)
    assert moved.excitation.forward_share == pytest.approx(2.0 / 3.0, abs=0.02)
    assert moved.excitation.moving_time == pytest.approx(6.0, abs=0.3)
    assert moved.highest == pytest.approx(2.5, abs=0.02)
    assert moved.lowest == pytest.approx(0.0, abs=1e-9)
    assert not still.is_moving
    assert still.lowest == still.highest == 0.4


def test_noise_of_the_speed_at_rest_is_no_motion() -> None:
    stick = ARM.stick_speed[1]
    _, still = measure_joint_motion([ramp((0.5,), noise=1.5 * stick)], ARM)
    assert not still.is_moving


def test_samples_without_a_value_are_left_out_and_a_short_run_has_no_motion() -> None:
    run = ramp((0.5,))
    speed, position = run.speed.copy(), run.position.copy()
    speed[150:200], position[150:200] = np.nan, np.nan
    moved, _ = measure_joint_motion([replace(run, speed=speed, position=position)], ARM)
    # 0.08 s are lost at each end and at each edge of the gap.
    assert moved.excitation.moving_time == pytest.approx(1.5 - 4 * 0.08, abs=0.05)
    assert math.isfinite(moved.lowest + moved.highest)
    short = replace(run, torque=run.torque[:5], position=run.position[:5], speed=run.speed[:5])
    assert not any(motion.is_moving for motion in measure_joint_motion([short], ARM))
