"""One degree of freedom per joint, without coupling: what a linear and a rotary axis share.

Conventions: everything is referred to the load side (see joint_machine). The force balance is (thesis 5.1, 5.2 on the
load side, friction and a constant force added)

    m a = F_drive - d v - F_coulomb(v) - F_constant - F_c

with F_c positive when it opposes positive travel.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import ConfigurationError
from cdtool.base.settings import Place
from cdtool.machines.dynamics import JointEquation
from cdtool.machines.joint_machine import JointMachine, per_joint


@dataclass(frozen=True)
class Axis(JointMachine):
    """Joints that move independently of one another; parameters as in machine.toml, one value per joint."""

    load_inertia: tuple[float, ...]

    inertia_key: ClassVar[str]
    coupled: ClassVar[bool] = False

    @classmethod
    def parameters(cls, table: Any, place: Place) -> dict[str, Any]:
        """Return the parameters of the machine, one per joint, with the mistakes in `place`."""
        found = super().parameters(table, place)
        return {**found, "load_inertia": per_joint(table, cls.inertia_key, len(found["joints"]), place)}

    @property
    def nominal_inertia(self) -> FloatArray:
        """(J,): load and reflected motor inertia [kg, kg m2]."""
        inertia: FloatArray = np.array(self.load_inertia) + self.reflected_inertia
        return inertia

    def require_inertia(self, who: str) -> None:
        """Raise ConfigurationError, naming the key, if the inertia of a joint is not given and `who` needs it."""
        for joint, inertia in zip(self.joints, self.nominal_inertia, strict=True):
            if inertia <= 0.0:
                raise ConfigurationError(
                    f"machine '{self.name}': {who} needs the inertia of joint '{joint}'",
                    f"give machine.{self.inertia_key} (and motor_inertia), or use a detector without a model",
                )

    def momentum_balance(
        self, torque: FloatArray, position: FloatArray, speed: FloatArray, velocity: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return (F - friction, p = m w), both (n, J); viscous friction acts on the velocity w, like the momentum."""
        return self.minus_friction(torque.copy(), speed, velocity), self.nominal_inertia * velocity

    def force_balance(
        self, torque: FloatArray, position: FloatArray, speed: FloatArray, acceleration: FloatArray | None = None
    ) -> FloatArray:
        """Return F - friction (n, J): what is left to accelerate or to collide; with an acceleration, to collide."""
        force = self.minus_friction(torque.copy(), speed, speed)
        return force if acceleration is None else force - self.inertia_times(position, acceleration)

    def required_torque(self, position: FloatArray, speed: FloatArray, acceleration: FloatArray) -> FloatArray:
        """Return m a + friction (n, J): the drive force of this motion without contact."""
        return self.inertia_times(position, acceleration) + self.friction(speed)

    def energy(self, position: FloatArray, speed: FloatArray) -> FloatArray:
        """Return the kinetic energy of each joint (n, J) [J]; a constant force counts as friction."""
        energy: FloatArray = 0.5 * self.nominal_inertia * speed**2
        return energy

    def inertia_times(self, position: FloatArray, vector: FloatArray) -> FloatArray:
        """Return M x (n, J)."""
        product: FloatArray = self.nominal_inertia * vector
        return product

    def inertia_matrix(self, position: FloatArray) -> FloatArray:
        """Return M (n, J, J): diagonal and equal at every sample."""
        return np.broadcast_to(np.diag(self.nominal_inertia), (len(position), *(2 * (len(self.joints),))))

    def joint_equations(
        self, torque: FloatArray, position: FloatArray, speed: FloatArray, acceleration: FloatArray
    ) -> list[JointEquation]:
        """Return one equation per joint: the virtual friction replaces all viscous friction, the rest is subtracted."""
        force = self.minus_friction(torque.copy(), speed, np.zeros_like(speed))
        inertia = self.nominal_inertia
        return [
            JointEquation(inertia[j : j + 1], force[:, j], self.viscous_friction[j] / self.transmission_ratio[j] ** 2)
            for j in range(len(self.joints))
        ]
