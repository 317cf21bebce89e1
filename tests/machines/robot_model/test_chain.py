"""Inertia matrix, bias torques and levers of a tree at one state, against the machines' own equations."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cdtool.base.errors import ConfigurationError
from cdtool.machines.axis_model.model_table import ModelTable
from cdtool.machines.coupled import CoupledMachine
from cdtool.machines.planar_arm import PlanarArm
from cdtool.machines.robot_model.chain_kernel import solve_in_place
from cdtool.machines.robot_model.parameters import largest_rate, point_in_joint, robot_model
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


def test_an_index_names_the_link_of_a_joint_of_the_log(tmp_path: Path) -> None:
    model = robot_model(six_joint_robot(tmp_path, SHUFFLED), None)
    assert [model.link(index).name for index in range(6)] == ["link2", "link1", "link3", "link6", "link5", "link4"]
    for wrong, message in ((6, "no joint 6"), ("link7", "unknown link"), ("base", "does not move")):
        with pytest.raises(ConfigurationError, match=message):
            model.link(wrong)


def test_motor_inertia_may_be_a_share_of_the_links() -> None:
    values = {key: value for key, value in ARM.items() if key not in ("motor_inertia", "transmission_ratio")}
    machine = PlanarArm.of({**values, "coordinates": "load"})
    table = ModelTable({"drive": {"motor_mass": (0.02, 0.01), "stiffness": (400.0, 400.0)}})
    model = robot_model(machine, table)
    matrix, _ = model.dynamics(np.zeros(2), np.zeros(2))
    expected = machine.inertia_matrix(np.zeros((1, 2)))[0] - np.diag([0.02, 0.01])
    np.testing.assert_allclose(matrix, expected, atol=1e-12)
    assert model.axes[0].drive.motor_mass == 0.02


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


def test_the_solver_solves_and_returns_nan_without_a_positive_definite_inertia() -> None:
    rng = np.random.default_rng(3)
    root, vector = rng.normal(size=(5, 5)), rng.normal(size=5)
    matrix = root @ root.T + np.eye(5)
    solution = vector.copy()
    solve_in_place(matrix.copy(), solution)
    np.testing.assert_allclose(matrix @ solution, vector, atol=1e-12)
    solution = vector.copy()
    solve_in_place(-matrix, solution)
    assert np.isnan(solution).all()


def test_the_largest_rate_is_that_of_the_fastest_decay() -> None:
    assert largest_rate(np.diag([2.0, 5.0]), [4.0, 5.0]) == pytest.approx(2.0)
    assert largest_rate(np.eye(2), [0.0, 0.0]) == 0.0
