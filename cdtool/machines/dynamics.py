"""The interface of every machine for detectors: arrays (n, J) on the load side, in the recording's order.

Conventions (physics of thesis 2.1-2.5, friction added): M(q) a + C(q, v) v + g(q) + friction = tau - tau_c. The machine
exerts tau_c on the obstacle; every residual tends to +tau_c. Positions q [rad, m], speeds v, torques tau [N m, N].
"""

from __future__ import annotations

from dataclasses import Field, dataclass
from typing import Any, ClassVar, Literal, Protocol, TypeGuard

from cdtool.base.arrays import FloatArray
from cdtool.recordings.recording import Recording

# A gain: one number for all joints, or one per joint (the thesis's diagonal gain matrix, 2.13 and 2.19).
Gain = float | tuple[float, ...]


@dataclass(frozen=True)
class Pendulum:
    """Coupling of one joint of a planar arm to the other: terms that depend on its own angle q.

    gravity cos q + coupling (cos(q - other) a_other + sin(q - other) v_other^2), in N m; `gravity` [N m], `coupling`
    [kg m2]; angle, speed and acceleration of the other link (n,) in rad, rad/s, rad/s2 are measured.
    """

    gravity: float
    coupling: float
    other_position: FloatArray
    other_speed: FloatArray
    other_acceleration: FloatArray


@dataclass(frozen=True)
class JointEquation:
    """A single joint: inertia a = force - d v (- the pendulum's terms), with the virtual friction d to be estimated.

    `inertia` (1,) or (n,) [kg, kg m2]; `force` (n,) [N, N m] without the known terms of the other joints; `viscous`
    [N s/m, N m s/rad]: the initial friction.
    """

    inertia: FloatArray
    force: FloatArray
    viscous: float
    pendulum: Pendulum | None = None


class Machine(Protocol):
    """The interface of machines/: see the module's conventions. Every method takes whole recordings.

    A machine is a frozen dataclass of its parameters, from which its fingerprint is computed.
    """

    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]

    @property
    def name(self) -> str:
        """Return the machine's name."""
        ...

    @property
    def joints(self) -> tuple[str, ...]:
        """Return the joints' names, in the order of every array."""
        ...

    @property
    def coupled(self) -> bool:
        """Whether a joint's equation contains the motion of other joints: then positions are needed too."""
        ...

    @property
    def force_unit(self) -> str:
        """Return the unit of a contact force or torque."""
        ...

    @property
    def speed_unit(self) -> str:
        """Return the unit of the joints' speed."""
        ...

    @property
    def default_sides(self) -> Literal["one", "two"]:
        """Return the sides of its band, "one" or "two", on which a threshold raises alarms by default."""
        ...

    @property
    def load_units(self) -> dict[str, str]:
        """Return the units of torque, speed, position and acceleration on the load side."""
        ...

    @property
    def stick_speed(self) -> tuple[float, ...]:
        """Return the speed below which a joint counts as at rest, one value per joint."""
        ...

    @property
    def nominal_inertia(self) -> FloatArray:
        """Return (J,): the diagonal of M in the home pose [kg, kg m2]."""
        ...

    def accepted_units(self, channel: str) -> tuple[str, ...]:
        """Return the SI units accepted for a channel of a log; a scaled raw value is converted to the first."""
        ...

    def referred_to_load(self, recording: Recording, speed_low_pass: float = 50.0) -> Recording:
        """Return a logged recording with every channel on the load side (apply it once)."""
        ...

    def load_factor(self, channel: str, unit: str) -> FloatArray:
        """Return (J,): by what a logged value in `unit` is multiplied on its way to the load side; 1 if it is there."""
        ...

    def require_inertia(self, who: str) -> None:
        """Raise ConfigurationError if an inertia is missing that `who` needs."""
        ...

    def momentum_balance(
        self, torque: FloatArray, position: FloatArray, speed: FloatArray, velocity: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return (tau - g + C'w - friction, p = M w): the rate of change of momentum, and momentum (thesis 2.16, 2.17).

        The velocity w is the measured speed or a better one; only `speed` determines whether dry friction slides.
        """
        ...

    def force_balance(
        self, torque: FloatArray, position: FloatArray, speed: FloatArray, acceleration: FloatArray | None = None
    ) -> FloatArray:
        """Return tau - C v - g - friction: the part that accelerates the joints or acts on an obstacle.

        With an acceleration, M a is subtracted too.
        """
        ...

    def drive_power(self, torque: FloatArray, speed: FloatArray) -> FloatArray:
        """Return v'(tau - friction) [W]: (n, 1) for the whole machine, (n, J) if the joints are not coupled."""
        ...

    def energy(self, position: FloatArray, speed: FloatArray) -> FloatArray:
        """Return kinetic and potential energy [J], with as many columns as `drive_power`."""
        ...

    def inertia_times(self, position: FloatArray, vector: FloatArray) -> FloatArray:
        """M(q) x."""
        ...

    def inertia_matrix(self, position: FloatArray) -> FloatArray:
        """(n, J, J): M(q)."""
        ...

    def joint_equations(
        self, torque: FloatArray, position: FloatArray, speed: FloatArray, acceleration: FloatArray
    ) -> list[JointEquation]:
        """Return one equation per joint, with the motion of the other joints as known."""
        ...


class LinkedMachine(Machine, Protocol):
    """A machine of coupled joints with the effect of a force at a point of a link."""

    def contact_torque(
        self, position: FloatArray, force: FloatArray, link: str, point: tuple[float, float, float]
    ) -> FloatArray:
        """Return J_c' F (n, J) for the force and moment (n, 6) that the machine exerts on a link (thesis 2.5)."""
        ...

    def contact_force(
        self, position: FloatArray, residual: FloatArray, link: str, point: tuple[float, float, float]
    ) -> FloatArray:
        """Return the force (n, 3) [N] at that point that best explains a joint residual (n, J)."""
        ...


def has_links(machine: Machine) -> TypeGuard[LinkedMachine]:
    """Whether a force can act at a point of one of its links."""
    return machine.coupled
