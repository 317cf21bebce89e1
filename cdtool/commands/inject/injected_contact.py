"""A contact as the difference of two simulations, of an axis or of all joints of a robot, and what limits it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.base.errors import RecordingError
from cdtool.commands.inject.assumption import Assumption, ControllerReaction, SlewBeyond
from cdtool.commands.inject.channel_change import ChannelChange
from cdtool.machines.axis_model.parameters import AxisModel
from cdtool.machines.axis_model.sensor_filters import first_order_low_pass, second_order_low_pass

# Time after contact [s] at which the model's own error begins to dominate the forces.
RELIABLE_FOR = 0.2
# Further, or faster, than known: by more than the error of a simulation.
_BEYOND = 1.05
# The load has lost the contact when the force is below this share of the peak so far.
_SEPARATED = 1e-3


class Doubt(Enum):
    """What limits an injected contact."""

    RIGID_DRIVE = "the drive is modelled as rigid"
    WIND_UP_BEYOND_FREE_RUNS = "the drive winds up further than in impact-free logs"
    SLOPE_BEYOND_FREE_RUNS = "the command rises faster than in impact-free logs, and its limit is not known"
    SEPARATION = "the load separates from the obstacle"
    CONTROLLER_UNKNOWN = "the reaction of the controller is an assumption"
    APPROACH_SPEED = "before the contact the model's speed differs from the log's by more than 5 %"
    ACCELEROMETER_UNKNOWN = "the bandwidth of the accelerometer is not known"


@dataclass(frozen=True, eq=False)
class InjectedContact:
    """A contact of one joint: what it adds to each channel, and what its truth is; times in s on the recording's clock.

    `force` is what the machine exerts on the obstacle [N], `reliable_until` when the model's error takes over: 0.2 s
    after contact, or at the separation. `free_wind_up` and `wind_up`: the largest ones of the drive [m].
    """

    start: float
    changes: Mapping[str, ChannelChange]
    force: ChannelChange
    peak_force: float
    speed: float
    reliable_until: float
    separation: float
    free_wind_up: float
    wind_up: float
    assumption: Assumption
    doubts: tuple[Doubt, ...] = ()

    @classmethod
    def of(
        cls,
        changes: Mapping[str, ChannelChange],
        force: ChannelChange,
        speed: float,
        wind_ups: tuple[float, float],
        assumption: Assumption,
    ) -> InjectedContact:
        """Return the contact of the greatest `wind_ups`, free and hit; raises RecordingError if it changes nothing."""
        start = force.start
        if not np.any(force.values) or (changes["torque"].is_nothing and changes["speed"].is_nothing):
            raise RecordingError(
                f"the contact at {start:.3f} s changes nothing in the model", "its obstacle or its drive never acts"
            )
        separation = separation_time(force.time, force.values[:, 0])
        until = min(start + RELIABLE_FOR, separation)
        peak = float(np.max(force.values))
        return cls(start, changes, force, peak, speed, until, separation, *wind_ups, assumption)

    def with_doubts(self, doubts: Mapping[Doubt, bool]) -> InjectedContact:
        """Return the contact with these doubts as far as they apply, and those that every machine may have."""
        known = {
            Doubt.SEPARATION: self.separation < self.start + RELIABLE_FOR,
            Doubt.CONTROLLER_UNKNOWN: self.assumption.controller is not ControllerReaction.KNOWN,
            **dict.fromkeys(self.doubts, True),
            **doubts,
        }
        return replace(self, doubts=tuple(doubt for doubt in Doubt if known.get(doubt)))


@dataclass(frozen=True)
class Signals:
    """What a simulated motion would log without its sensors' filters, and the wind-up of the drives: (n, J) by name."""

    period: float
    values: Mapping[str, FloatArray]

    def __getitem__(self, name: str) -> FloatArray:
        return self.values[name]


def injected_contact(
    axes: Sequence[AxisModel],
    motions: tuple[Signals, Signals],
    force: ChannelChange,
    approach: float,
    assumption: Assumption,
) -> InjectedContact:
    """Return the contact by which the second of two motions differs from the first, with its doubts.

    `axes` are the models of the joints, `approach` is the speed [m/s or rad/s] at which the obstacle is met. Raises
    RecordingError if the contact changes nothing.
    """
    free, hit = motions
    change = {name: hit[name] - free[name] for name in hit.values if name != "wind_up"}
    change["torque"] = _columns(
        first_order_low_pass(column, axis.sensors.torque_filter_time, hit.period)
        for axis, column in zip(axes, change["torque"].T, strict=True)
    )
    change["speed"] = _measured_speed(axes, change, hit.period)
    knows_accelerometer = all(axis.sensors.accelerometer_hz > 0.0 for axis in axes)
    sensed = change.pop("acceleration")
    if knows_accelerometer:
        change["acceleration"] = _columns(
            second_order_low_pass(column, axis.sensors.accelerometer_hz, axis.sensors.accelerometer_damping, hit.period)
            for axis, column in zip(axes, sensed.T, strict=True)
        )
    held = {"reference_torque"} | ({"speed"} if all(axis.sensors.speed_hz == 0.0 for axis in axes) else set())
    changes = {
        name: ChannelChange(force.time, values, force.start, held=name in held) for name, values in change.items()
    }
    wind_ups = (float(np.max(np.abs(free["wind_up"]))), float(np.max(np.abs(hit["wind_up"]))))
    made = InjectedContact.of(changes, force, approach, wind_ups, assumption)
    reliable = force.time <= made.reliable_until
    is_limited = assumption.slew is not SlewBeyond.NO_LIMIT
    doubts = {
        Doubt.RIGID_DRIVE: any(axis.drive.is_rigid for axis in axes),
        Doubt.WIND_UP_BEYOND_FREE_RUNS: _winds_up_beyond(axes, motions, reliable),
        Doubt.SLOPE_BEYOND_FREE_RUNS: not is_limited
        and _rises_beyond(axes, hit, reliable & (force.time >= force.start)),
        Doubt.ACCELEROMETER_UNKNOWN: not knows_accelerometer,
    }
    return made.with_doubts(doubts)


def _columns(columns: Iterable[FloatArray]) -> FloatArray:
    return np.column_stack(list(columns))


def _measured_speed(axes: Sequence[AxisModel], change: Mapping[str, FloatArray], period: float) -> FloatArray:
    """Return the change of the speed channel: the controller's own, or the log's derivative of the position."""
    speed = change["speed"].copy()
    for joint, axis in enumerate(axes):
        if axis.sensors.speed_hz > 0.0:
            constant = 1.0 / (2.0 * math.pi * axis.sensors.speed_hz)
            steps = np.diff(change["position"][:, joint], prepend=0.0) / period
            once = first_order_low_pass(steps, constant, period)
            speed[:, joint] = first_order_low_pass(once, constant, period)
    return speed


def _winds_up_beyond(axes: Sequence[AxisModel], motions: tuple[Signals, Signals], reliable: BoolArray) -> bool:
    """Whether the contact winds a drive up by 5 % more than its stiffness is known for."""
    free, hit = (np.abs(motion["wind_up"]) for motion in motions)
    elastic = np.array([not axis.drive.is_rigid for axis in axes])
    known = np.maximum(np.max(free, axis=0), [axis.drive.observed_wind_up for axis in axes])
    return bool(np.any(elastic & (np.max(hit[reliable], axis=0) > _BEYOND * known)))


def _rises_beyond(axes: Sequence[AxisModel], hit: Signals, reliable: BoolArray) -> bool:
    """Whether a command without a known slew limit rises by 5 % faster than it was observed to."""
    command = hit["reference_torque"]
    slope = np.max(np.abs(np.diff(command, axis=0, prepend=command[:1]))[reliable], axis=0) / hit.period
    controllers = [axis.controller for axis in axes]
    return any(
        controller is not None and math.isinf(controller.slew_limit) and 0.0 < _BEYOND * controller.observed_slope < own
        for controller, own in zip(controllers, slope, strict=True)
    )


def separation_time(time: FloatArray, force: FloatArray) -> float:
    """Return when the force first falls to nothing after the contact [s]; infinite if it does not."""
    peak = np.maximum.accumulate(force)
    lost = (peak > 0.0) & (force <= _SEPARATED * peak)
    return float(time[np.argmax(lost)]) if lost.any() else math.inf
