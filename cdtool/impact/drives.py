"""What turns the motor: a constant torque, or a speed controller with an actuator that lags."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from cdtool.impact.checks import require_not_negative, require_positive


@dataclass(frozen=True)
class ConstantTorque:
    """tau_m is given [N m], as in the example of the thesis (Table 4.1)."""

    torque: float

    def start(self, _steady_torque: float) -> list[float]:
        """No state of its own."""
        return []

    def torque_of(self, _state: Sequence[float]) -> float:
        """The motor torque [N m]."""
        return self.torque

    def rates(self, _state: Sequence[float], _motor_speed: float) -> list[float]:
        """Nothing that changes."""
        return []


@dataclass(frozen=True)
class SpeedController:
    """u = K_P e + K_I int(e), e = reference - thd; tau_a dtau_m/dt = mu_a u - tau_m (thesis 4.37, 4.38 corrected: PI).

    `reference` [rad/s] is the motor's, `proportional` K_P [N m s/rad], `integral` K_I [N m/rad], `actuator_time` tau_a
    [s], `actuator_gain` mu_a. `slew_limit` [N m/s] bounds the slope of the torque, as drives with a jerk limit do; the
    transfer functions leave it out. Raises UsageError for values without meaning.
    """

    reference: float
    proportional: float
    integral: float
    actuator_time: float = 0.002
    actuator_gain: float = 1.0
    slew_limit: float = float("inf")

    def __post_init__(self) -> None:
        require_positive("proportional gain", self.proportional, "N m s/rad")
        require_positive("actuator time", self.actuator_time, "s")
        require_positive("actuator gain", self.actuator_gain)
        require_not_negative("integral gain", self.integral, "N m/rad")
        if self.slew_limit != float("inf"):
            require_positive("slew limit", self.slew_limit, "N m/s")

    def start(self, steady_torque: float) -> list[float]:
        """The integrator's share [N m] and the torque [N m] of a steady motion at the reference."""
        return [steady_torque / self.actuator_gain, steady_torque]

    def torque_of(self, state: Sequence[float]) -> float:
        """The motor torque [N m]."""
        return state[-1]

    def rates(self, state: Sequence[float], motor_speed: float) -> list[float]:
        """Derivatives of the integrator's share and of the torque."""
        error = self.reference - motor_speed
        control = self.proportional * error + state[-2]
        slope = (self.actuator_gain * control - state[-1]) / self.actuator_time
        return [self.integral * error, min(max(slope, -self.slew_limit), self.slew_limit)]


Drive = ConstantTorque | SpeedController
