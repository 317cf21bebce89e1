"""What turns the motor: a constant torque, or a speed controller with an actuator that lags."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from cdtool.base.errors import UsageError
from cdtool.impact.checks import require_not_negative, require_positive
from cdtool.impact.transmissions.transfer import Transfer


@dataclass(frozen=True)
class ConstantTorque:
    """tau_m is given [N m], as in the example of the thesis (Table 4.1)."""

    torque: float

    def start(self, _steady_torque: float) -> list[float]:
        """No state of its own."""
        return []

    def torque_of(self, _state: Any) -> Any:
        """The motor torque [N m]; of many states at once, too."""
        return self.torque

    def rates(self, _state: Sequence[float], _motor_speed: float) -> list[float]:
        """Nothing that changes."""
        return []


@dataclass(frozen=True)
class SpeedController:
    """R = K_P + K_I/s + K_D s/(T_f s + 1), e = reference - thd; A = mu_a/(tau_a s + 1) (thesis 4.38 corrected, 4.37).

    `reference` [rad/s] is the motor's, `proportional` K_P [N m s/rad], `integral` K_I [N m/rad], `derivative` K_D
    [N m s2/rad] with its low-pass `derivative_time` T_f [s] (the printed K_D s alone is not proper), `actuator_time`
    tau_a [s], `actuator_gain` mu_a. `slew_limit` [N m/s] bounds the slope of the torque, as drives with a jerk limit
    do; `torque_limit` [N m] bounds the torque that is asked for, and the integral part stands while it does. The
    transfer functions leave both out. Raises UsageError for values without meaning.
    """

    reference: float
    proportional: float
    integral: float
    actuator_time: float = 0.002
    actuator_gain: float = 1.0
    slew_limit: float = math.inf
    derivative: float = 0.0
    derivative_time: float = 0.002
    torque_limit: float = math.inf

    def __post_init__(self) -> None:
        require_positive("proportional gain", self.proportional, "N m s/rad")
        require_positive("actuator time", self.actuator_time, "s")
        require_positive("actuator gain", self.actuator_gain)
        require_positive("derivative time", self.derivative_time, "s")
        require_not_negative("integral gain", self.integral, "N m/rad")
        require_not_negative("derivative gain", self.derivative, "N m s2/rad")
        for name, value, unit in (("slew limit", self.slew_limit, "N m/s"), ("torque limit", self.torque_limit, "N m")):
            if value != math.inf:
                require_positive(name, value, unit)

    @property
    def regulator(self) -> Transfer:
        """R: control action by speed error [N m s/rad]; a PI regulator where K_D is 0, without a pole where K_I is."""
        lag = self.derivative_time if self.derivative else 0.0
        numerator = (self.proportional * lag + self.derivative, self.proportional + self.integral * lag, self.integral)
        return Transfer(numerator, (lag, 1.0, 0.0), "N m s/rad").reduced

    @property
    def actuator(self) -> Transfer:
        """A: motor torque by control action."""
        return Transfer((self.actuator_gain,), (self.actuator_time, 1.0), "1")

    def start(self, steady_torque: float) -> list[float]:
        """The integrator's share [N m], the low-passed error [rad/s] and the torque [N m] of a steady motion.

        Raises UsageError where the torque limit is less than that motion takes.
        """
        if abs(steady_torque) > self.torque_limit:
            raise UsageError(
                f"the torque limit is {self.torque_limit:.4g} N m, steady motion takes {steady_torque:.4g} N m",
                "a larger limit, or less friction or speed",
            )
        return [steady_torque / self.actuator_gain, 0.0, steady_torque]

    def torque_of(self, state: Any) -> Any:
        """The motor torque [N m]; of many states at once, too."""
        return state[-1]

    def rates(self, state: Sequence[float], motor_speed: float) -> list[float]:
        """Derivatives of the integrator's share, of the low-passed error and of the torque."""
        error = self.reference - motor_speed
        rising = (error - state[-2]) / self.derivative_time
        wanted = self.actuator_gain * (self.proportional * error + self.derivative * rising + state[-3])
        asked = min(max(wanted, -self.torque_limit), self.torque_limit)
        slope = (asked - state[-1]) / self.actuator_time
        winds_up = asked != wanted and wanted * error > 0.0
        slope = min(max(slope, -self.slew_limit), self.slew_limit)
        return [0.0 if winds_up else self.integral * error, rising, slope]


Drive = ConstantTorque | SpeedController
