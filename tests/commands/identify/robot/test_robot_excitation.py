"""What a robot's runs excite, and that the planned motion shows the inertias that the logged one does not."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from cdtool.commands.identify.robot.robot_dynamics import FRICTION, identify_robot
from cdtool.commands.identify.robot.robot_excitation import PlannedRobotMotion, measure_joint_motion, plan_robot_motion
from cdtool.commands.identify.robot.robot_regressor import ColumnGroup
from cdtool.commands.identify.robot.robot_run import RobotRun
from tests.commands.identify.robot_motion import Motion, coloured, fourier, planar_arm, ur10e, ur10e_run

ARM = planar_arm(coulomb_slope=50.0)


def ramp(speeds: tuple[float, ...], period: float = 0.01, noise: float = 0.0) -> RobotRun:
    """Joint 0 moves at these speeds, 2 s each, after a rest of 1 s; joint 1 rests."""
    speed = np.concatenate((np.zeros(100), *(np.full(200, v) for v in speeds)))
    both = np.column_stack((speed, np.zeros_like(speed)))
    both = both + noise * np.random.default_rng(0).normal(size=both.shape)
    position = np.column_stack((np.cumsum(speed) * period, np.full(len(speed), 0.4)))
    return RobotRun("ramp", 0.0, period, np.ones_like(position), position, both)


def planned_motion(plan: PlannedRobotMotion, seed: int, period: float = 0.01) -> Motion:
    """Four sines per joint at its own frequencies, within the range and speed of the plan."""
    rng = np.random.default_rng(seed)
    time = period * np.arange(round(plan.duration / period))
    columns = []
    for demand in plan.joints:
        rates = 2.0 * demand.speed / demand.range * rng.uniform(0.3, 1.0, 4)
        phases, sizes = rng.uniform(0.0, 2.0 * np.pi, 4), rng.uniform(0.5, 1.0, 4)
        angle = np.outer(time, rates) + phases
        position, speed = np.sin(angle) @ sizes, np.cos(angle) @ (sizes * rates)
        factor = min(demand.range / np.ptp(position), demand.speed / np.max(np.abs(speed)))
        acceleration = -np.sin(angle) @ (sizes * rates**2)
        columns.append(factor * np.stack((position, speed, acceleration)))
    position, speed, acceleration = np.stack(columns, axis=2)
    return Motion(period, position, speed, acceleration)


def test_speeds_directions_and_range_are_those_of_the_motion() -> None:
    moved, still = measure_joint_motion([ramp((0.5, -0.25, 1.0))], ARM)
    assert moved.excitation.speeds == pytest.approx((0.25, 0.5, 1.0), rel=0.02)
    assert moved.excitation.forward_share == pytest.approx(2.0 / 3.0, abs=0.02)
    assert moved.excitation.moving_time == pytest.approx(6.0, abs=0.3)
    assert (moved.excitation.strokes, moved.excitation.reversals) == (3, 2)
    assert moved.range == pytest.approx(2.5, abs=0.02)
    assert moved.lowest == pytest.approx(0.0, abs=1e-9)
    assert not still.is_moving
    assert still.range == 0.0


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
    assert math.isfinite(moved.range)
    short = replace(run, torque=run.torque[:5], position=run.position[:5], speed=run.speed[:5])
    assert not any(motion.is_moving for motion in measure_joint_motion([short], ARM))
    assert plan_robot_motion(measure_joint_motion([short], ARM), 5) is None


def base_set_is_missing(run: RobotRun, machine) -> bool:
    fit = identify_robot([run], machine, FRICTION | {ColumnGroup.INERTIAL})
    return any(item.key == "base_parameters" for item in fit.identified.not_identifiable)


def test_the_planned_motion_shows_the_links_of_an_arm_that_the_logged_one_does_not() -> None:
    narrow = fourier(1, 2, 8.0, 0.01, 0.02)
    run = narrow.run(ARM, 0.05 * coloured(0, narrow.position.shape, 5.0))
    assert base_set_is_missing(run, ARM)
    plan = plan_robot_motion(measure_joint_motion([run], ARM), 5)
    assert plan is not None
    assert all(demand.is_more for demand in plan.joints)
    for seed in range(2):
        motion = planned_motion(plan, seed)
        assert not base_set_is_missing(motion.run(ARM, 0.05 * coloured(seed, motion.position.shape, 5.0)), ARM)


def test_the_planned_motion_shows_the_links_of_the_ur10e_that_its_recording_does_not(tmp_path) -> None:
    pytest.importorskip("pinocchio")
    file = ur10e(tmp_path)
    run = ur10e_run(file, "no_torque.csv.gz")
    motions = measure_joint_motion([run], file.machine)
    plan = plan_robot_motion(motions, 36)
    assert plan is not None
    assert [demand.is_more for demand in plan.joints] == [True] * 6
    assert plan.duration > 4.0 * plan.logged_duration
    # Noise as large as what the model leaves unexplained of the recording.
    noise = np.array([2.0, 3.0, 2.0, 0.4, 0.3, 0.35])
    motion = planned_motion(plan, 0)
    assert not base_set_is_missing(
        motion.run(file.machine, noise * coloured(0, motion.position.shape, 5.0)), file.machine
    )
