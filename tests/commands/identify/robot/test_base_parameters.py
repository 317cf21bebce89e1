"""Regressors against pinocchio and the machines' own equations; base parameters and how a motion excites them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cdtool.base.arrays import FloatArray
from cdtool.commands.identify.robot.base_parameters import (
    group_columns,
)
from cdtool.commands.identify.robot.robot_regressor import ColumnGroup, Regressor, regressor_of, stacked_torque
from cdtool.machines.coupled import CoupledMachine
from tests.commands.identify.robot_motion import PANDA_JOINTS, panda, panda_urdf, planar_arm
from tests.synthetic.robots import six_joint_robot

MACHINES = ("six", "panda", "planar")


def machine_of(name: str, folder: Path) -> CoupledMachine:
    if name == "planar":
        return planar_arm()
    pytest.importorskip("pinocchio")
    return six_joint_robot(folder) if name == "six" else panda(folder, drive_inertia=0.2)


def states(joints: int, count: int = 30) -> FloatArray:
    return np.random.default_rng(5).normal(size=(3, count, joints))


def inertial(regressor: Regressor, *groups: ColumnGroup) -> tuple[int, ...]:
    wanted = groups or (ColumnGroup.INERTIAL,)
    return tuple(i for i, column in enumerate(regressor.columns) if column.group in wanted)


@pytest.mark.parametrize("name", MACHINES)
def test_the_regressor_times_the_own_parameters_is_the_machines_torque(name: str, tmp_path: Path) -> None:
    machine = machine_of(name, tmp_path)
    regressor = regressor_of(machine)
    motion = states(len(machine.joints))
    rows = stacked_torque(regressor, list(range(len(regressor.columns))), *motion)
    np.testing.assert_allclose(rows @ regressor.values, machine.required_torque(*motion), rtol=1e-11, atol=1e-11)


def test_the_inertial_columns_are_those_of_pinocchio(tmp_path: Path) -> None:
    pinocchio: Any = pytest.importorskip("pinocchio")
    full = pinocchio.buildModelFromUrdf(str(panda_urdf()))
    fingers = [full.getJointId(f"panda_finger_joint{i}") for i in (1, 2)]
    model = pinocchio.buildReducedModel(full, fingers, pinocchio.neutral(full))
    data = model.createData()
    regressor = regressor_of(panda(tmp_path))
    motion = states(7, 5)
    own = stacked_torque(regressor, list(inertial(regressor)), *motion)
    assert [model.names[i] for i in range(1, 8)] == list(PANDA_JOINTS)
    for row, (q, v, a) in zip(own, motion.transpose(1, 0, 2), strict=True):
        wanted = pinocchio.computeJointTorqueRegressor(model, data, q, v, a)
        np.testing.assert_allclose(row, wanted, atol=1e-11)


@pytest.mark.parametrize("name", ["six", "panda"])
def test_base_parameters_explain_every_motion_as_all_parameters_do(name: str, tmp_path: Path) -> None:
    machine = machine_of(name, tmp_path)
    regressor = regressor_of(machine)
    columns = inertial(regressor, ColumnGroup.INERTIAL, ColumnGroup.DRIVE_INERTIA)
    grouping = group_columns(regressor, columns)
    values = np.random.default_rng(8).normal(size=len(columns))
    motion = states(len(machine.joints))
    every = stacked_torque(regressor, list(columns), *motion) @ values
    based = stacked_torque(regressor, list(grouping.base), *motion) @ (grouping.combination @ values)
    np.testing.assert_allclose(based, every, rtol=1e-8, atol=1e-8 * np.abs(every).max())
    assert set(grouping.base) <= set(grouping.columns) == set(columns)
