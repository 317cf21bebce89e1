"""Torque constants: recovered from a payload, with standard errors that cover; refused where no payload acts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cdtool.commands.identify.estimate import Identified, Method, Missing
from cdtool.commands.identify.robot.drive_gains import LoadedRuns, drive_gains
from cdtool.commands.identify.robot.robot_run import RobotRun
from cdtool.machines.planar_arm import PlanarArm
from cdtool.machines.urdf_robot import UrdfRobot
from tests.commands.identify.robot_motion import Motion, coloured, fourier, planar_arm

FACTORS = (1.2, 0.8)
MASS, ALONG, TURNING = 0.7, 0.25, 0.002
TOOL = LoadedRuns((), MASS, "forearm", (ALONG, 0.0, 0.0))
ARM = planar_arm(coulomb_slope=50.0)


def loaded_arm() -> PlanarArm:
    """The arm whose forearm and payload are one body."""
    mass = 1.6 + MASS
    centre = (1.6 * 0.18 + MASS * ALONG) / mass
    own, carried = 0.018 + 1.6 * (0.18 - centre) ** 2, TURNING + MASS * (ALONG - centre) ** 2
    return replace(ARM, link_mass=(1.3, mass), centre_of_mass=(0.14, centre), link_inertia=(0.012, own + carried))


def currents(
    machine: PlanarArm | UrdfRobot, motion: Motion, factors: tuple[float, ...], noise: float, seed: int
) -> RobotRun:
    run = motion.run(machine)
    wrong = run.torque + noise * coloured(seed, run.torque.shape, 10.0)
    return replace(run, torque=wrong / np.array(factors))


def arm_gains(noise: float, seed: int = 1, scale: tuple[float, ...] = (1.0, 1.0)) -> Identified:
    free = currents(ARM, fourier(seed, 2, 15.0), FACTORS, noise, seed)
    loaded = currents(loaded_arm(), fourier(seed + 1000, 2, 15.0), FACTORS, noise, seed + 1000)
    return drive_gains([free], [loaded], TOOL, ARM, scale)


def test_the_factors_of_a_planar_arm_are_recovered() -> None:
    found = arm_gains(0.0)
    assert [item.value for item in found.estimates] == pytest.approx(FACTORS, rel=1e-4)
    assert {(item.section, item.key, item.unit) for item in found.estimates} == {("channels.torque", "scale", "N m/A")}
    assert {item.method for item in found.estimates} == {Method.LOADED_RUNS}


def test_the_standard_errors_cover() -> None:
    distance = []
    for seed in range(25):
        found = arm_gains(0.1, seed)
        distance += [(item.value - FACTORS[item.joint]) / item.standard_error for item in found.estimates]
    assert len(distance) == 50
    assert np.mean(np.abs(distance) < 2.0) >= 0.85
    assert np.median(np.abs(distance)) > 0.3
    assert abs(np.mean(distance)) < 0.5


def test_a_joint_that_the_payload_does_not_load_is_refused() -> None:
    small = replace(TOOL, link="arm", centre=(0.2, 0.0, 0.0))
    runs = [currents(ARM, fourier(seed, 2, 15.0), FACTORS, 0.1, seed) for seed in (1, 2)]
    found = drive_gains(runs[:1], runs[1:], small, ARM, (1.0, 1.0))
    refused = {item.joint: item.missing for item in found.not_identifiable}
    assert refused[1] == (Missing.PAYLOAD,)
