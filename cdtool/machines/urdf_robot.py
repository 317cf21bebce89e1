"""Any serial robot, described by its URDF; drives and friction come from the machine file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import nearest
from cdtool.base.remote.remote_path import joined, location
from cdtool.base.tables import Table
from cdtool.machines.coupled import CoupledMachine
from cdtool.machines.joint_machine import LINEAR_UNITS, ROTARY_UNITS
from cdtool.machines.kinematic_tree import KinematicTree
from cdtool.machines.urdf_reader import read_urdf

# Joints of both kinds: a channel has one unit for all of them, so that each is in its own SI unit.
_MIXED_UNITS = dict.fromkeys(ROTARY_UNITS, "SI")


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

    coordinates_by_default: ClassVar[str] = "load"

    @classmethod
    def from_table(cls, table: Table) -> UrdfRobot:
        """Return the machine of the [machine] table and its URDF; raises ConfigurationError naming key or joint."""
        table.texts("joints")  # the joints of a robot must be named
        keys = cls.drive_keys(table)
        count = len(keys["joints"])
        drives = np.array(table.numbers("drive_inertia", count, 0.0, minimum=0.0))
        drives += np.array(keys["motor_inertia"]) / np.array(keys["transmission_ratio"]) ** 2
        path = joined(location(table.where).parent, table.text("urdf"))
        names = _urdf_names(table, keys["joints"])
        tree = read_urdf(path, names, _values(table, "locked"), drives.tolist(), _gravity(table))
        return cls(**keys, tree=tree, home=table.numbers("home", count, 0.0))

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


def _urdf_names(table: Table, joints: tuple[str, ...]) -> list[str]:
    """Return the URDF's name of each joint of the log: by joint_map, else the same."""
    part = table.table("joint_map")
    renamed: Mapping[str, Any] = part.values
    for name in renamed:
        if name not in joints:
            raise part.fault(name, "is no joint of the log", nearest(name, joints))
    return [part.text(name) if name in renamed else name for name in joints]


def _values(table: Table, key: str) -> dict[str, float]:
    part = table.table(key)
    return {name: part.number(name) for name in part.values}


def _gravity(table: Table) -> tuple[float, float, float]:
    """Return gravity along -z of the base for a number; a vector if the base is mounted in another way."""
    if isinstance(table.raw("gravity"), list):
        x, y, z = table.numbers("gravity", 3)
        return x, y, z
    return 0.0, 0.0, -table.number("gravity", 9.81, minimum=0.0)
