"""A simulated machine that has changed since its machine file was written: other friction, speed, mass, sensors, heat.

The position of an obstacle, the travel of a free stroke and the time that is logged after a contact stay as they were.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Annotated

from msgspec import Meta

from cdtool.base.settings import Positive, check, setting
from cdtool.commands.simulate.arm_model import ArmRun
from cdtool.commands.simulate.arm_parameters import ArmParameters, Array, Pair
from cdtool.commands.simulate.gate_model import GateParameters, GateRun

# The flux of neodymium magnets falls by this share per kelvin [1/K] (temperature coefficient of their remanence).
FLUX_PER_KELVIN = -1.1e-3


@dataclass(frozen=True)
class ChangedMachine:
    """What has changed, as factors of the unchanged machine or in units; the defaults are no change.

    Raises UsageError for a value outside its range.
    """

    friction: Annotated[Positive, setting("factor of the load's Coulomb, static and viscous friction")] = 1.0
    speed: Annotated[
        Positive, setting("factor of the nominal speed; the obstacle and the time after a contact stay")
    ] = 1.0
    mass: Annotated[
        Positive, setting("factor of the load's mass: of the leaf, or of both links with their inertias")
    ] = 1.0
    current_offset: Annotated[float, setting("added to the logged motor current, of every motor", unit="A")] = 0.0
    acceleration_offset: Annotated[float, setting("added to the accelerometers", unit="m/s2")] = 0.0
    warming: Annotated[
        float,
        Meta(gt=-300.0, lt=300.0),
        setting("of the motor: its magnets weaken by 0.11 %/K, the current for a torque rises", unit="K"),
    ] = 0.0

    def __post_init__(self) -> None:
        check(self)

    @property
    def current_factor(self) -> float:
        """Return the current for a torque, relative to that before the warming [-]."""
        return 1.0 / (1.0 + FLUX_PER_KELVIN * self.warming)

    def gate(self, new: GateParameters) -> GateParameters:
        """Return the gate that was `new`."""
        later = self._later(new.obstacle_position, new.nominal_speed, new.ramp_acceleration)
        travel = _travel(new.free_duration - new.start_time, new.nominal_speed, new.ramp_acceleration)
        free = self._later(travel, new.nominal_speed, new.ramp_acceleration)
        return replace(
            new,
            coulomb_friction=self.friction * new.coulomb_friction,
            static_friction=self.friction * new.static_friction,
            viscous_friction=self.friction * new.viscous_friction,
            nominal_speed=self.speed * new.nominal_speed,
            # The panel's vibration is proportional to the speed, not to its share of the nominal one.
            panel_acceleration=self.speed * new.panel_acceleration,
            leaf_mass=self.mass * new.leaf_mass,
            post_mass=self.mass * new.post_mass,
            accelerometer_bias=new.accelerometer_bias + self.acceleration_offset,
            free_duration=new.free_duration + free,
            impact_duration=new.impact_duration + later,
        )

    def arm(self, new: ArmParameters) -> ArmParameters:
        """Return the arm that was `new`."""
        speed, ramp = new.nominal_speed, new.ramp_acceleration
        touches = [angle - new.start_angle for angle in new.obstacle_angle]
        ends = [_travel(duration - new.start_time, speed, ramp) for duration in new.free_duration]
        return replace(
            new,
            coulomb_friction=_scaled(new.coulomb_friction, self.friction),
            static_friction=_scaled(new.static_friction, self.friction),
            viscous_friction=self.friction * new.viscous_friction,
            nominal_speed=self.speed * speed,
            vibration_acceleration=self.speed * new.vibration_acceleration,
            link_mass=_scaled(new.link_mass, self.mass),
            link_inertia=_scaled(new.link_inertia, self.mass),
            imu_bias=new.imu_bias + self.acceleration_offset,
            free_duration=self._all_later(new.free_duration, ends, speed, ramp),
            impact_duration=self._all_later(new.impact_duration, touches, speed, ramp),
        )

    def logged_gate(self, run: GateRun, torque_constant: float) -> GateRun:
        """Return a run whose motor torque is computed from the current as before; `torque_constant` [N m/A]."""
        reference = self.current_factor * run.reference_torque
        return replace(run, motor_torque=self._logged(run.motor_torque, torque_constant), reference_torque=reference)

    def logged_arm(self, run: ArmRun, torque_constant: float) -> ArmRun:
        """Return a run whose motor torques are computed from the currents as before; `torque_constant` [N m/A]."""
        return replace(run, motor_torque=self._logged(run.motor_torque, torque_constant))

    def _logged(self, torque: Array, torque_constant: float) -> Array:
        return self.current_factor * torque + torque_constant * self.current_offset

    def _all_later(self, durations: Pair, travels: list[float], speed: float, ramp: float) -> Pair:
        later = [duration + self._later(at, speed, ramp) for duration, at in zip(durations, travels, strict=True)]
        return later[0], later[1]

    def _later(self, travel: float, speed: float, ramp: float) -> float:
        """Return how much later [s] a position is reached at the changed speed; the ramp keeps its acceleration."""
        return _arrival(travel, self.speed * speed, ramp) - _arrival(travel, speed, ramp)


def _scaled(pair: Pair, factor: float) -> Pair:
    return factor * pair[0], factor * pair[1]


def _travel(time: float, speed: float, ramp: float) -> float:
    """Return how far a ramp to `speed` has come `time` [s] after its start."""
    ramping = min(time, speed / ramp)
    return 0.5 * ramp * ramping**2 + speed * (time - ramping)


def _arrival(travel: float, speed: float, ramp: float) -> float:
    """Return when a ramp to `speed` has come so far [s], after its start."""
    ramped = 0.5 * speed**2 / ramp
    return math.sqrt(2.0 * travel / ramp) if travel < ramped else speed / ramp + (travel - ramped) / speed
