"""The simulated arm: its mechanics against closed forms and balances, its sensors against their definitions."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from cdtool.commands.simulate.arm_model import (
    ArmRun,
    ArmStroke,
    Array,
    Impact,
    integrate_arm,
    simulate_arm_run,
    specific_force,
)
from cdtool.commands.simulate.arm_parameters import ArmParameters, Trial

ARM = ArmParameters()
QUIET = replace(
    ARM,
    encoder_counts=0,
    torque_ripple=0.0,
    disturbance_torque=0.0,
    torque_noise=0.0,
    vibration_acceleration=0.0,
    imu_noise=0.0,
    load_cell_noise=0.0,
    friction_scatter=0.0,
    obstacle_scatter=0.0,
)
"""Without noise, quantiser and ripple: what remains converges with the step."""
PASSIVE = replace(QUIET, speed_gain=0.0, integral_gain=0.0)
LOSSLESS = replace(
    PASSIVE,
    coulomb_friction=(0.0, 0.0),
    static_friction=(0.0, 0.0),
    viscous_friction=0.0,
    drive_damping=0.0,
    obstacle_damping=0.0,
    bumper_damping=0.0,
)
HITS: list[tuple[Trial, Impact]] = [(1, "stiff"), (1, "soft"), (2, "stiff"), (2, "soft")]


@cache
def run_of(trial: Trial, impact: Impact, seed: int = 1) -> ArmRun:
    return simulate_arm_run(ARM, np.random.default_rng(seed), trial, impact)


def hold(parameters: ArmParameters, start: Array, samples: int) -> dict[str, Array]:
    """The controllers asked to stay where trial 1 starts, nothing to hit."""
    reference = np.repeat(ARM.equilibrium(1)[0][:, np.newaxis], samples, axis=1), np.zeros((2, samples))
    stroke = ArmStroke(reference, np.zeros((2, samples)), np.ones(2), 9.0, 1, "none")
    truth, _ = integrate_arm(parameters, start, stroke, 5)
    return truth


def coast(
    parameters: ArmParameters, trial: Trial, impact: Impact, ahead: float = 0.2, speed: float = 2.5
) -> tuple[dict[str, Array], float]:
    """0.3 s without motors, the arm turning at `speed` [rad/s] with an obstacle `ahead` [deg]; and what is touched."""
    samples = 300
    angle = ARM.obstacle_angle[trial - 1]
    obstacle = parameters.obstacle(trial, angle)
    start = np.zeros((6, 2))
    start[0] = start[2] = angle - np.radians(ahead), ARM.forearm_angle[trial - 1]
    start[1] = start[3] = speed, 0.4 * speed
    still = np.zeros((2, samples))
    stroke = ArmStroke((still, still), still, np.ones(2), obstacle, trial, impact)
    truth, touch = integrate_arm(parameters, start, stroke, 20)
    assert touch < 0.01
    return truth, obstacle


def penetration(trial: Trial, truth: dict[str, Array], obstacle: float) -> Array:
    q1, q2 = truth["link_position"]
    if trial == 1:
        return np.asarray(0.28 * (q1 - obstacle))
    return np.asarray(0.30 * np.sin(q1) + 0.20 * np.sin(q2) - obstacle)


def penetration_speed(trial: Trial, truth: dict[str, Array]) -> Array:
    (q1, q2), (v1, v2) = truth["link_position"], truth["link_speed"]
    return np.asarray(0.28 * v1 if trial == 1 else 0.30 * np.cos(q1) * v1 + 0.20 * np.cos(q2) * v2)


def stored(depth: Array, first: float, travel: float, second: float) -> Array:
    """Energy of a spring of slope `first` up to `travel` and `second` beyond it [J]."""
    beyond = np.clip(depth - travel, 0.0, None)
    return np.asarray(0.5 * first * (depth - beyond) ** 2 + first * travel * beyond + 0.5 * second * beyond**2)


def energy(trial: Trial, impact: Impact, truth: dict[str, Array], obstacle: float) -> Array:
    """Of motors, links, gravity, drives, bristles and contact [J], from the links' centres of mass."""
    (q1, q2), (v1, v2) = truth["link_position"], truth["link_speed"]
    elbow = 0.30 * v1
    across, along = 0.18 * v2 + elbow * np.cos(q2 - q1), elbow * np.sin(q2 - q1)
    kinetic = 0.5 * (1.3 * (0.14 * v1) ** 2 + 0.012 * v1**2 + 1.6 * (across**2 + along**2) + 0.018 * v2**2)
    kinetic += 0.5 * 1.5e-5 * 3600.0 * np.sum(truth["motor_speed"] ** 2, axis=0)
    height = 1.3 * 0.14 * np.sin(q1) + 1.6 * (0.30 * np.sin(q1) + 0.18 * np.sin(q2))
    wind_up = np.abs(truth["motor_position"] - truth["link_position"])
    springs = np.sum(stored(wind_up, 440.0, 0.003, 800.0), axis=0)
    bristles = 0.5 * 1500.0 * np.sum(truth["bristle"] ** 2, axis=0)
    depth = np.clip(penetration(trial, truth, obstacle), 0.0, None)
    contact = 0.5 * 3e4 * depth**2 if impact == "stiff" else stored(depth, 300.0, 7.5e-3, 3e4)
    return np.asarray(kinetic + 9.81 * height + springs + bristles + contact)


@pytest.mark.parametrize(("trial", "impact"), HITS)
def test_a_lossless_arm_keeps_its_energy_through_the_impact(trial: Trial, impact: Impact) -> None:
    truth, obstacle = coast(LOSSLESS, trial, impact)
    balance = energy(trial, impact, truth, obstacle)
    assert truth["contact_force"].max() > 3.0
    assert truth["link_speed"][0].min() < 0.0  # it fell back
    assert np.ptp(balance) < 1e-4


@pytest.mark.parametrize(("trial", "impact"), HITS)
def test_the_contact_force_is_the_stated_law_of_depth_and_speed_and_never_pulls(trial: Trial, impact: Impact) -> None:
    for ahead, speed in ((0.2, 2.5), (-0.2, -2.5)):
        sticky = replace(PASSIVE, obstacle_damping=8.0, bumper_damping=14.0)
        truth, obstacle = coast(sticky, trial, impact, ahead, speed)
        depth = np.clip(penetration(trial, truth, obstacle), 0.0, None)
        beyond = np.clip(depth - 7.5e-3, 0.0, None)
        spring = 3e4 * depth if impact == "stiff" else 300.0 * (depth - beyond) + 3e4 * beyond
        factor = 1.0 + (8.0 if impact == "stiff" else 14.0) * penetration_speed(trial, truth)
        np.testing.assert_allclose(truth["contact_force"], spring * np.clip(factor, 0.0, None), atol=1e-9)
        # Torn off its obstacle, the arm starts deep in it and yet feels no force.
        assert depth[0] == 0.0 or factor[0] < 0.0
        assert depth.max() > 0.0


def test_the_drives_wind_up_in_rest_as_their_two_stiffnesses_say() -> None:
    # Both stages: the arm's 4.59 N m lie above the 1.32 N m at which the drive stiffens, the forearm's 0 below.
    start = ARM.equilibrium(1)
    start[2] += 2e-3
    truth = hold(replace(QUIET, drive_damping=8.0), start, 2000)
    q1, q2 = truth["link_position"][:, -1]
    wind_up = truth["motor_position"][:, -1] - truth["link_position"][:, -1]
    torque = 0.662 * 9.81 * np.cos(q1)
    assert wind_up[0] == pytest.approx(0.003 + (torque - 1.32) / 800.0, rel=1e-6)
    assert wind_up[1] == pytest.approx(0.288 * 9.81 * np.cos(q2) / 440.0, abs=1e-9)
    assert ARM.wind_up(-torque) == pytest.approx(-wind_up[0], rel=1e-6)


def test_the_integration_is_of_fourth_order_where_the_laws_are_smooth() -> None:
    smooth = replace(LOSSLESS, speed_gain=4.4, integral_gain=50.0, soft_stiffness=800.0, torque_limit=1e9)
    samples = 200
    start = smooth.equilibrium(1)
    time = np.arange(samples) * 1e-3
    reference = (
        np.repeat(start[0][:, np.newaxis], samples, axis=1),
        np.array([np.sin(30.0 * time), np.cos(20.0 * time)]),
    )
    ends = []
    for substeps in (2, 4, 8):
        still = np.zeros((2, samples))
        truth, _ = integrate_arm(smooth, start, ArmStroke(reference, still, np.ones(2), 9.0, 1, "none"), substeps)
        ends.append(truth["link_position"])
    order = np.log2(np.abs(ends[0] - ends[1]).max() / np.abs(ends[1] - ends[2]).max())
    assert order == pytest.approx(4.0, abs=0.3)


@pytest.mark.parametrize("trial", [1, 2])
def test_the_arm_meets_the_obstacle_at_its_angle_and_nominal_speed(trial: Trial) -> None:
    angles, speeds = [], []
    for seed in range(8):
        run = run_of(trial, "stiff", seed)
        assert run.contact_start is not None
        angles.append(np.degrees(np.interp(run.contact_start, run.time, run.joint_position[:, 0])))
        before = (run.time > run.contact_start - 0.3) & (run.time < run.contact_start)
        speeds.append(run.joint_speed[before, 0].mean())
    assert np.mean(angles) == pytest.approx((62.0, 72.5)[trial - 1], abs=0.5)
    assert 0.1 < np.std(angles) < 1.0
    assert np.mean(speeds) == pytest.approx(np.radians(16.0), rel=0.04)


def test_an_ideal_inertial_sensor_feels_the_second_derivative_of_its_place_and_gravity() -> None:
    time, step = np.linspace(0.1, 2.0, 50), 1e-4

    def motion(t: Array) -> tuple[Array, Array, Array]:
        q = np.array([0.9 + 0.5 * np.sin(2.0 * t), 0.3 + 0.8 * np.cos(3.0 * t)])
        v = np.array([np.cos(2.0 * t), -2.4 * np.sin(3.0 * t)])
        return q, v, np.array([-2.0 * np.sin(2.0 * t), -7.2 * np.cos(3.0 * t)])

    def places(t: Array) -> tuple[Array, Array]:
        q1, q2 = motion(t)[0]
        first, elbow = (length * np.array([np.cos(q1), np.sin(q1)]) for length in (0.22, 0.30))
        return first, elbow + 0.20 * np.array([np.cos(q2), np.sin(q2)])

    position, speed, acceleration = motion(time)
    felt = specific_force(ARM, position, speed, acceleration)
    for link in (0, 1):
        before, now, after = (places(time + shift)[link] for shift in (-step, 0.0, step))
        pull = (before - 2.0 * now + after) / step**2 + np.array([[0.0], [9.81]])
        axis = np.array([-np.sin(position[link]), np.cos(position[link])])
        np.testing.assert_allclose(felt[link], np.sum(pull * axis, axis=0), atol=1e-5)
