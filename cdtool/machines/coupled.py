"""Machines with coupled joints: what a planar arm and a robot from a URDF share.

M(q) a + C(q, v) v + g(q) + friction = tau - tau_c (thesis 2.4, friction added), tau_c = J_c' F_c (2.5): what the
machine exerts on the obstacle. C is the matrix of Christoffel symbols, so that dM/dt = C + C'.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.machines.dynamics import JointEquation
from cdtool.machines.joint_machine import JointMachine


@dataclass(frozen=True)
class CoupledMachine(JointMachine, ABC):
    """A machine of coupled joints; methods use whole recordings: position, speed and torque (n, J), load side."""

    coupled: ClassVar[bool] = True
    derives_position: ClassVar[bool] = False

    @property
    @abstractmethod
    def nominal_inertia(self) -> FloatArray:
        """(J,): the diagonal of M at home [kg m2, kg]."""

    @abstractmethod
    def momentum_terms(self, position: FloatArray, speed: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return p = M v, C'v and g, each (n, J): momentum [N m s, N s] and torques [N m, N]."""

    @abstractmethod
    def inverse_dynamics(self, position: FloatArray, speed: FloatArray, acceleration: FloatArray) -> FloatArray:
        """Return M a + C v + g (n, J) [N m, N]."""

    @abstractmethod
    def inertia_times(self, position: FloatArray, vector: FloatArray) -> FloatArray:
        """Return M x (n, J)."""

    @abstractmethod
    def inertia_matrix(self, position: FloatArray) -> FloatArray:
        """Return M (n, J, J), drives included."""

    def inertia_diagonal(self, position: FloatArray) -> FloatArray:
        """Return the diagonal of M (n, J)."""
        return np.asarray(np.einsum("njj->nj", self.inertia_matrix(position)))

    @abstractmethod
    def energies(self, position: FloatArray, speed: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return kinetic and potential energy, each (n,) [J]."""

    @abstractmethod
    def contact_jacobian(self, position: FloatArray, link: str, point: tuple[float, float, float]) -> FloatArray:
        """Return J_c (n, 6, J) of a point in a link's frame [m]: linear, then angular velocity, base axes (2.2)."""

    def momentum(self, position: FloatArray, speed: FloatArray) -> FloatArray:
        """Return p = M v (n, J), thesis 2.16."""
        return self.inertia_times(position, speed)

    def velocity_force(self, position: FloatArray, speed: FloatArray) -> FloatArray:
        """Return C'v (n, J), the derivative of the kinetic energy by q."""
        return self.momentum_terms(position, speed)[1]

    def gravity(self, position: FloatArray) -> FloatArray:
        """Return g (n, J): the drive torques that hold the machine."""
        return self.momentum_terms(position, np.zeros_like(position))[2]

    def contact_torque(
        self, position: FloatArray, force: FloatArray, link: str, point: tuple[float, float, float]
    ) -> FloatArray:
        """Return tau_c = J_c' F_c (n, J), thesis 2.5; `force` (n, 6): exerted force and moment, base axes."""
        jacobian = self.contact_jacobian(position, link, point)
        return np.asarray(np.einsum("nij,ni->nj", jacobian, force))

    def contact_force(
        self, position: FloatArray, residual: FloatArray, link: str, point: tuple[float, float, float]
    ) -> FloatArray:
        """Return the force (n, 3) [N] at a known point that explains a joint residual best.

        Only the part of the force that moves the joints is visible: in a direction in which the point cannot move, or
        hardly (5 % of its best direction, near a singular pose), it is 0.
        """
        jacobian = self.contact_jacobian(position, link, point)[:, :3]
        # A singular value of the Jacobian below 5 % of the largest only contributes noise to a force.
        return np.asarray(np.einsum("nij,nj->ni", np.linalg.pinv(jacobian.transpose(0, 2, 1), rcond=0.05), residual))

    def require_inertia(self, who: str) -> None:
        """Do nothing: a coupled machine always has its inertia."""

    def momentum_balance(
        self, torque: FloatArray, position: FloatArray, speed: FloatArray, velocity: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return (tau - g + C'w - friction, p = M w), both (n, J): thesis 2.17 with beta = g - C'w + friction."""
        momentum, velocity_force, gravity = self.momentum_terms(position, velocity)
        velocity_force -= gravity
        velocity_force += torque
        return self.minus_friction(velocity_force, speed, velocity), momentum

    def force_balance(
        self, torque: FloatArray, position: FloatArray, speed: FloatArray, acceleration: FloatArray | None = None
    ) -> FloatArray:
        """Return tau - C v - g - friction (n, J), with an acceleration also without M a."""
        return self._balance(torque, position, speed, speed, acceleration)

    def _balance(
        self,
        torque: FloatArray,
        position: FloatArray,
        speed: FloatArray,
        velocity: FloatArray,
        acceleration: FloatArray | None,
    ) -> FloatArray:
        """As `force_balance`; viscous friction acts on `velocity`."""
        rest = torque - self.inverse_dynamics(position, speed, np.zeros_like(speed))
        force = self.minus_friction(rest, speed, velocity)
        return force if acceleration is None else force - self.inertia_times(position, acceleration)

    def required_torque(self, position: FloatArray, speed: FloatArray, acceleration: FloatArray) -> FloatArray:
        """Return M a + C v + g + friction (n, J)."""
        return self.inverse_dynamics(position, speed, acceleration) + self.friction(speed)

    def drive_power(self, torque: FloatArray, speed: FloatArray) -> FloatArray:
        """Return v'(tau - friction) of all joints together (n, 1) [W]."""
        power: FloatArray = np.sum(super().drive_power(torque, speed), axis=1, keepdims=True)
        return power

    def energy(self, position: FloatArray, speed: FloatArray) -> FloatArray:
        """Return kinetic plus potential energy (n, 1) [J]."""
        kinetic, potential = self.energies(position, speed)
        return (kinetic + potential)[:, np.newaxis]

    def joint_equations(
        self, torque: FloatArray, position: FloatArray, speed: FloatArray, acceleration: FloatArray
    ) -> list[JointEquation]:
        """M_jj a_j = tau_j - (C v + g)_j - sum over the others M_ji a_i - d v_j: the other joints are measured."""
        diagonal = self.inertia_diagonal(position)
        known = self._balance(torque, position, speed, np.zeros_like(speed), acceleration) + diagonal * acceleration
        rows = zip(np.ascontiguousarray(diagonal.T), np.ascontiguousarray(known.T), strict=True)
        return [
            JointEquation(inertia, own, self.viscous_friction[j] / self.transmission_ratio[j] ** 2)
            for j, (inertia, own) in enumerate(rows)
        ]
