"""Pseudo-inertias, and links that are physical: true ones without noise, repaired ones with it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdtool.base.arrays import FloatArray
from cdtool.commands.identify.robot.consistent_inertia import (
    ConsistentFit,
    body_of,
    consistent_fit,
    is_consistent,
    pseudo_inertia,
)
from cdtool.commands.identify.robot.robot_dynamics import FRICTION, RobotFit, identify_robot
from cdtool.commands.identify.robot.robot_regressor import ColumnGroup, body_parameters, regressor_of, with_bodies
from cdtool.machines.urdf_robot import UrdfRobot
from tests.commands.identify.robot_motion import coloured, fourier
from tests.synthetic.robots import six_joint_robot

WHAT = FRICTION | {ColumnGroup.INERTIAL}


def cloud(seed: int, points: int) -> FloatArray:
    """The parameters of point masses about the origin."""
    rng = np.random.default_rng(seed)
    total = np.zeros(10)
    for mass, (x, y, z) in zip(rng.uniform(0.1, 2.0, points), rng.normal(size=(points, 3)), strict=True):
        turning = (y * y + z * z, -x * y, x * x + z * z, -x * z, -y * z, x * x + y * y)
        total += mass * np.array([1.0, x, y, z, *turning])
    return total


@given(st.integers(0, 10_000), st.integers(4, 9))
@settings(max_examples=40, deadline=None)
def test_point_masses_are_a_physical_body(seed: int, points: int) -> None:
    assert is_consistent(cloud(seed, points))


def test_a_pseudo_inertia_is_the_integral_of_the_points_and_its_inverse_gives_the_parameters() -> None:
    rng = np.random.default_rng(3)
    masses, points = rng.uniform(0.1, 1.0, 5), rng.normal(size=(5, 3))
    total, integral = np.zeros(10), np.zeros((4, 4))
    for mass, point in zip(masses, points, strict=True):
        x, y, z = point
        turning = (y * y + z * z, -x * y, x * x + z * z, -x * z, -y * z, x * x + y * y)
        total += mass * np.array([1.0, x, y, z, *turning])
        integral += mass * np.outer(np.append(point, 1.0), np.append(point, 1.0))
    np.testing.assert_allclose(pseudo_inertia(total), integral, atol=1e-12)
    np.testing.assert_allclose(body_of(integral), total, atol=1e-12)


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> UrdfRobot:
    pytest.importorskip("pinocchio")
    return six_joint_robot(tmp_path_factory.mktemp("six"), drive_inertia=0.0, constant_force=0.2)


@pytest.fixture(scope="module")
def other(robot: UrdfRobot) -> UrdfRobot:
    """The robot as its maker believes it to be."""
    bodies = np.array([body_parameters(joint) for joint in robot.tree.joints])
    factors = np.array([1.3, 0.8, 1.2, 0.7, 1.1, 0.9])[:, np.newaxis]
    return replace(robot, tree=with_bodies(robot.tree, bodies * factors))


def fit_of(robot: UrdfRobot, believed: UrdfRobot, noise: float, seed: int = 1) -> RobotFit:
    motion = fourier(seed, 6, 12.0, 0.01, amplitude=0.4)
    run = motion.run(robot, noise * coloured(seed, motion.speed.shape, 5.0))
    return identify_robot([run], believed, WHAT, half_width=0.2)


def base_of(fit: RobotFit) -> FloatArray:
    return np.asarray(fit.grouping.combination @ fit.parameters[list(fit.grouping.columns)])


def links(fit: RobotFit) -> FloatArray:
    inertial = [i for i, column in enumerate(fit.columns) if column.group is ColumnGroup.INERTIAL]
    return fit.parameters[inertial].reshape(-1, 10)


def residual(fit: RobotFit) -> float:
    return float(np.linalg.norm(fit.equations.torques - fit.equations.rows @ base_of(fit)))


def solved(fit: RobotFit) -> ConsistentFit:
    pytest.importorskip("cvxpy")
    pytest.importorskip("clarabel")
    return consistent_fit(fit)


def test_without_noise_the_true_base_parameters_come_back_with_physical_links(
    robot: UrdfRobot, other: UrdfRobot
) -> None:
    fit = fit_of(robot, other, 0.0)
    found = solved(fit)
    true = fit.grouping.combination @ regressor_of(robot).values[list(fit.grouping.columns)]
    # At 100 Hz the steep tanh of dry friction is sampled coarsely: sums over these windows are integrals to 2e-4.
    np.testing.assert_allclose(base_of(found.fit), true, rtol=2e-4, atol=2e-4)
    # The nearness to the machine counts a hundred millionth: it moves nothing that a log determines.
    np.testing.assert_allclose(base_of(found.fit), fit.base.values, rtol=1e-5, atol=1e-5)
    assert all(is_consistent(link) for link in links(found.fit))
    assert found.residual_rise < 1e-6
    motion = np.random.default_rng(0).normal(size=(3, 10, 6))
    new = replace(robot, tree=found.tree)
    np.testing.assert_allclose(new.required_torque(*motion), robot.required_torque(*motion), atol=1e-2)


@pytest.mark.parametrize("seed", [1, 2])
def test_unphysical_links_are_repaired_at_a_small_rise_of_the_residual(robot: UrdfRobot, seed: int) -> None:
    fit = fit_of(robot, robot, 4.0, seed)
    assert not all(is_consistent(link) for link in links(fit))
    found = solved(fit)
    assert all(is_consistent(link) for link in links(found.fit))
    assert residual(found.fit) == pytest.approx(residual(fit) * (1.0 + found.residual_rise), rel=1e-6)
    assert 0.0 < found.residual_rise < 0.06
    # No other physical robot explains the torques better: not the true one, and none on the way to it.
    for share in (1.0, 0.1, 0.01):
        way = (1.0 - share) * found.fit.parameters + share * regressor_of(robot).values
        assert residual(replace(found.fit, parameters=way)) > residual(found.fit) * (1.0 - 1e-6)
