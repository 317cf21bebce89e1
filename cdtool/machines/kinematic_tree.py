"""Dynamics of a robot whose joints form a tree: momentum, energies, inverse dynamics, inertia matrix, Jacobian.

Conventions: arrays (n, J) of n samples have their columns in the order of `KinematicTree.order`, the recording's order.
Joint positions rad or m, speeds per second, torques N m or N. The base does not move; its axes are those of `gravity`.
With the inertia matrix M, Coriolis matrix C and gravity torque g (thesis 2.1, without friction)

    M(q) qdd + C(q, qd) qd + g(q) = tau,    dM/dt = C + C^T

Motors add the inertia of their rotors to the diagonal of M. A sample with a value that is not finite gives NaN in all
its results; other samples are not touched.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import ConfigurationError, UsageError, nearest
from cdtool.machines import tree_rows as rows
from cdtool.machines.tree_inverse_kernel import sweep_inverse_dynamics, sweep_jacobian
from cdtool.machines.tree_kernel import sweep_energies, sweep_inertia, sweep_inertia_times, sweep_momentum


@dataclass(frozen=True)
class TreeJoint:
    """A joint about or along the z axis of its frame, with everything that is fixed to what it moves.

    `parent`: index of the joint that carries it, -1 the base. `rotation` (9, row by row) and `translation` (3) [m]: its
    frame at position 0 in the parent's frame. `mass` [kg], `first_moment` mass times centre of mass (3) [kg m],
    `inertia` about the frame's origin (6: xx, xy, xz, yy, yz, zz) [kg m2], all in the joint's frame. `drive_inertia`:
    of the rotor, on the load side [kg m2 or kg].
    """

    name: str
    parent: int
    prismatic: bool
    rotation: tuple[float, ...]
    translation: tuple[float, ...]
    mass: float
    first_moment: tuple[float, ...]
    inertia: tuple[float, ...]
    drive_inertia: float = 0.0


@dataclass(frozen=True)
class TreeLink:
    """A link: the index of the joint it moves with (-1: fixed to the base) and its frame in that joint's frame."""

    name: str
    joint: int
    rotation: tuple[float, ...]
    translation: tuple[float, ...]


@dataclass(frozen=True)
class KinematicTree:
    """Joints with parents before children, links, `order` of the columns by name, gravity in the base's axes [m/s2].

    Raises ConfigurationError if `order` does not name every joint once, or a child comes before its parent.
    """

    joints: tuple[TreeJoint, ...]
    links: tuple[TreeLink, ...]
    order: tuple[str, ...]
    gravity: tuple[float, float, float] = (0.0, 0.0, -9.81)

    def __post_init__(self) -> None:
        names = [joint.name for joint in self.joints]
        if not names or sorted(names) != sorted(self.order) or len(set(names)) != len(names):
            raise ConfigurationError(
                f"order names {', '.join(self.order)}, but the joints are {', '.join(names)}", "name every joint once"
            )
        for index, joint in enumerate(self.joints):
            if not -1 <= joint.parent < index:
                raise ConfigurationError(f"joint '{joint.name}' comes before its parent", "parents come first")

    def momentum_terms(self, position: FloatArray, speed: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return momentum p = M qd, velocity force C^T qd = dT/dq and gravity torque g = dU/dq, (n, J) each.

        For a momentum observer: dp/dt = tau + C^T qd - g - tau_c (thesis 2.17, beta = g - C^T qd). Neither M nor C is
        formed: one sweep out, one back. Raises UsageError if shapes do not fit.
        """
        position, speed = self._table("position", position), self._table("speed", speed, position)
        terms = np.empty_like(position), np.empty_like(position), np.empty_like(position)
        sweep_momentum(self._bodies, self._route, self._gravity, position, speed, terms)
        return terms

    def energies(self, position: FloatArray, speed: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return kinetic energy T = qd^T M qd / 2, drives included, and potential energy U, (n,) each [J].

        U = -sum m c.g_vec over all moving masses, 0 if they are at the base's origin. Raises UsageError if shapes
        do not fit.
        """
        position, speed = self._table("position", position), self._table("speed", speed, position)
        kinetic, potential = np.empty(len(position)), np.empty(len(position))
        sweep_energies(self._bodies, self._route, self._gravity, position, speed, kinetic, potential)
        return kinetic, potential

    def inertia_times(self, position: FloatArray, vector: FloatArray) -> FloatArray:
        """Return M(q) x (n, J) for a vector x per sample, without M; raises UsageError if shapes do not fit."""
        position, vector = self._table("position", position), self._table("speed", vector, position)
        product = np.empty_like(position)
        sweep_inertia_times(self._bodies, self._route, position, vector, product)
        return product

    def inverse_dynamics(self, position: FloatArray, speed: FloatArray, acceleration: FloatArray) -> FloatArray:
        """Return M qdd + C qd + g, (n, J): torques of the motion without friction and contact, drives included.

        Recursive Newton-Euler. Raises UsageError if shapes do not fit.
        """
        position, speed = self._table("position", position), self._table("speed", speed, position)
        acceleration, torque = self._table("acceleration", acceleration, position), np.empty_like(position)
        sweep_inverse_dynamics(self._bodies, self._route, self._gravity, position, speed, acceleration, torque)
        return torque

    def inertia_matrix(self, position: FloatArray) -> FloatArray:
        """Return M(q), (n, J, J), drive inertias on its diagonal. Raises UsageError if shapes do not fit."""
        position = self._table("position", position)
        matrix = np.empty((*position.shape, len(self.joints)))
        sweep_inertia(self._bodies, self._route, position, np.empty_like(position), matrix)
        return matrix

    def inertia_diagonal(self, position: FloatArray) -> FloatArray:
        """Return the diagonal of M(q), (n, J), drive inertias included. Raises UsageError if shapes do not fit."""
        position = self._table("position", position)
        diagonal, none = np.empty_like(position), np.empty((0, 0, 0))
        sweep_inertia(self._bodies, self._route, position, diagonal, none)
        return diagonal

    def contact_jacobian(self, position: FloatArray, link: str, point: tuple[float, float, float]) -> FloatArray:
        """Return J_c (n, 6, J): linear, then angular velocity of a point of a link per joint speed, base axes (2.2).

        `point` is fixed to the link and given in its frame [m]. A contact force and torque F_c load the joints with
        tau_c = J_c^T F_c (2.5). Raises ConfigurationError for an unknown link, UsageError if shapes do not
        fit.
        """
        position = self._table("position", position)
        found = next((item for item in self.links if item.name == link), None)
        if found is None:
            raise ConfigurationError(f"no link '{link}'", nearest(link, (item.name for item in self.links)))
        if len(point) != 3:
            raise UsageError(f"a point of {len(point)} values", "give x, y, z in the link's frame [m]")
        path: list[int] = []
        joint = found.joint
        while joint >= 0:
            path.insert(0, joint)
            joint = self.joints[joint].parent
        place = np.array(found.translation) + _matrix(found.rotation) @ np.array(point, dtype=np.float64)
        jacobian = np.zeros((len(position), 6, len(self.joints)))
        steps = np.array(path, dtype=np.int64)
        sweep_jacobian(self._bodies, self._route, steps, tuple(place.tolist()), position, jacobian)
        return jacobian

    @cached_property
    def _bodies(self) -> FloatArray:
        """Return the kernels' constants, one row per joint."""
        moved = [joint.mass for joint in self.joints]
        for index in range(len(moved) - 1, -1, -1):
            if self.joints[index].parent >= 0:
                moved[self.joints[index].parent] += moved[index]
        table = np.empty((len(self.joints), rows.CONSTANTS))
        for row, joint, mass in zip(table, self.joints, moved, strict=True):
            row[rows.ROTATION : rows.TRANSLATION] = joint.rotation
            row[rows.TRANSLATION : rows.MASS] = _matrix(joint.rotation).T @ np.array(joint.translation)
            row[rows.MASS] = joint.mass
            row[rows.MOMENT : rows.INERTIA] = joint.first_moment
            row[rows.INERTIA : rows.DRIVE] = joint.inertia
            row[rows.DRIVE] = joint.drive_inertia
            row[rows.SLIDES] = 1.0 if joint.prismatic else 0.0
            row[rows.MOVED_MASS] = mass
        return table

    @cached_property
    def _route(self) -> rows.IndexArray:
        """Return the kernels' path through the tree: slot 0 is the base, a joint's slot follows the one before it."""
        table = np.empty((len(self.joints), rows.STEPS), dtype=np.int64)
        own: list[int] = []
        last = 0
        for row, joint in zip(table, self.joints, strict=True):
            parent = own[joint.parent] if joint.parent >= 0 else 0
            follows = parent == last
            row[rows.COLUMN] = self.order.index(joint.name)
            row[rows.BEFORE] = last if follows else last + 1
            row[rows.COPY_OF] = -1 if follows else parent
            row[rows.PARENT] = joint.parent
            last = int(row[rows.BEFORE]) + 1
            own.append(last)
        return table

    @cached_property
    def _gravity(self) -> FloatArray:
        return np.array(self.gravity, dtype=np.float64)

    def _table(self, name: str, values: FloatArray, like: FloatArray | None = None) -> FloatArray:
        """Return a table (n, J) as the kernels read it, after checking its shape: they do not check bounds."""
        table = np.ascontiguousarray(values, dtype=np.float64)
        samples = len(table) if like is None and table.ndim else len(like) if like is not None else 0
        if table.shape != (samples, len(self.joints)):
            raise UsageError(
                f"{name} has the shape {table.shape}, wanted ({samples or 'n'}, {len(self.joints)})",
                f"one column for each of {', '.join(self.order)}",
            )
        return table


def _matrix(rotation: tuple[float, ...]) -> FloatArray:
    return np.array(rotation, dtype=np.float64).reshape(3, 3)
