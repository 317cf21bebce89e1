"""Torque constants: recovered from a payload, with standard errors that cover; refused where no payload acts."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cdtool.base.errors import ConfigurationError, UsageError
from cdtool.commands.identify.estimate import IdentificationError, Identified, Method, Missing
from cdtool.commands.identify.robot.drive_gains import Payload, drive_gains
from cdtool.commands.identify.robot.robot_regressor import body_parameters, with_bodies
from cdtool.commands.identify.robot.robot_run import RobotRun
from cdtool.machines.planar_arm import PlanarArm
from cdtool.machines.urdf_robot import UrdfRobot
from tests.commands.identify.robot_motion import Motion, coloured, fourier, planar_arm
from tests.synthetic.robots import six_joint_robot, six_joint_urdf, urdf_robot

FACTORS = (1.2, 0.8)
MASS, ALONG, TURNING = 0.7, 0.25, 0.002
TOOL = Payload(link="forearm", mass=MASS, centre=(ALONG, 0.0, 0.0))
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


def test_they_multiply_the_present_scale() -> None:
    found = arm_gains(0.0, scale=(10.0, 20.0))
    assert [item.value for item in found.estimates] == pytest.approx((12.0, 16.0), rel=1e-4)


def test_the_standard_errors_cover() -> None:
    distance = []
    for seed in range(25):
        found = arm_gains(0.1, seed)
        distance += [(item.value - FACTORS[item.joint]) / item.standard_error for item in found.estimates]
    assert len(distance) == 50
    assert np.mean(np.abs(distance) < 2.0) >= 0.85
    assert np.median(np.abs(distance)) > 0.3
    assert abs(np.mean(distance)) < 0.5


def test_a_payload_on_a_turned_link_of_a_robot(tmp_path: Path) -> None:
    pytest.importorskip("pinocchio")
    machine = six_joint_robot(tmp_path)
    payload = Payload(link="link6", mass=4.0, centre=(0.1, -0.05, 0.2))
    # The reader of URDFs is what adds the payload here: as a link that is fixed to the last one.
    numbers = 'ixx="0.02" ixy="0.001" ixz="0" iyy="0.03" iyz="0" izz="0.01"'
    extra = f"""<link name="load"><inertial><origin xyz="0.1 -0.05 0.2" rpy="0 0 0"/><mass value="4"/>
<inertia {numbers}/></inertial></link>
<joint name="hold" type="fixed"><parent link="link6"/><child link="load"/></joint>"""
    text = six_joint_urdf().replace("</robot>", extra + "</robot>")
    tree = urdf_robot(tmp_path, text, {"joints": list(machine.joints)}).tree
    bodies = np.array([body_parameters(joint) for joint in tree.joints])
    loaded = replace(machine, tree=with_bodies(machine.tree, bodies))
    factors = (1.2, 0.9, 1.1, 0.8, 1.0, 1.3)
    runs = [currents(robot, fourier(seed, 6, 10.0), factors, 0.0, 1) for seed, robot in ((1, machine), (2, loaded))]
    found = drive_gains([runs[0]], [runs[1]], payload, machine, (1.0,) * 6)
    assert [item.joint for item in found.estimates] == list(range(6))
    assert [item.value for item in found.estimates] == pytest.approx(factors, rel=1e-3)


def test_a_joint_that_the_payload_does_not_load_is_refused() -> None:
    small = replace(TOOL, link="arm", centre=(0.2, 0.0, 0.0))
    runs = [currents(ARM, fourier(seed, 2, 15.0), FACTORS, 0.1, seed) for seed in (1, 2)]
    found = drive_gains(runs[:1], runs[1:], small, ARM, (1.0, 1.0))
    refused = {item.joint: item.missing for item in found.not_identifiable}
    assert refused[1] == (Missing.PAYLOAD,)


def test_a_payload_below_the_noise_is_refused() -> None:
    tiny = replace(TOOL, mass=0.001)
    runs = [currents(ARM, fourier(seed, 2, 15.0), FACTORS, 0.3, seed) for seed in (1, 2)]
    found = drive_gains(runs[:1], runs[1:], tiny, ARM, (1.0, 1.0))
    assert not found.estimates
    assert {item.missing for item in found.not_identifiable} == {(Missing.PAYLOAD,)}


def test_unloaded_runs_alone_unknown_links_and_bad_payloads_are_refused() -> None:
    run = currents(ARM, fourier(1, 2, 5.0), FACTORS, 0.0, 1)
    with pytest.raises(IdentificationError, match="with and without the payload"):
        drive_gains([run], [], TOOL, ARM, (1.0, 1.0))
    with pytest.raises(ConfigurationError, match="unknown link 'tool'"):
        drive_gains([run], [run], replace(TOOL, link="tool"), ARM, (1.0, 1.0))
    with pytest.raises(ConfigurationError, match="off the link's axis"):
        drive_gains([run], [run], replace(TOOL, centre=(0.1, 0.0, 0.1)), ARM, (1.0, 1.0))
    with pytest.raises(ConfigurationError, match="mass is 0"):
        replace(TOOL, mass=0.0)
    with pytest.raises(UsageError, match="3 values of scale"):
        drive_gains([run], [run], TOOL, ARM, (1.0, 1.0, 1.0))
