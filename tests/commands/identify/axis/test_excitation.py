"""What a motion excites: held speeds, directions, acceleration; and the motion that would show the rest."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from cdtool.base.arrays import FloatArray
from cdtool.commands.identify.axis.excitation import (
    Excitation,
    PlannedMotion,
    distinct_speeds,
    measure_excitation,
    plan_motions,
)
from cdtool.commands.identify.axis.filtered_regression import filter_run
from cdtool.commands.identify.axis.rigid_axis import identify_rigid_axis
from cdtool.commands.identify.estimate import Missing, NotIdentifiable
from cdtool.machines.axis_model.axis_run import AxisRun
from cdtool.machines.axis_model.parameters import AxisModel, Controller, ElasticDrive, Friction
from cdtool.machines.axis_model.simulation import AxisInputs, simulate_axis

PERIOD = 2e-3


def excitation_of(*speeds: FloatArray, noise: float = 0.0) -> Excitation:
    rng = np.random.default_rng(1)
    runs = [
        AxisRun("log", 0.0, PERIOD, np.zeros(len(speed)), speed=speed + noise * rng.standard_normal(len(speed)))
        for speed in speeds
    ]
    return measure_excitation([filter_run(run, 20.0) for run in runs])


def stroke(speed: float, seconds: float = 4.0, acceleration: float = 1.0) -> FloatArray:
    ramp = np.linspace(0.0, speed, max(round(abs(speed) / acceleration / PERIOD), 2))
    hold, rest = np.full(round(seconds / PERIOD), speed), np.zeros(round(0.3 / PERIOD))
    return np.concatenate((rest, ramp, hold, ramp[::-1], rest))


@pytest.mark.parametrize("speeds", [(0.2,), (0.1, 0.2), (0.05, 0.12, 0.3)])
def test_the_held_speeds_are_found(speeds):
    excitation = excitation_of(*(stroke(speed) for speed in speeds))
    assert excitation.speeds == pytest.approx(speeds, rel=0.01)
    assert excitation.strokes == len(speeds)


def test_a_short_ramp_is_not_a_second_speed():
    assert len(excitation_of(stroke(0.2, seconds=7.0, acceleration=0.2)).speeds) == 1


def test_a_sine_holds_many_speeds():
    time = np.arange(10_000) * PERIOD
    excitation = excitation_of(0.3 * np.sin(2.0 * math.pi * 0.4 * time))
    assert len(excitation.speeds) >= 3
    assert excitation.forward_share == pytest.approx(0.5, abs=0.02)
    assert excitation.is_accelerated and not excitation.is_one_way
    assert excitation.reversals == 15


def test_one_direction_and_hardly_any_acceleration_are_missing():
    excitation = excitation_of(np.full(5000, -0.2), noise=1e-3)
    assert excitation.is_one_way
    assert not excitation.is_accelerated
    assert excitation.travel == pytest.approx(2.0, rel=0.02)


def test_acceleration_above_its_noise_is_enough():
    excitation = excitation_of(stroke(0.2), stroke(-0.2), noise=1e-4)
    assert excitation.is_accelerated and not excitation.is_one_way
    assert excitation.moving_time == pytest.approx(8.8, rel=0.05)


def test_standstill_excites_nothing():
    excitation = excitation_of(np.zeros(2000), noise=1e-4)
    assert excitation.moving_time < 0.1
    assert not excitation.is_accelerated
    assert measure_excitation([]).speeds == ()


def test_speeds_that_are_close_are_one():
    speeds = np.repeat([0.100, 0.108, 0.2], 100)
    held = distinct_speeds(speeds, np.full(300, 1.0 / 300.0))
    assert held == pytest.approx((0.104, 0.2), rel=0.01)


def test_a_speed_for_a_short_time_is_not_held():
    speeds = np.concatenate((np.full(97, 0.1), np.full(3, 0.3)))
    assert distinct_speeds(speeds, np.full(100, 0.01)) == pytest.approx((0.1,))


# An axis with a screw, as the simulated axis has it; its friction depends on the position, too.
AXIS = AxisModel(
    drive=ElasticDrive(load_mass=95.0),
    friction=Friction(
        coulomb_forward=20.0, coulomb_backward=24.0, static=24.0, stribeck_speed=1e-3, viscous=200.0, offset=-3.0
    ),
    controller=Controller(period=PERIOD, speed_gain=4000.0, integral_gain=20000.0, force_limit=500.0),
)


def driven(speed: float, direction: int, number: int, acceleration: float = 1.0, travel: float = 0.3) -> AxisRun:
    """Return a log of the simulated axis: rest, one stroke at a speed over the travel, rest; noise on all channels."""
    rng = np.random.default_rng([number, round(1e4 * speed), direction + 1])
    reference = direction * stroke(speed, travel / speed, acceleration)
    waves = 0.8 * np.sin(2.0 * np.pi * np.cumsum(np.abs(reference)) * PERIOD / 0.07)
    motion = simulate_axis(AXIS, AxisInputs(reference, disturbance=-direction * waves * (reference != 0.0)))
    count = len(reference)
    return AxisRun(
        f"{direction * speed:g} m/s, {number}",
        0.0,
        PERIOD,
        motion["drive_force"] + 0.5 * rng.standard_normal(count),
        speed=motion["load_speed"] + 1e-4 * rng.standard_normal(count),
        position=motion["load_position"],
        reference_speed=reference,
    )


def suggested(plans: Sequence[PlannedMotion]) -> list[AxisRun]:
    """Return the runs of a plan, each as it says; they are as fast as the logged ones where it says nothing."""
    runs = []
    for number, plan in enumerate(plans, 10):
        acceleration = plan.acceleration if math.isfinite(plan.acceleration) else 1.0
        travel = plan.travel if math.isfinite(plan.travel) else 0.3
        for direction in plan.directions:
            for speed in plan.speeds:
                runs += [driven(speed, direction, 100 * number + i, acceleration, travel) for i in range(plan.runs)]
    return runs


def answers(runs: Sequence[AxisRun]) -> tuple[dict[str, float], set[str], tuple[PlannedMotion, ...]]:
    """Return the values by key, the keys that are not identifiable, and the plan for them."""
    fit = identify_rigid_axis(runs, 0.0)
    missing = fit.identified.not_identifiable
    values = {item.key: item.value for item in fit.identified.estimates}
    return values, {item.key for item in missing}, plan_motions(missing, fit.excitation)


@pytest.mark.parametrize(
    ("logged", "unknown"),
    [
        ([(0.25, 1), (0.25, -1)], {"viscous_friction", "coulomb_friction", "coulomb_forward", "coulomb_backward"}),
        (
            [(0.25, 1), (0.15, 1), (0.08, 1)],
            {"coulomb_friction", "coulomb_backward", "coulomb_forward", "constant_force"},
        ),
        (
            [(0.25, -1)],
            {"viscous_friction", "coulomb_friction", "coulomb_forward", "coulomb_backward", "constant_force"},
        ),
        (
            [(0.25, 1), (0.25, -1), (0.2, 1)],
            {"viscous_friction", "coulomb_friction", "coulomb_forward", "coulomb_backward"},
        ),
    ],
)
def test_the_suggested_runs_make_the_parameters_identifiable(logged, unknown):
    before = [driven(speed, direction, number) for speed, direction in logged for number in range(3)]
    _, missing, plans = answers(before)
    assert missing == unknown
    assert {key.partition(".")[2].rpartition(".")[2] for plan in plans for key in plan.keys} == unknown
    values, still_missing, _ = answers([*before, *suggested(plans)])
    assert still_missing == set()
    assert values["viscous_friction"] == pytest.approx(200.0, rel=0.1)
    assert values["coulomb_friction"] == pytest.approx(22.0, rel=0.1)
    assert values["constant_force"] == pytest.approx(
        -5.0, rel=0.15
    )  # the offset, and half of what the directions differ


def test_one_speed_beside_others_is_far_from_both_and_within_the_logged_limits():
    (plan,) = [plan for plan in plan_of_speeds(0.2) if plan.missing is Missing.SECOND_SPEED]
    assert plan.runs == 4
    assert plan.speeds == pytest.approx((0.06, 0.11), rel=0.05)
    (plan,) = [plan for plan in plan_of_speeds(0.2, 0.1) if plan.missing is Missing.SECOND_SPEED]
    assert plan.speeds[1:] == pytest.approx((0.1, 0.2), rel=0.01)  # repeated: slow runs must not outweigh them
    assert plan.speeds[0] == pytest.approx(0.06, rel=0.05)
    (plan,) = [plan for plan in plan_of_speeds(0.2, 0.15) if plan.missing is Missing.SECOND_SPEED]
    assert plan.speeds == pytest.approx((0.06, 0.11), rel=0.05)  # 0.15 is too close to 0.2


def plan_of_speeds(*speeds: float) -> tuple[PlannedMotion, ...]:
    item = NotIdentifiable("machine", "viscous_friction", (Missing.SECOND_SPEED,))
    return plan_motions([item], excitation_of(*(sign * stroke(speed) for speed in speeds for sign in (1.0, -1.0))))


def test_directions_follow_what_is_logged_and_what_is_missing():
    one_way = excitation_of(-stroke(0.2))
    speed = NotIdentifiable("machine", "viscous_friction", (Missing.SECOND_SPEED,))
    both = NotIdentifiable("machine", "coulomb_friction", (Missing.SECOND_SPEED, Missing.REVERSALS))
    (alone,) = plan_motions([speed], one_way)
    assert alone.directions == (-1,)
    faster, back = plan_motions([speed, both], one_way)
    assert faster.directions == (1, -1)
    assert faster.keys == ("machine.viscous_friction", "machine.coulomb_friction")
    assert back.directions == (1,)
    assert back.speeds == pytest.approx((0.2,), rel=0.01)
    assert back.travel == pytest.approx(0.84, rel=0.05)


def test_weak_acceleration_is_answered_with_one_that_shows_the_mass():
    slow = [driven(0.06, direction, 1, acceleration=0.005, travel=0.05) for direction in (1, -1)]
    gentle = [replace(run, speed=None, reference_speed=None, position=noisy(run)) for run in slow]
    fit = identify_rigid_axis(gentle, 0.0)
    missing = [item for item in fit.identified.not_identifiable if item.key == "load_mass"]
    assert missing[0].missing == (Missing.ACCELERATION, Missing.FINER_MOTION)
    plan, finer = plan_motions(missing, fit.excitation)
    assert finer.missing is Missing.FINER_MOTION and not finer.speeds
    assert plan.acceleration >= 2.0 * fit.excitation.acceleration_noise
    added = suggested([replace(plan, speeds=(0.06,), travel=0.05)])
    more = [replace(run, position=noisy(run), speed=None, reference_speed=None) for run in added]
    again = identify_rigid_axis([*gentle, *more], 0.0)
    assert again.identified["load_mass"].value == pytest.approx(95.0, rel=0.3)


def noisy(run: AxisRun) -> FloatArray:
    rng = np.random.default_rng(len(run))
    return run.position + 2e-5 * rng.standard_normal(len(run))


@pytest.mark.parametrize(("relative", "runs"), [(0.6, 3 * 6), (0.31, 4), (9.0, 100)])
def test_more_runs_lower_the_error_with_the_root_of_their_number(relative, runs):
    item = NotIdentifiable(
        "model.friction", "static", (Missing.MORE_RECORDINGS,), {"relative_standard_error": relative}
    )
    (plan,) = plan_motions([item], excitation_of(*(stroke(0.2) for _ in range(6))))
    assert plan.runs == runs


def test_what_is_not_a_motion_or_has_no_basis_is_a_plan_without_numbers():
    item = NotIdentifiable("model.drive", "stiffness", (Missing.MOTOR_INERTIA, Missing.HIGHER_RATE))
    inertia, rate = plan_motions([item], excitation_of(stroke(0.2)), rate=250.0)
    assert inertia.runs == 0
    assert rate.rate == 1000.0
    (unknown,) = plan_motions([NotIdentifiable("machine", "viscous_friction", (Missing.SECOND_SPEED,))])
    assert unknown.runs == 0
    assert unknown.speeds == ()
    (at_rest,) = plan_motions(
        [NotIdentifiable("machine", "load_mass", (Missing.ACCELERATION,))], excitation_of(np.zeros(2000))
    )
    assert at_rest.runs == 0


def test_logs_that_begin_in_motion_are_answered_with_a_rest_before_the_start():
    item = NotIdentifiable("model.drive", "stiffness", (Missing.START_UP,))
    (plan,) = plan_motions([item], excitation_of(stroke(0.2)))
    assert plan.rest == pytest.approx(0.3)
    assert plan.motion == pytest.approx(2.0)
