"""The parameters of the model of one axis: masses, drive, friction, controller, sensors; on the load side, SI units."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields

from cdtool.base.errors import ConfigurationError


@dataclass(frozen=True, kw_only=True)
class ElasticDrive:
    """Masses and the elastic drive between them; a rotary axis has kg m2, N m/rad, N m s/rad and rad.

    With the wind-up d = x_motor - x_load the drive's force is k1 d + c1 d' up to the take-up travel g, and
    k1 g + k2 (d - g) + c2 d' above it; on the back flank nothing over the backlash b, then k2. It never pulls through
    its dead zone. A drive with one stiffness has an infinite take-up travel. `stiffness` infinite: a rigid
    drive, known to be one if it is `stated_rigid`.
    A front mass, part of `load_mass`, stands between the load and a contact; `front_stiffness` without a front mass is
    a spring in series with the obstacle.
    """

    motor_mass: float = 0.0
    load_mass: float
    stiffness: float = math.inf  # k1
    damping: float = 0.0  # c1
    take_up_travel: float = math.inf  # g
    end_stiffness: float = math.inf  # k2, above the take-up travel and on the back flank
    end_damping: float = 0.0  # c2
    backlash: float = 0.0  # b
    motor_friction: float = 0.0
    front_mass: float = 0.0
    front_stiffness: float = math.inf
    front_damping: float = 0.0
    observed_wind_up: float = 0.0  # the largest one at which the stiffness was identified; 0: not stated
    stated_rigid: bool = False

    def __post_init__(self) -> None:
        _check_not_negative("model.drive", self)
        if self.load_mass <= 0.0:
            raise ConfigurationError("model.drive: load_mass is not above 0", "give the load's mass or inertia")
        if not self.is_rigid and self.motor_mass <= 0.0:
            raise ConfigurationError("model.drive: an elastic drive without motor_mass", "give machine.motor_inertia")
        if self.stated_rigid and not self.is_rigid:
            raise ConfigurationError("model.drive: rigid = true contradicts stiffness", "remove one of the two")
        if self.front_mass >= self.load_mass:
            raise ConfigurationError("model.drive: front_mass is not below load_mass", "it is a part of the load")

    @property
    def is_rigid(self) -> bool:
        """Whether motor and load move as one."""
        return math.isinf(self.stiffness)

    @property
    def total_mass(self) -> float:
        """Return motor and load together."""
        return self.motor_mass + self.load_mass


@dataclass(frozen=True, kw_only=True)
class Friction:
    """Friction and constant force on the load: [Fc + (Fs - Fc) exp(-(v / vs)^2)] tanh(v / v0) + d v + offset.

    Fc by direction of travel; `static` Fs is at least the larger one, or 0 for a friction without Stribeck rise.
    """

    coulomb_forward: float = 0.0
    coulomb_backward: float = 0.0
    static: float = 0.0
    stribeck_speed: float = 0.02
    viscous: float = 0.0
    offset: float = 0.0
    smoothing_speed: float = 1e-3

    def __post_init__(self) -> None:
        for name in ("coulomb_forward", "coulomb_backward", "static", "viscous"):
            if not getattr(self, name) >= 0.0:
                raise ConfigurationError(f"model.friction: {name} is {getattr(self, name)}", "at least 0")
        if self.stribeck_speed <= 0.0 or self.smoothing_speed <= 0.0:
            raise ConfigurationError("model.friction: stribeck_speed and smoothing_speed must be above 0")


@dataclass(frozen=True, kw_only=True)
class Controller:
    """A P, PI or cascade controller, sampled once per `period` [s].

    The speed reference is the logged one plus `position_gain` (x_ref - x); its error e gives w = `speed_gain` e + I.
    The command moves towards w by at most `slew_limit` * period, is clipped to +-`force_limit` and then delayed by
    `delay`. I grows by (`integral_gain` e + `anti_windup_rate` (command - w)) * period. The measured speed is the
    position's difference, through two first-order low-passes at `speed_filter_hz`. The force follows the command with
    the time constant `force_lag`.
    """

    period: float
    speed_gain: float  # Kp [N s/m]
    integral_gain: float = 0.0  # Ki [N/m]
    position_gain: float = 0.0  # [1/s]
    anti_windup_rate: float = 0.0  # [1/s]
    slew_limit: float = math.inf  # [N/s]
    observed_slope: float = 0.0  # [N/s], the largest one of the command in the logs; 0: not stated
    force_limit: float = math.inf  # [N]
    speed_filter_hz: float = math.inf
    speed_filter_order: int = 2
    force_lag: float = 0.0  # [s]
    delay: float = 0.0  # [s]

    def __post_init__(self) -> None:
        _check_not_negative("model.controller", self)
        for name in ("period", "speed_gain"):
            if not 0.0 < getattr(self, name) < math.inf:
                raise ConfigurationError(f"model.controller: {name} is {getattr(self, name)}", "above 0 and finite")
        if self.speed_filter_order not in (0, 1, 2):
            raise ConfigurationError(f"model.controller: speed_filter_order is {self.speed_filter_order}", "0, 1 or 2")


@dataclass(frozen=True, kw_only=True)
class Sensors:
    """What the log's channels went through before they were written.

    The torque a first-order low-pass of `torque_filter_time` [s]; the accelerometer a second-order low-pass of
    `accelerometer_hz` and `accelerometer_damping` (0 Hz: not known); the speed channel is the controller's own
    measured speed, or with `speed_hz` the position's derivative through two first-order low-passes at that corner.
    """

    torque_filter_time: float = 0.0
    accelerometer_hz: float = 0.0
    accelerometer_damping: float = 0.8
    speed_hz: float = 0.0

    def __post_init__(self) -> None:
        _check_not_negative("model.sensors", self)


@dataclass(frozen=True, kw_only=True)
class AxisModel:
    """One axis in closed loop. Without a controller its drive force is what the log measured."""

    drive: ElasticDrive
    friction: Friction = field(default_factory=Friction)
    controller: Controller | None = None
    sensors: Sensors = field(default_factory=Sensors)


def _check_not_negative(section: str, values: ElasticDrive | Controller | Sensors) -> None:
    for item in fields(values):
        value = getattr(values, item.name)
        if not value >= 0.0:
            raise ConfigurationError(f"{section}: {item.name} is {value}", "at least 0")
