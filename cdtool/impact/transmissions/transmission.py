"""A motor that drives a load, through a rigid or an elastic transmission: parameters and equations of motion.

Conventions: r = dx_l/dtheta_m [m/rad] (thesis 4.1); motor quantities are angles and torques, load quantities are
linear; F_c >= 0 is what the load exerts on the obstacle. The state of the motion is kept on the load side, relative to
the obstacle: x_l - x_o and, behind an elastic transmission, r theta_m - x_o.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from cdtool.base.errors import UsageError
from cdtool.impact.checks import require_not_negative, require_positive


@dataclass(frozen=True)
class RigidTransmission:
    """tau_m - r F_c = J_t thdd + d_t thd (thesis 4.6 and 4.10): motor and load move as one.

    `inertia` J_t = J_m + M_l r^2 [kg m2] and `friction` d_t = d_m + d_l r^2 [N m s/rad] at the motor, `ratio` r
    [m/rad]. Raises UsageError for values outside their range. Fails if the contact is stiff relative to the drive (see
    `rigidity`).
    """

    inertia: float
    friction: float
    ratio: float

    def __post_init__(self) -> None:
        require_positive("inertia", self.inertia, "kg m2")
        require_positive("ratio", self.ratio, "m/rad")
        require_not_negative("friction", self.friction, "N m s/rad")

    @property
    def mass(self) -> float:
        """What moves, on the load side: J_t/r^2 [kg]."""
        return self.inertia / self.ratio**2

    @property
    def moving_mass(self) -> float:
        """The mass that hits the obstacle: all of it [kg]."""
        return self.mass

    @property
    def swing_period(self) -> float:
        """Nothing swings within it [s]."""
        return math.inf

    def start(self, penetration: float, load_speed: float, motor_speed: float | None) -> list[float]:
        """(penetration [m], its rate [m/s]); raises UsageError if the motor is to move separately."""
        if motor_speed is not None and abs(motor_speed * self.ratio - load_speed) > 1e-12:
            raise UsageError(
                f"motor speed is {motor_speed:g} rad/s", "behind a rigid transmission the load's speed decides it"
            )
        return [penetration, load_speed]

    def rates(self, state: Any, torque: Any, force: Any) -> list[Any]:
        """Rate of change of one or many states under a motor torque [N m] and a contact force [N]."""
        speed = state[1]
        return [speed, ((torque - self.friction * speed / self.ratio) / self.ratio - force) / self.mass]

    def drive_force(self, state: Any) -> Any:
        """NaN: between rigidly coupled motor and load no force is defined."""
        return np.full_like(state[0], np.nan)

    def motor(self, state: Any) -> tuple[Any, Any]:
        """Motor angle relative to the obstacle [rad] and motor speed [rad/s]."""
        return state[0] / self.ratio, state[1] / self.ratio

    def steady_torque(self, load_speed: float) -> float:
        """The motor torque that keeps a load speed [N m]."""
        return self.friction * load_speed / self.ratio


@dataclass(frozen=True)
class ElasticTransmission:
    """Motor and load joined by a spring and a damper (thesis 4.21 and 4.23, with d_l and without the factor r of 4.24).

        tau_m - tau_el = J_m thdd + d_m thd
        tau_el/r - d_l xd - F_c = M_l xdd
        tau_el = k_el (theta - x/r) + d_el (thd - xd/r)

    `motor_inertia` J_m [kg m2], `load_mass` M_l [kg], `ratio` r [m/rad], `stiffness` k_el [N m/rad] and `damping` d_el
    [N m s/rad] at the motor, `motor_friction` d_m [N m s/rad], `load_friction` d_l [N s/m]. Raises UsageError for
    values outside their range. Backlash is not included.
    """

    motor_inertia: float
    load_mass: float
    ratio: float
    stiffness: float
    damping: float = 0.0
    motor_friction: float = 0.0
    load_friction: float = 0.0

    def __post_init__(self) -> None:
        require_positive("motor inertia", self.motor_inertia, "kg m2")
        require_positive("load mass", self.load_mass, "kg")
        require_positive("ratio", self.ratio, "m/rad")
        require_positive("stiffness", self.stiffness, "N m/rad")
        require_not_negative("damping", self.damping, "N m s/rad")
        require_not_negative("motor friction", self.motor_friction, "N m s/rad")
        require_not_negative("load friction", self.load_friction, "N s/m")

    @property
    def rigid(self) -> RigidTransmission:
        """Return the drive without elasticity: J_t = J_m + M_l r^2, d_t = d_m + d_l r^2."""
        square = self.ratio**2
        return RigidTransmission(
            self.motor_inertia + self.load_mass * square, self.motor_friction + self.load_friction * square, self.ratio
        )

    @property
    def moving_mass(self) -> float:
        """The mass that hits the obstacle: the load's [kg]."""
        return self.load_mass

    @property
    def transmission_frequency(self) -> float:
        """w_a = sqrt(k_el/J_m): the motor oscillates while the load is at rest [rad/s] (4.35 corrected)."""
        return math.sqrt(self.stiffness / self.motor_inertia)

    @property
    def swing_period(self) -> float:
        """The period of motor relative to load, the fastest oscillation without contact [s]."""
        load = self.load_mass * self.ratio**2
        return 2.0 * math.pi / math.sqrt(self.stiffness * (1.0 / self.motor_inertia + 1.0 / load))

    def start(self, penetration: float, load_speed: float, motor_speed: float | None) -> list[float]:
        """Load, then motor on the load side, each position [m] and speed [m/s]; the load's friction winds it up."""
        wind_up = self.load_friction * load_speed * self.ratio**2 / self.stiffness
        motor = load_speed if motor_speed is None else motor_speed * self.ratio
        return [penetration, load_speed, penetration + wind_up, motor]

    def rates(self, state: Any, torque: Any, force: Any) -> list[Any]:
        """Rate of change of one or many states under a motor torque [N m] and a contact force [N]."""
        _, speed, _, motor = state[:4]
        drive = self.drive_force(state)
        load = (drive - self.load_friction * speed - force) / self.load_mass
        push = (torque - self.motor_friction * motor / self.ratio) / self.ratio
        return [speed, load, motor, (push - drive) * self.ratio**2 / self.motor_inertia]

    def drive_force(self, state: Any) -> Any:
        """tau_el/r: the force of the transmission on the load [N]."""
        return (self.stiffness * (state[2] - state[0]) + self.damping * (state[3] - state[1])) / self.ratio**2

    def motor(self, state: Any) -> tuple[Any, Any]:
        """Motor angle relative to the obstacle [rad] and motor speed [rad/s]."""
        return state[2] / self.ratio, state[3] / self.ratio

    def steady_torque(self, load_speed: float) -> float:
        """The motor torque that keeps a load speed [N m]."""
        return self.rigid.steady_torque(load_speed)


Transmission = RigidTransmission | ElasticTransmission
