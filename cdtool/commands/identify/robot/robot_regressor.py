"""The equation of a coupled machine as a product of a known matrix and its parameters: Y(q, v, a) pi = tau.

The dynamics are linear in mass, first moment and inertia of each moving body, so that a column is the machine's own
equation with this parameter 1 and all others 0 (Atkeson, An, Hollerbach, 1986). This holds for the torque, and for
momentum p = M v and rest h = g - C'v of dp/dt + h = tau too, which need no acceleration.

Columns: the inertial parameters, then drive inertia, viscous friction, Coulomb friction and constant force, one per
joint each. All on the load side.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import UsageError
from cdtool.machines.coupled import CoupledMachine
from cdtool.machines.kinematic_tree import KinematicTree, TreeJoint
from cdtool.machines.planar_arm import PlanarArm
from cdtool.machines.urdf_robot import UrdfRobot

# As pinocchio orders them, inertia about the origin of the joint's frame.
BODY_PARAMETERS = ("mass", "mx", "my", "mz", "ixx", "ixy", "iyy", "ixz", "iyz", "izz")
_PER_BODY = len(BODY_PARAMETERS)
# Of a TreeJoint's inertia xx, xy, xz, yy, yz, zz: the places of the six above.
_INERTIA_PLACES = (0, 1, 3, 2, 4, 5)
_PLANAR = ("M11", "M22", "h", "g1", "g2")


class ColumnGroup(Enum):
    """What a column of the regressor belongs to."""

    INERTIAL = "inertial"
    DRIVE_INERTIA = "drive_inertia"
    VISCOUS = "viscous_friction"
    COULOMB = "coulomb_friction"
    CONSTANT = "constant_force"


PER_JOINT = (ColumnGroup.DRIVE_INERTIA, ColumnGroup.VISCOUS, ColumnGroup.COULOMB, ColumnGroup.CONSTANT)


@dataclass(frozen=True)
class RegressorColumn:
    """A column: its group, its name, and the index of its joint in the recording's order."""

    group: ColumnGroup
    name: str
    joint: int


def regressor_of(machine: CoupledMachine) -> Regressor:
    """Return the regressor of a robot from a URDF or of a planar arm; raises UsageError for another machine."""
    if isinstance(machine, UrdfRobot):
        return TreeRegressor(machine)
    if isinstance(machine, PlanarArm):
        return PlanarRegressor(machine)
    raise UsageError(
        f"machine '{machine.name}': is no robot", "identify_robot needs type = 'urdf_robot' or 'planar_arm'"
    )


class Regressor(ABC):
    """The regressor of a machine: every array (n, J), columns one by one to spare memory.

    The columns of drive and friction are the same for every machine. Dry friction is Coulomb tanh(slope v), or Coulomb
    sign(v) above the stick speed without a slope, as in the machine.
    """

    def __init__(self, machine: CoupledMachine, inertial: tuple[RegressorColumn, ...]) -> None:
        self.machine = machine
        names = tuple(machine.joints)
        own = tuple(
            RegressorColumn(group, f"{group.value} {name}", j) for group in PER_JOINT for j, name in enumerate(names)
        )
        self.columns = inertial + own

    @property
    @abstractmethod
    def values(self) -> FloatArray:
        """Return the machine's own parameters (P,), on the load side."""

    def joint_values(self) -> FloatArray:
        """Return viscous, Coulomb and constant friction on the load side (3 J,)."""
        ratio = np.array(self.machine.transmission_ratio)
        viscous = np.array(self.machine.viscous_friction) / ratio**2
        coulomb = np.array(self.machine.coulomb_friction) / np.abs(ratio)
        return np.concatenate((viscous, coulomb, np.array(self.machine.constant_force) / ratio))

    def friction(self, column: RegressorColumn, speed: FloatArray) -> FloatArray:
        """Return the torque (n, J) of a friction of 1."""
        torque, joint = np.zeros_like(speed), column.joint
        v = speed[:, joint]
        if column.group is ColumnGroup.VISCOUS:
            torque[:, joint] = v
        elif column.group is ColumnGroup.CONSTANT:
            torque[:, joint] = np.where(np.isfinite(v), 1.0, np.nan)
        else:
            torque[:, joint] = self._direction(joint, v)
        return torque

    def _direction(self, joint: int, speed: FloatArray) -> FloatArray:
        """Return dry friction (n,) as a share of its magnitude."""
        slope, stick = self.machine.coulomb_slope[joint], self.machine.stick_speed[joint]
        if slope:
            return np.asarray(np.tanh(slope * speed))
        return np.asarray(np.where(np.abs(speed) <= stick, 0.0, np.sign(speed)))

    def torque(self, column: int, position: FloatArray, speed: FloatArray, acceleration: FloatArray) -> FloatArray:
        """Return the torque (n, J) of the parameter 1."""
        what = self.columns[column]
        if what.group is ColumnGroup.INERTIAL:
            return self._inertial_torque(column, position, speed, acceleration)
        if what.group is not ColumnGroup.DRIVE_INERTIA:
            return self.friction(what, speed)
        torque = np.zeros_like(speed)
        torque[:, what.joint] = acceleration[:, what.joint]
        return torque

    def momentum(self, column: int, position: FloatArray, speed: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return momentum and rest (n, J) of the parameter 1: d momentum / dt + rest = torque."""
        what = self.columns[column]
        if what.group is ColumnGroup.INERTIAL:
            return self._inertial_momentum(column, position, speed)
        if what.group is not ColumnGroup.DRIVE_INERTIA:
            return np.zeros_like(speed), self.friction(what, speed)
        momentum = np.zeros_like(speed)
        momentum[:, what.joint] = speed[:, what.joint]
        return momentum, np.zeros_like(speed)

    @abstractmethod
    def _inertial_torque(
        self, column: int, position: FloatArray, speed: FloatArray, acceleration: FloatArray
    ) -> FloatArray: ...

    @abstractmethod
    def _inertial_momentum(
        self, column: int, position: FloatArray, speed: FloatArray
    ) -> tuple[FloatArray, FloatArray]: ...


class TreeRegressor(Regressor):
    """The regressor of a robot from a URDF: ten inertial columns per moving body, in the order of the tree's joints."""

    def __init__(self, machine: UrdfRobot) -> None:
        self.tree = machine.tree
        places = [self.tree.order.index(joint.name) for joint in self.tree.joints]
        inertial = (
            RegressorColumn(ColumnGroup.INERTIAL, f"{name} {machine.joints[place]}", place)
            for place in places
            for name in BODY_PARAMETERS
        )
        super().__init__(machine, tuple(inertial))
        massless = [
            replace(_with_parameters(item, np.zeros(_PER_BODY)), drive_inertia=0.0) for item in self.tree.joints
        ]
        self._units: list[KinematicTree] = []
        for body, joint in enumerate(massless):
            for row in np.eye(_PER_BODY):
                joints = (*massless[:body], _with_parameters(joint, row), *massless[body + 1 :])
                self._units.append(replace(self.tree, joints=joints))

    @property
    def values(self) -> FloatArray:
        """Return the machine's own parameters (P,)."""
        drive = np.empty(len(self.tree.joints))
        for joint in self.tree.joints:
            drive[self.tree.order.index(joint.name)] = joint.drive_inertia
        bodies = [body_parameters(joint) for joint in self.tree.joints]
        return np.concatenate((*bodies, drive, self.joint_values()))

    def _inertial_torque(
        self, column: int, position: FloatArray, speed: FloatArray, acceleration: FloatArray
    ) -> FloatArray:
        return self._units[column].inverse_dynamics(position, speed, acceleration)

    def _inertial_momentum(self, column: int, position: FloatArray, speed: FloatArray) -> tuple[FloatArray, FloatArray]:
        momentum, velocity_force, gravity = self._units[column].momentum_terms(position, speed)
        gravity -= velocity_force
        return momentum, gravity


class PlanarRegressor(Regressor):
    """The regressor of a planar arm: M11, M22, h, g1, g2 of its equation, drives not included in M11 and M22.

    With the absolute angles q1, q2 (thesis 6.23, 6.24); all five are base parameters.
    """

    def __init__(self, machine: PlanarArm) -> None:
        self._arm = machine
        joints = (0, 1, 1, 0, 1)
        super().__init__(
            machine, tuple(RegressorColumn(ColumnGroup.INERTIAL, *item) for item in zip(_PLANAR, joints, strict=True))
        )

    @property
    def values(self) -> FloatArray:
        """Return the machine's own parameters (P,)."""
        drive = self._arm.reflected_inertia
        own = (*(self._arm.nominal_inertia - drive), self._arm.coupling, *self._arm.gravity_torque)
        return np.concatenate((own, drive, self.joint_values()))

    def _inertial_torque(
        self, column: int, position: FloatArray, speed: FloatArray, acceleration: FloatArray
    ) -> FloatArray:
        torque = np.zeros_like(position)
        if column < 2:
            torque[:, column] = acceleration[:, column]
        elif column == 2:
            turn = position[:, 1] - position[:, 0]
            torque[:, 0] = np.cos(turn) * acceleration[:, 1] - np.sin(turn) * speed[:, 1] ** 2
            torque[:, 1] = np.cos(turn) * acceleration[:, 0] + np.sin(turn) * speed[:, 0] ** 2
        else:
            torque[:, column - 3] = np.cos(position[:, column - 3])
        return torque

    def _inertial_momentum(self, column: int, position: FloatArray, speed: FloatArray) -> tuple[FloatArray, FloatArray]:
        momentum, rest = np.zeros_like(position), np.zeros_like(position)
        if column < 2:
            momentum[:, column] = speed[:, column]
        elif column == 2:
            turn = position[:, 1] - position[:, 0]
            momentum[:] = np.cos(turn)[:, np.newaxis] * speed[:, ::-1]
            rest[:, 1] = np.sin(turn) * speed[:, 0] * speed[:, 1]
            rest[:, 0] = -rest[:, 1]
        else:
            rest[:, column - 3] = np.cos(position[:, column - 3])
        return momentum, rest


def stacked_torque(
    regressor: Regressor, columns: list[int], position: FloatArray, speed: FloatArray, acceleration: FloatArray
) -> FloatArray:
    """Return Y (n, J, len(columns)) of the torque."""
    parts = [regressor.torque(column, position, speed, acceleration) for column in columns]
    return np.stack(parts, axis=2) if parts else np.empty((*position.shape, 0))


def body_parameters(joint: TreeJoint) -> FloatArray:
    """Return the ten parameters of what a joint moves, in its frame, as BODY_PARAMETERS names them."""
    inertia = [joint.inertia[place] for place in _INERTIA_PLACES]
    return np.array([joint.mass, *joint.first_moment, *inertia])


def with_bodies(tree: KinematicTree, parameters: FloatArray) -> KinematicTree:
    """Return the tree with the inertial parameters (10 per joint, in the order of its joints) replaced."""
    bodies = np.reshape(parameters, (len(tree.joints), _PER_BODY))
    return replace(tree, joints=tuple(_with_parameters(*item) for item in zip(tree.joints, bodies, strict=True)))


def _with_parameters(joint: TreeJoint, parameters: FloatArray) -> TreeJoint:
    inertia = [0.0] * 6
    for place, value in zip(_INERTIA_PLACES, parameters[4:].tolist(), strict=True):
        inertia[place] = value
    moment = tuple(parameters[1:4].tolist())
    return replace(joint, mass=float(parameters[0]), first_moment=moment, inertia=tuple(inertia))
