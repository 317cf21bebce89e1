"""Inertia matrix, bias torques and levers of a tree at one state, against the machines' own equations."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cdtool.base.errors import ConfigurationError
from cdtool.machines.axis_model.model_table import ModelTable
from cdtool.machines.coupled import CoupledMachine
from cdtool.machines.planar_arm import PlanarArm
from cdtool.machines.robot_model.parameters import point_in_joint, robot_model
from cdtool.machines.robot_model.simulation import inertia_with_rigid_motors
from tests.synthetic.robots import six_joint_robot

ARM = {
    "link_mass": [1.3, 1.6],
    "link_length": 0.3,
    "centre_of_mass": [0.14, 0.18],
    "link_inertia": [0.012, 0.018],
    "motor_inertia": [1.5e-5, 2.5e-5],
    "transmission_ratio": [1 / 60, 1 / 50],
    "imu_position": [0.22, 0.2],
}
SHUFFLED = ("lift", "pan", "elbow", "tool", "wrist", "reach")


def planar_arm(**keys: object) -> PlanarArm:
    return PlanarArm.of({**ARM, **keys})


def machines(folder: Path) -> list[CoupledMachine]:
    return [
        six_joint_robot(folder),
        six_joint_robot(folder, SHUFFLED, drive_inertia=[0.1 * (1 + i) for i in range(6)]),
        planar_arm(),
    ]


def test_inertia_and_bias_are_those_of_the_machine(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    for machine in machines(tmp_path):
        model = robot_model(machine, None)
        count = len(machine.joints)
        for _ in range(5):
            position, speed = rng.normal(size=(2, count))
            matrix, bias = model.dynamics(position, speed)
            expected = machine.inertia_matrix(position[np.newaxis])[0]
            np.testing.assert_allclose(inertia_with_rigid_motors(model, position), expected, atol=1e-12)
            assert not np.allclose(matrix, expected)  # the drives are not in it
            still = np.zeros((1, count))
            torque = machine.inverse_dynamics(position[np.newaxis], speed[np.newaxis], still)[0]
            np.testing.assert_allclose(bias, torque, atol=1e-12)


def test_levers_are_those_of_the_jacobian_and_the_derivative_of_the_place(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    for machine, name in zip(machines(tmp_path), ("link6", "link3", "forearm"), strict=True):
        model = robot_model(machine, None)
        link = model.link(name)
        point = point_in_joint(link, (0.2, 0.05, -0.03))
        position, normal = rng.normal(size=len(machine.joints)), rng.normal(size=3)
        place, lever = model.point_along(position, link.joint, point, tuple(normal))
        jacobian = machine.contact_jacobian(position[np.newaxis], name, (0.2, 0.05, -0.03))[0, :3]
        np.testing.assert_allclose(lever, jacobian.T @ normal, atol=1e-12)
        step = 1e-6 * rng.normal(size=len(position))
        moved, _ = model.point_along(position + step, link.joint, point, tuple(normal))
        assert moved - place == pytest.approx(float(lever @ step), abs=1e-11)


@pytest.mark.parametrize(
    ("sections", "message"),
    [
        ({"drive": {"backlash": (0.1, 0.1)}}, "backlash applies to an axis only"),
        ({"controller": {"period": (0.001, 0.002), "speed_gain": (1.0, 1.0)}}, "period differs"),
        ({"drive": {"motor_mass": (0.01, 0.01)}}, "both given"),
        ({"controller": {"period": (0.001, 0.001)}}, "speed_gain is missing"),
    ],
)
def test_a_wrong_model_names_its_key(sections: dict[str, dict[str, tuple[float, ...]]], message: str) -> None:
    with pytest.raises(ConfigurationError, match=message):
        robot_model(planar_arm(), ModelTable(sections))
