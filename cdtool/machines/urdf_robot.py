"""Any serial robot, described by its URDF; drives and friction come from the machine file."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import nearest
from cdtool.base.remote.remote_path import joined, location
from cdtool.base.settings import NotNegative, Place, setting
from cdtool.machines.coupled import CoupledMachine
from cdtool.machines.joint_machine import (
    LINEAR_UNITS,
    ROTARY_UNITS,
    JointTable,
    PerJoint,
    PerJointNotNegative,
    per_joint,
)
from cdtool.machines.kinematic_tree import KinematicTree
from cdtool.machines.urdf_reader import read_urdf

# Joints of both kinds: a channel has one unit for all of them, so that each is in its own SI unit.
_MIXED_UNITS = dict.fromkeys(ROTARY_UNITS, "SI")


@dataclass(frozen=True, kw_only=True)
class UrdfRobotTable(JointTable):
    """The keys of a robot from a URDF."""

    urdf: Annotated[str, setting("the URDF file, relative to the machine file")]
    joint_map: Annotated[
        dict[str, str], setting("if log and URDF name a joint differently: log's name = \"URDF's name\"")
    ] = field(default_factory=dict)
    locked: Annotated[
        dict[str, float],
        setting(
            "joints of the URDF that are not in the log, and the position at which they are fixed", unit="m or rad"
        ),
    ] = field(default_factory=dict)
    drive_inertia: Annotated[
        PerJointNotNegative,
        setting(
            "of rotor and gear, referred to the joint; motor_inertia / transmission_ratio^2 is added to it",
            unit="kg m2 or kg",
        ),
    ] = (0.0,)
    home: Annotated[PerJoint, setting("a usual pose; some gains refer to the inertia there", unit="rad or m")] = (0.0,)
    gravity: Annotated[
        NotNegative | tuple[float, float, float],
        setting("a number points along -z of the URDF's root link; three are a vector in its axes", unit="m/s2"),
    ] = 9.81


@dataclass(frozen=True)
class UrdfRobot(CoupledMachine):
    """Any serial robot, by its URDF; drive inertias, ratios and friction of its joints from the machine file.

    M, C and g from the URDF's links, and on the diagonal of M the drives: `drive_inertia` + motor_inertia / r^2. Logs
    hold the joints' own torque, angle and speed (coordinates = "load"), or the motors', referred by transmission_ratio;
    a current becomes a torque by its channel's scale. `home` is the pose at which the nominal inertia is taken.
    Revolute, continuous and prismatic joints; needs the extra cdtool[urdf].
    """

    tree: KinematicTree
    home: tuple[float, ...]

    table: ClassVar[type[JointTable]] = UrdfRobotTable
    coordinates_by_default: ClassVar[str] = "load"

    @classmethod
    def parameters(cls, table: UrdfRobotTable, place: Place) -> dict[str, Any]:
        """Return the parameters of the robot and its URDF; raises ConfigurationError naming key or joint."""
        if not table.joints:
            raise place.fault("joints", "is missing", "give a list of texts")
        drive_inertia, home = (per_joint(table, key, len(table.joints), place) for key in ("drive_inertia", "home"))
        found = super().parameters(table, place)
        joints = found["joints"]
        drives = np.array(drive_inertia) + np.array(found["motor_inertia"]) / np.array(found["transmission_ratio"]) ** 2
        for name in table.joint_map:
            if name not in joints:
                place.below("joint_map").note(name, "is not a joint of the log", nearest(name, joints))
        names = [table.joint_map.get(name, name) for name in joints]
        gravity = table.gravity if isinstance(table.gravity, tuple) else (0.0, 0.0, -table.gravity)
        path = joined(location(place.where).parent, table.urdf)
        with place.at("urdf"):
            tree = read_urdf(path, names, table.locked, drives.tolist(), gravity)
        return {**found, "tree": tree, "home": home}

    @property
    def load_units(self) -> dict[str, str]:
        """Of revolute or of prismatic joints; "SI", each joint's own, where the robot has both."""
        sliding = {joint.prismatic for joint in self.tree.joints}
        if sliding == {False}:
            return ROTARY_UNITS
        return LINEAR_UNITS if sliding == {True} else _MIXED_UNITS

    @property
    def nominal_inertia(self) -> FloatArray:
        """(J,): the diagonal of M at home [kg m2, kg]."""
        return np.diag(self.inertia_matrix(np.array([self.home]))[0]).copy()

    def momentum_terms(self, position: FloatArray, speed: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """p = M v, C'v and g, each (n, J)."""
        return self.tree.momentum_terms(position, speed)

    def inverse_dynamics(self, position: FloatArray, speed: FloatArray, acceleration: FloatArray) -> FloatArray:
        """M a + C v + g (n, J)."""
        return self.tree.inverse_dynamics(position, speed, acceleration)

    def _balance(
        self,
        torque: FloatArray,
        position: FloatArray,
        speed: FloatArray,
        velocity: FloatArray,
        acceleration: FloatArray | None,
    ) -> FloatArray:
        """As of every coupled machine; M a + C v + g is one sweep where no friction depends on the force.

        Dry friction without a slope does: it balances the force of a resting joint.
        """
        sticks = any(own and not slope for own, slope in zip(self.coulomb_friction, self.coulomb_slope, strict=True))
        if acceleration is None or sticks:
            return super()._balance(torque, position, speed, velocity, acceleration)
        rest = torque - self.inverse_dynamics(position, speed, acceleration)
        return self.minus_friction(rest, speed, velocity)

    def inertia_times(self, position: FloatArray, vector: FloatArray) -> FloatArray:
        """M x (n, J)."""
        return self.tree.inertia_times(position, vector)

    def inertia_matrix(self, position: FloatArray) -> FloatArray:
        """M (n, J, J), drives included."""
        return self.tree.inertia_matrix(position)

    def inertia_diagonal(self, position: FloatArray) -> FloatArray:
        """The diagonal of M (n, J), without the rest of it."""
        return self.tree.inertia_diagonal(position)

    def energies(self, position: FloatArray, speed: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Kinetic and potential energy, each (n,) [J]."""
        return self.tree.energies(position, speed)

    def contact_jacobian(self, position: FloatArray, link: str, point: tuple[float, float, float]) -> FloatArray:
        """J_c (n, 6, J) of a point of a link of the URDF, in the link's frame [m]; raises ConfigurationError."""
        return self.tree.contact_jacobian(position, link, point)
