"""A robot in closed loop, against the simulated arm, conservation laws and closed forms."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import ConfigurationError
from cdtool.commands.simulate.arm_model import ArmStroke, integrate_arm
from cdtool.commands.simulate.arm_parameters import ArmParameters
from cdtool.machines.axis_model.model_table import Bristle, ModelTable
from cdtool.machines.axis_model.obstacle import Obstacle
from cdtool.machines.robot_model.parameters import RobotModel, point_in_joint, robot_model
from cdtool.machines.robot_model.simulation import PointContact, RobotInputs, simulate_robot, substeps
from tests.machines.robot_model.arm_as_model import arm_as_model, arm_obstacle, arm_point
from tests.machines.robot_model.test_chain import planar_arm
from tests.synthetic.robots import six_joint_robot

QUIET = ArmParameters(torque_ripple=0.0, encoder_counts=0)
CONTROLLER = {"period": (0.001,) * 6, "speed_gain": (1.0,) * 6}


def resting(count: int, pose: FloatArray, command: FloatArray | None = None) -> RobotInputs:
    held = np.tile(pose, (count, 1))
    return RobotInputs(np.zeros_like(held), held, pose, np.zeros(len(pose)), command)


@pytest.mark.parametrize("trial", [1, 2])
@pytest.mark.parametrize("kind", ["none", "stiff", "soft"])
def test_the_motion_is_that_of_the_simulated_arm(trial: int, kind: str) -> None:
    duration = (1.85, 2.8)[trial - 1]
    time = np.arange(round(duration / 1e-3)) * 1e-3
    angle = float(np.radians((62.0, 72.5)[trial - 1]))
    reference = QUIET.reference(trial, time)  # type: ignore[arg-type]
    obstacle = QUIET.obstacle(trial, angle)  # type: ignore[arg-type]
    start = QUIET.equilibrium(trial)  # type: ignore[arg-type]
    stroke = ArmStroke(reference, np.zeros((2, len(time))), np.ones(2), obstacle, trial, kind)  # type: ignore[arg-type]
    truth, first = integrate_arm(QUIET, start, stroke, 5)
    model = arm_as_model(planar_arm(motor_inertia=1.5e-5, transmission_ratio=1 / 60), QUIET)
    inputs = RobotInputs(reference[1].T, reference[0].T, start[0], np.zeros(2))
    contact = None
    if kind != "none":
        struck = arm_point(QUIET, trial)  # type: ignore[arg-type]
        link = model.link(struck.link)
        normal = struck.direction or (-np.sin(angle), 0.0, np.cos(angle))
        pose = np.array([angle, QUIET.forearm_angle[trial - 1]])
        point = point_in_joint(link, struck.point)
        place, _ = model.point_along(pose, link.joint, point, normal)
        contact = PointContact(link.joint, point, normal, arm_obstacle(QUIET, kind).at(place, 1))
    motion = simulate_robot(model, inputs, contact)
    limit = 1e-6 if kind == "none" else 0.01  # trial 1: a plane in the place of the simulator's path along an arc
    for row, name in (("link_speed", "link_speed"), ("drive_torque", "motor_torque"), ("measured_speed",) * 2):
        size = np.max(np.abs(truth[name]))
        assert np.max(np.abs(motion[row].T - truth[name])) < limit * size, row
    if kind == "none":
        assert np.isnan(motion.first_contact)
    else:
        assert motion.first_contact == pytest.approx(first, abs=1e-5)
        np.testing.assert_allclose(motion.contact_force, truth["contact_force"], atol=0.02 * motion.contact_force.max())


def frictionless(folder: Path, **sections: dict[str, tuple[float, ...]]) -> RobotModel:
    machine = six_joint_robot(folder, viscous_friction=0.0, coulomb_friction=0.0)
    return robot_model(machine, ModelTable({"controller": CONTROLLER, **sections}))


def test_energy_is_conserved_without_friction_and_drive(tmp_path: Path) -> None:
    machine = six_joint_robot(tmp_path)
    model = frictionless(tmp_path)
    pose = np.array([0.3, -0.4, 0.5, 0.1, 0.2, -0.6])
    inputs = replace(resting(400, pose, np.zeros((400, 6))), initial_speed=np.array([0.5, -0.3, 0.4, 0.1, 0.6, -0.2]))
    motion = simulate_robot(model, inputs)
    kinetic, potential = machine.energies(motion["link_position"], motion["link_speed"])
    assert np.ptp(kinetic) > 5.0
    assert np.ptp((kinetic + potential)[1:]) < 1e-6 * np.max(kinetic)


def test_a_static_contact_loads_every_joint_with_its_lever(tmp_path: Path) -> None:
    """The joints, held by stiff integrating controllers, carry J' F in the end (thesis 2.5)."""
    gains = {"period": (0.001,) * 6, "speed_gain": (100.0,) * 6, "integral_gain": (200.0,) * 6}
    gains["position_gain"] = (10.0,) * 6
    model = frictionless(tmp_path, controller=gains)
    machine = six_joint_robot(tmp_path)
    pose = np.array([0.3, -0.4, 0.5, 0.1, 0.2, -0.6])
    link = model.link("link5")
    point = point_in_joint(link, (0.1, 0.0, 0.05))
    place, _ = model.point_along(pose, link.joint, point, (0.0, 0.6, 0.8))
    against = PointContact(link.joint, point, (0.0, 0.6, 0.8), Obstacle.spring(2e3).at(place - 0.01, 1))
    motion = simulate_robot(model, resting(9000, pose), against)
    assert np.max(np.abs(motion["link_speed"][-1])) < 1e-5
    end = motion["link_position"][-1:]
    force = np.zeros((1, 6))
    force[0, 1:3] = motion.contact_force[-1] * np.array([0.6, 0.8])
    expected = machine.gravity(end) + machine.contact_torque(end, force, "link5", (0.1, 0.0, 0.05))
    assert motion.contact_force[-1] == pytest.approx(20.0, rel=1e-3)
    np.testing.assert_allclose(motion["drive_torque"][-1], expected[0], atol=1e-4)


def test_a_bristle_holds_a_joint_that_a_smooth_sign_lets_creep() -> None:
    table = ModelTable(
        {
            "friction": {"coulomb_forward": (2.0, 2.0), "coulomb_backward": (2.0, 2.0)},
            "controller": {"period": (0.001, 0.001), "speed_gain": (1.0, 1.0)},
        }
    )
    model = robot_model(planar_arm(gravity=0.0), table)
    command = np.zeros((2000, 2))
    command[:, 0] = np.minimum(np.arange(2000) * 1e-3, 1.0)
    crept = simulate_robot(model, resting(2000, np.array([0.2, 0.4]), command))["link_position"][-1, 0] - 0.2
    held = replace(model, bristles=(Bristle(stiffness=1500.0, damping=2.0),) * 2)
    bent = simulate_robot(held, resting(2000, np.array([0.2, 0.4]), command))["link_position"][-1, 0] - 0.2
    # x = G / sigma0 ln(1 / (1 - F / G)): the integral of dz = (1 - sigma0 z / G) dx.
    assert bent == pytest.approx(2.0 / 1500.0 * np.log(2.0), rel=0.08)
    assert crept > 1e-3


def test_what_cannot_be_simulated_is_an_error() -> None:
    bare = robot_model(planar_arm(), None)
    with pytest.raises(ConfigurationError, match="no controller"):
        simulate_robot(bare, resting(10, np.zeros(2)))
    stiff = arm_as_model(planar_arm(), QUIET)
    contact = PointContact(0, (0.28, 0.0, 0.0), (0.0, 0.0, 1.0), Obstacle.spring(1e14))
    with pytest.raises(ConfigurationError, match="integration steps"):
        substeps(stiff, np.zeros((1, 2)), 1e-3, contact)
