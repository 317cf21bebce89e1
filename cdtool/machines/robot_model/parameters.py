"""The parameters of a robot's model: its links as a tree, and per joint drive, friction, controller and sensors.

Inertial sensors on the links of a planar arm: what they measure across their links.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import ConfigurationError, nearest
from cdtool.machines.axis_model.model_table import Bristle, ModelTable, joint_model
from cdtool.machines.axis_model.parameters import AxisModel
from cdtool.machines.coupled import CoupledMachine
from cdtool.machines.kinematic_tree import KinematicTree, TreeJoint, TreeLink
from cdtool.machines.planar_arm import PlanarArm
from cdtool.machines.robot_model import chain_kernel
from cdtool.machines.urdf_robot import UrdfRobot


@dataclass(frozen=True)
class LinkSensors:
    """Sensors at `distance` (2,) [m] from the joints of two links; the second link's joint is at `arm_length` [m]."""

    distance: tuple[float, ...]
    arm_length: float
    gravity: float

    def specific_force(self, position: FloatArray, speed: FloatArray, acceleration: FloatArray) -> FloatArray:
        """Return what ideal sensors measure across their links (n, 2) [m/s2], gravity included.

        z1 = d1 a1 + g cos q1; z2 = d2 a2 + g cos q2 + l1 (a1 cos(q2 - q1) + v1^2 sin(q2 - q1)): the second one rides
        on the elbow (thesis 6.7, 6.26 corrected). Absolute angles (n, 2) [rad], speeds and accelerations of the links.
        """
        felt: FloatArray = np.array(self.distance) * acceleration + self.gravity * np.cos(position)
        between = position[:, 1] - position[:, 0]
        elbow = acceleration[:, 0] * np.cos(between) + speed[:, 0] ** 2 * np.sin(between)
        felt[:, 1] += self.arm_length * elbow
        return felt


Vector = tuple[float, float, float]

# Keys of [model.drive] that describe an axis only.
_AXIS_ONLY = ("backlash", "motor_friction", "front_mass", "front_stiffness", "front_damping")
# A joint about the y axis of the base, turned anticlockwise as seen with x to the right and z up: its z axis is -y.
_UPRIGHT = (1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0)
_LEVEL = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
# In the joint's frame, the frame of a planar arm's link: x along it, z across it.
_ALONG_ACROSS = (1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0)


@dataclass(frozen=True)
class RobotModel:
    """A robot in closed loop; arrays are in the order of `joints`.

    The tree's joints turn by `combination` (J, J) times the machine's coordinates: a planar arm with both motors on the
    base has absolute link angles. `axes`: drive, friction, controller and sensors of each joint; the load's inertia
    there is only the one in the home pose, the links come from the tree. `motor_in_links`: motor inertia that the tree
    contains too [kg m2, kg]. Unless `smoothing_stated`, the smooth sign of the friction may be made wider.
    `link_sensors` measure accelerations in m/s2, if there are any. `gains_of_inertia`: speed_gain [1/s] and
    integral_gain [1/s2] multiply the inertia matrix in the robot's pose, so that every joint follows equally well.
    """

    name: str
    joints: tuple[str, ...]
    tree: KinematicTree
    combination: tuple[tuple[float, ...], ...]
    axes: tuple[AxisModel, ...]
    bristles: tuple[Bristle, ...]
    motor_in_links: tuple[float, ...]
    smoothing_stated: bool = True
    link_sensors: LinkSensors | None = None
    gains_of_inertia: bool = False

    @property
    def is_rigid(self) -> bool:
        """Whether a joint is modelled as rigid."""
        return any(axis.drive.is_rigid for axis in self.axes)

    def link(self, name: str | int) -> TreeLink:
        """Return a link by its name, or by the index of its joint, from 0; raises ConfigurationError for others."""
        if isinstance(name, int):
            if not 0 <= name < len(self.joints):
                raise ConfigurationError(
                    f"machine '{self.name}': no joint {name}", f"give 0 to {len(self.joints) - 1}, or a link's name"
                )
            number = self._tree_joint(name)
            return next(item for item in self.tree.links if item.joint == number)
        names = [item.name for item in self.tree.links]
        if name not in names:
            raise ConfigurationError(f"machine '{self.name}': unknown link '{name}'", nearest(name, names))
        found = self.tree.links[names.index(name)]
        if found.joint < 0:
            raise ConfigurationError(f"machine '{self.name}': link '{name}' does not move", "name a link that moves")
        return found

    def dynamics(self, position: FloatArray, speed: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return M (J, J) without drives and h = C v + g (J,) at one state (J,) [rad, m]."""
        work, combination = self._placed(position)
        matrix, bias = np.zeros((len(position),) * 2), np.zeros(len(position))
        chain_kernel.fill_dynamics(
            self.bodies, combination, np.ascontiguousarray(speed), self.tree.gravity, work, matrix, bias
        )
        matrix[np.diag_indices(len(bias))] -= np.array(self.motor_in_links)
        return matrix, bias

    def point_along(self, position: FloatArray, joint: int, point: Vector, normal: Vector) -> tuple[float, FloatArray]:
        """Return the place n . P [m] of a point of a tree's joint along a direction n, and J_v' n (J,)."""
        work, combination = self._placed(position)
        lever = np.zeros(len(position))
        place = chain_kernel.fill_lever(self.bodies, combination, joint, point, normal, work, lever)
        return float(place), lever

    @cached_property
    def bodies(self) -> FloatArray:
        """(J, CONSTANTS): the constants of the kernels, one row per joint of the tree."""
        table = np.zeros((len(self.joints), chain_kernel.CONSTANTS))
        for row, joint in zip(table, self.tree.joints, strict=True):
            row[chain_kernel.PARENT] = joint.parent
            row[chain_kernel.SLIDES] = float(joint.prismatic)
            row[chain_kernel.ROTATION : chain_kernel.TRANSLATION] = joint.rotation
            row[chain_kernel.TRANSLATION : chain_kernel.MASS] = joint.translation
            row[chain_kernel.MASS] = joint.mass
            row[chain_kernel.MOMENT : chain_kernel.INERTIA] = joint.first_moment
            row[chain_kernel.INERTIA :] = joint.inertia
        return table

    def _placed(self, position: FloatArray) -> tuple[FloatArray, FloatArray]:
        work = np.zeros((len(self.joints), chain_kernel.WORK))
        combination = np.array(self.combination)
        chain_kernel.place_bodies(self.bodies, combination, np.ascontiguousarray(position), work)
        return work, combination

    def _tree_joint(self, joint: int) -> int:
        """Return the tree's joint that a joint of the machine is, or the last one that it turns."""
        name = self.tree.order[joint]
        return next(index for index, item in enumerate(self.tree.joints) if item.name == name)


def robot_model(machine: CoupledMachine, table: ModelTable | None) -> RobotModel:
    """Return the model of a robot: links of [machine], and per joint what [model] has.

    The motors' inertia is that of [machine]; [model.drive] motor_mass is a share of the links' own. Without stiffness
    the joints are rigid. Raises ConfigurationError for keys of an axis, for values that contradict one another, and for
    controllers with different periods.
    """
    table = table or ModelTable({})
    for key in _AXIS_ONLY:
        if key in table.sections.get("drive", {}):
            raise ConfigurationError(
                f"machine '{machine.name}': model.drive.{key} applies to an axis only",
                "remove it; what gives way at the contact is in_series_n_per_mm of the obstacle",
            )
    tree, combination, motors = _links(machine)
    inertia = machine.nominal_inertia
    axes, in_links = [], []
    for joint, motor in enumerate(motors):
        own = joint_model(machine, table, joint, (motor, float(inertia[joint]) - motor))
        in_links.append(own.drive.motor_mass - motor)
        axes.append(_smooth(own, machine, table, joint))
    periods = {axis.controller.period for axis in axes if axis.controller is not None}
    if len(periods) > 1:
        raise ConfigurationError(
            f"machine '{machine.name}': model.controller.period differs between joints", "give one period"
        )
    count = len(axes)
    return RobotModel(
        name=machine.name,
        joints=machine.joints,
        tree=tree,
        combination=combination,
        axes=tuple(axes),
        bristles=tuple(Bristle(**table.of_joint("bristle", joint)) for joint in range(count)),
        motor_in_links=tuple(in_links),
        smoothing_stated="smoothing_speed" in table.sections.get("friction", {}),
        link_sensors=_link_sensors(machine),
    )


def _link_sensors(machine: CoupledMachine) -> LinkSensors | None:
    if not isinstance(machine, PlanarArm) or not all(machine.imu_position):
        return None
    return LinkSensors(machine.imu_position, machine.link_length, machine.gravity_acceleration)


def _smooth(axis: AxisModel, machine: CoupledMachine, table: ModelTable, joint: int) -> AxisModel:
    """Return the joint with the sign of its friction as smooth as [machine] states it."""
    if "smoothing_speed" in table.sections.get("friction", {}):
        return axis
    slope = machine.coulomb_slope[joint]
    speed = 1.0 / slope if slope > 0.0 else machine.stick_speed[joint]
    return replace(axis, friction=replace(axis.friction, smoothing_speed=speed))


def _links(machine: CoupledMachine) -> tuple[KinematicTree, tuple[tuple[float, ...], ...], tuple[float, ...]]:
    """Return the tree, the combination of its joints, and the inertia of the drives [kg m2, kg]."""
    if isinstance(machine, UrdfRobot):
        tree = machine.tree
        place = [tree.order.index(joint.name) for joint in tree.joints]
        identity = np.eye(len(place))
        drives = {tree.order.index(joint.name): joint.drive_inertia for joint in tree.joints}
        return tree, _rows(identity[place]), tuple(drives[column] for column in range(len(place)))
    if isinstance(machine, PlanarArm):
        # The forearm's angle to the arm is q2 - q1: its motor stands on the base.
        return planar_tree(machine), ((1.0, 0.0), (-1.0, 1.0)), tuple(machine.reflected_inertia.tolist())
    raise ConfigurationError(
        f"machine '{machine.name}': contacts cannot be injected into a {type(machine).__name__}",
        "use a planar_arm or a urdf_robot",
    )


def planar_tree(machine: PlanarArm) -> KinematicTree:
    """Return the two links as a tree: x to the right, z up, the second joint's angle relative to the first."""
    joints, links = [], []
    for index, name in enumerate(machine.joints):
        mass, centre = machine.link_mass[index], machine.centre_of_mass[index]
        about_joint = machine.link_inertia[index] + mass * centre**2
        joints.append(
            TreeJoint(
                name=name,
                parent=index - 1,
                prismatic=False,
                rotation=_UPRIGHT if index == 0 else _LEVEL,
                translation=(0.0, 0.0, 0.0) if index == 0 else (machine.link_length, 0.0, 0.0),
                mass=mass,
                first_moment=(mass * centre, 0.0, 0.0),
                inertia=(0.0, 0.0, 0.0, about_joint, 0.0, about_joint),
            )
        )
        links.append(TreeLink(name, index, _ALONG_ACROSS, (0.0, 0.0, 0.0)))
    gravity = (0.0, 0.0, -machine.gravity_acceleration)
    return KinematicTree(tuple(joints), tuple(links), machine.joints, gravity)


def point_in_joint(link: TreeLink, point: Vector) -> Vector:
    """Return a point of a link's frame in the frame of the joint that moves it [m]."""
    place = np.array(link.translation) + np.array(link.rotation).reshape(3, 3) @ np.array(point)
    return float(place[0]), float(place[1]), float(place[2])


def _rows(matrix: FloatArray) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(float(value) for value in row) for row in matrix)


def largest_rate(matrix: FloatArray, stiffness: Sequence[float]) -> float:
    """Return the largest eigenvalue of M^-1 diag(stiffness): a rate [1/s] of a damping, a square of one of a spring."""
    root = np.sqrt(np.array(stiffness))
    if not np.any(root):
        return 0.0
    eigenvalues = np.linalg.eigvalsh(root[:, np.newaxis] * np.linalg.inv(matrix) * root)
    return max(float(eigenvalues[-1]), 0.0) if math.isfinite(float(eigenvalues[-1])) else math.inf
