"""What a detector may ask of a machine, whatever its kind: arrays (n, J) on the load side, in the recording's order.

Conventions (physics of thesis 2.1-2.5, friction added): M(q) a + C(q, v) v + g(q) + friction = tau - tau_c. tau_c is
what the machine exerts on the obstacle; every residual tends to +tau_c. Positions q [rad, m], speeds v, torques tau
[N m, N].
"""

from __future__ import annotations

from dataclasses import Field, dataclass
from typing import Any, ClassVar, Protocol, TypeGuard

from cdtool.recording import FloatArray, Recording

# A gain: one number for all joints, or one a joint (the thesis's diagonal gain matrix, 2.13 and 2.19).
Gain = float | tuple[float, ...]


@dataclass(frozen=True)
class Pendulum:
    """What links one joint of a planar arm to the other: terms that depend on its own angle q.

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
    """One joint alone: inertia a = force - d v (- the pendulum's terms), with the virtual friction d to be estimated.

    `inertia` (1,) or (n,) [kg, kg m2]; `force` (n,) [N, N m] without anything that is known of the other joints;
    `viscous` [N s/m, N m s/rad]: the friction to start from.
    """

    inertia: FloatArray
    force: FloatArray
    viscous: float
    pendulum: Pendulum | None = None


class Machine(Protocol):
    """The contract of machines/: see the module's conventions. Every method works on whole recordings at once.

    A machine is a frozen dataclass of its parameters, from which its fingerprint is made. `default_sides`, "one" or
    "two": on which sides of its band a threshold raises alarms where neither settings nor a file say.
    """

    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]
    default_sides: ClassVar[str]

    @property
    def name(self) -> str:
        """The machine's name."""
        ...

    @property
    def joints(self) -> tuple[str, ...]:
        """The joints' names, in the order of every array."""
        ...

    @property
    def coupled(self) -> bool:
        """Whether a joint's equation holds the other joints' motion: then positions are needed too."""
        ...

    @property
    def force_unit(self) -> str:
        """Unit of a contact force or torque."""
        ...

    @property
    def speed_unit(self) -> str:
        """Unit of the joints' speed."""
        ...

    @property
    def load_units(self) -> dict[str, str]:
        """Units of torque, speed, position and acceleration on the load side."""
        ...

    @property
    def stick_speed(self) -> tuple[float, ...]:
        """Below this speed a joint counts as resting, one value a joint."""
        ...

    @property
    def nominal_inertia(self) -> FloatArray:
        """(J,): the diagonal of M at the home pose [kg, kg m2]."""
        ...

    def accepted_units(self, channel: str) -> tuple[str, ...]:
        """SI units in which a log may hold a channel; the first is what a scaled raw value becomes."""
        ...

    def referred_to_load(self, recording: Recording, speed_low_pass: float = 50.0) -> Recording:
        """A recording as logged -> the same with every channel on the load side (apply it once)."""
        ...

    def require_inertia(self, who: str) -> None:
        """Raise ConfigurationError where an inertia is not given and `who` needs it."""
        ...

    def momentum_balance(
        self, torque: FloatArray, position: FloatArray, speed: FloatArray, velocity: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """(tau - g + C'w - friction, p = M w): what changes the momentum, and the momentum (thesis 2.16, 2.17).

        The velocity w is the measured speed or a better one; `speed` alone decides whether dry friction slides.
        """
        ...

    def force_balance(self, torque: FloatArray, position: FloatArray, speed: FloatArray) -> FloatArray:
        """tau - C v - g - friction: what is left to accelerate or to collide."""
        ...

    def drive_power(self, torque: FloatArray, speed: FloatArray) -> FloatArray:
        """v'(tau - friction) [W]: (n, 1) of the whole machine, (n, J) where the joints are not coupled."""
        ...

    def energy(self, position: FloatArray, speed: FloatArray) -> FloatArray:
        """Kinetic and potential energy [J], as many columns as `drive_power` has."""
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
        """One equation a joint, the other joints' motion taken as known."""
        ...


class LinkedMachine(Machine, Protocol):
    """A machine of coupled joints: it knows what a force at a point of a link does to them."""

    def contact_torque(
        self, position: FloatArray, force: FloatArray, link: str, point: tuple[float, float, float]
    ) -> FloatArray:
        """J_c' F (n, J) of the force and moment (n, 6) that the machine exerts at a point of a link (thesis 2.5)."""
        ...

    def contact_force(
        self, position: FloatArray, residual: FloatArray, link: str, point: tuple[float, float, float]
    ) -> FloatArray:
        """The force (n, 3) [N] at that point that explains a joint residual (n, J) best."""
        ...


def has_links(machine: Machine) -> TypeGuard[LinkedMachine]:
    """Whether a force can be said to act at a point of one of its links."""
    return machine.coupled
