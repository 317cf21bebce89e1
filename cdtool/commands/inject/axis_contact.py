"""A contact of one axis as the difference of two simulations of its model, one with and one without the obstacle.

The obstacle stands where the model's own load is at the instant of contact: the model's load need not be where the
log's is. Both simulations follow the same references, so that they are equal up to that instant and their difference is
the effect of the contact alone; friction that the model does not know cancels to first order.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.base.errors import RecordingError
from cdtool.commands.inject.assumption import Assumption, ControllerReaction, DriveBeyond, SlewBeyond
from cdtool.commands.inject.channel_change import ChannelChange
from cdtool.machines.axis_model.axis_loop_kernel import ROWS
from cdtool.machines.axis_model.axis_run import USED, AxisRun
from cdtool.machines.axis_model.obstacle import Obstacle
from cdtool.machines.axis_model.parameters import AxisModel, Controller
from cdtool.machines.axis_model.sensor_filters import first_order_low_pass, second_order_low_pass
from cdtool.machines.axis_model.simulation import AxisInputs, AxisMotion, simulate_axis

# Time after contact [s] at which the model's own error begins to dominate the forces.
RELIABLE_FOR = 0.2
# A controller without which the motor would not notice the contact: as stiff as the sampling permits.
STIFF_SHARE = 0.2
# Further, or faster, than known: by more than the error of a simulation.
BEYOND = 1.05


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
            **doubts,
        }
        return replace(self, doubts=tuple(doubt for doubt in Doubt if known.get(doubt)))


def axis_contact(
    run: AxisRun,
    model: AxisModel,
    obstacle: Obstacle,
    contact: float,
    duration: float = 1.0,
    assumption: Assumption | None = None,
) -> InjectedContact:
    """Return the effect of an obstacle that is reached at the time `contact` [s], for `duration` [s] after it.

    `run` is the impact-free log on the load side. `assumption`: one of `assumptions_of(model)`; without a controller in
    the model, it must be a bracket.
    Raises RecordingError where the contact is outside the log or in a gap of it, where the axis is at rest then, where
    the model does not follow the log, or where the contact changes nothing in the model.
    """
    _require_samples(run, contact)
    assumption = assumption or Assumption()
    if _moves_backward(run, contact) and (assumption.drive is DriveBeyond.RIGID or _has_two_flanks(model)):
        # The curve of the drive is that of a contact: its take-up lies in the direction of motion.
        turned = axis_contact(_turned(run), _turned_model(model), obstacle, contact, duration, assumption)
        return _turned_contact(turned)
    model = assumption.model(_with_controller(model, run, assumption.controller))
    controller = model.controller
    assert controller is not None
    begin = _beginning(run, contact)
    count = math.ceil((min(contact + duration, float(run.time[-1])) - begin) / controller.period) + 2
    time: FloatArray = begin + controller.period * np.arange(count, dtype=np.float64)
    inputs = _inputs(run, model, time)
    free = simulate_axis(model, inputs)
    at = (contact - begin) / controller.period
    front, speed = free["front_position"], free["front_speed"]
    place = float(np.interp(at, np.arange(count), front))
    approach = float(np.interp(at, np.arange(count), speed))
    if abs(approach) < 1e-4 * float(np.max(np.abs(speed)) or 1.0):
        raise RecordingError(f"{run.name}: the axis is at rest at {contact:.3f} s", "choose a contact while it moves")
    deviation = _deviation_from(run, free, time, contact)
    placed = obstacle.at(place, 1 if approach > 0.0 else -1)
    frozen = assumption.controller is ControllerReaction.FROZEN
    against = replace(inputs, command=free["command"]) if frozen else inputs
    # A reciprocating axis may have been beyond that place before: the obstacle is put there for this contact.
    just_before = contact - begin - controller.period
    limited_from = -math.inf if assumption.slew is SlewBeyond.NO_LIMIT else just_before
    hit = simulate_axis(assumption.after_contact(model), against, placed, changes_at=(just_before, limited_from))
    return _difference(model, free, hit, time, (contact, approach, deviation), assumption)


def _require_samples(run: AxisRun, contact: float) -> None:
    """Raise RecordingError unless torque and motion are known just before the contact."""
    if not run.start <= contact <= run.time[-1]:
        raise RecordingError(
            f"{run.name}: the contact at {contact:.3f} s is outside the log",
            f"choose a time from {run.start:.3f} to {run.time[-1]:.3f} s",
        )
    channels = {name: getattr(run, name) for name in ("speed", "position")}
    moves = [name for name, values in channels.items() if values is not None and np.isfinite(values).any()]
    if not moves:
        raise RecordingError(f"{run.name}: speed and position have no value", "check [channels]")
    known = run.known("torque", moves[0])
    before = int((contact - run.start) / run.period)
    if not known[max(before - 1, 0) : before + 1].all():
        raise RecordingError(f"{run.name}: the log has a gap at {contact:.3f} s", "choose another position")


def _deviation_from(run: AxisRun, free: AxisMotion, time: FloatArray, contact: float) -> float:
    """Return by which share the model's speed before the contact differs from the log's.

    Raises RecordingError above 20 %, and where the torque has the opposite sign of the model's: such a model does not
    describe the log, and what a contact changes in it is not what it would change in the machine.
    """
    # The speed is compared with the log's during the last 0.1 s before the contact.
    last = (run.time > contact - 0.1) & (run.time <= contact)
    logged, clock = _speed(run), run.time
    simulated = np.interp(clock[last], time, free["motor_speed"])
    known = np.isfinite(logged[last])
    speed = float(np.mean(logged[last][known]))
    deviation = abs(float(np.mean(simulated[known])) - speed) / abs(speed) if speed else math.inf
    if deviation > 0.2:  # the model is not that of the log
        raise RecordingError(
            f"{run.name}: before the contact at {contact:.3f} s the model moves at {float(np.mean(simulated)):.3g}, "
            f"the log at {speed:.3g} m/s or rad/s",
            "check masses, friction and [model.controller], or identify them",
        )
    approach = (clock >= time[0]) & (clock <= contact) & np.isfinite(run.torque)
    measured, force = run.torque[approach], np.interp(clock[approach], time, free["drive_force"])
    if len(measured) > 1 and np.std(measured) > 0.0 and np.std(force) > 0.0:
        correlation = float(np.corrcoef(measured, force)[0, 1])
        if correlation < -0.3:  # the measured torque or the model's has the opposite sign
            raise RecordingError(
                f"{run.name}: the torque falls where the model's rises",
                "check the sign (scale) of torque in [channels]",
            )
    return deviation


def _with_controller(model: AxisModel, run: AxisRun, reaction: ControllerReaction) -> AxisModel:
    """Return a model that follows the log: with its own controller, or with a stiff one for the brackets."""
    if reaction is ControllerReaction.KNOWN:
        if model.controller is None:
            raise RecordingError(
                f"{run.name}: the model has no controller", "identify it, or use the brackets 'frozen' and 'stiff'"
            )
        return model
    # At most 1 ms, whatever the log's: how the brackets' controller reacts must not depend on the log.
    period = min(run.period, 1e-3)
    gain = STIFF_SHARE * model.drive.total_mass / period
    follows = Controller(
        period=period, speed_gain=gain, integral_gain=0.1 * gain / period * STIFF_SHARE, speed_filter_order=0
    )
    return replace(model, controller=follows)


def _beginning(run: AxisRun, contact: float) -> float:
    """Return when the simulation begins [s]: in the last rest before the contact, or 30 s before it."""
    speed = _speed(run)
    moving = np.abs(np.nan_to_num(speed)) > 0.02 * float(np.nanmax(np.abs(speed)))
    # Where the axis is never at rest before the contact, 30 s of its approach are simulated.
    return max(contact - 30.0, last_rest(run.time, (run.time <= contact) & ~moving, run.period), run.start)


def last_rest(time: FloatArray, resting: BoolArray, period: float) -> float:
    """Return when the last rest of 0.2 s or more has its last 0.2 s [s]; minus infinity without one.

    A shorter one may be noise, or the turning point of a stroke.
    """
    long = max(round(0.2 / period), 1)  # s
    sums = np.convolve(resting, np.ones(long), mode="valid") if len(resting) >= long else np.zeros(0)
    whole = np.flatnonzero(sums >= long - 0.5)
    return float(time[whole[-1]]) if len(whole) else -math.inf


def _speed(run: AxisRun) -> FloatArray:
    if run.speed is not None:
        return run.speed
    assert run.position is not None
    rate: FloatArray = np.gradient(run.position, run.period)
    return rate


def _inputs(run: AxisRun, model: AxisModel, time: FloatArray) -> AxisInputs:
    """Return the references on the clock of the controller; without a speed reference the measured speed is one."""
    assert model.controller is not None
    reference_position = None
    if model.controller.position_gain > 0.0:
        wanted = run.reference_position if run.reference_position is not None else run.position
        if wanted is None:
            raise RecordingError(
                f"{run.name}: no position for the controller's position loop", "map reference_position or position"
            )
        reference_position = _filled(run.time, wanted, time)
    if run.reference_speed is not None:
        reference = _filled(run.time, run.reference_speed, time)
    elif reference_position is not None and run.reference_position is not None:
        reference = np.zeros(len(time))  # the position reference alone
    else:
        reference = _filled(run.time, _speed(run), time)
    position = _filled(run.time, run.position, time[:1])[0] if run.position is not None else 0.0
    begins = _filled(run.time, _speed(run), time[:20])
    speed = float(np.mean(begins))
    at_rest = abs(speed) < 0.02 * float(np.nanmax(np.abs(_speed(run))))
    return AxisInputs(
        reference,
        reference_position=reference_position,
        initial_speed=0.0 if at_rest else speed,
        initial_position=float(position),
    )


def _filled(time: FloatArray, values: FloatArray, clock: FloatArray) -> FloatArray:
    known = np.isfinite(values)
    filled: FloatArray = np.interp(clock, time[known], values[known])
    return filled


def _difference(
    model: AxisModel,
    free: AxisMotion,
    hit: AxisMotion,
    time: FloatArray,
    contact: tuple[float, float, float],
    assumption: Assumption,
) -> InjectedContact:
    start, approach, deviation = contact
    change = hit.rows - free.rows
    rows = dict(zip(ROWS, change, strict=True))
    sensors, period = model.sensors, hit.period
    channels = {
        "torque": first_order_low_pass(rows["drive_force"], sensors.torque_filter_time, period),
        "speed": _measured_speed(model, rows, period),
        "position": rows["motor_position"],
        "reference_torque": rows["command"],
    }
    if sensors.accelerometer_hz > 0.0:
        channels["acceleration"] = second_order_low_pass(
            rows["load_acceleration"], sensors.accelerometer_hz, sensors.accelerometer_damping, period
        )
    held = {"reference_torque", "speed"} if sensors.speed_hz == 0.0 else {"reference_torque"}
    changes = {
        name: ChannelChange(time, values[:, np.newaxis], start, held=name in held) for name, values in channels.items()
    }
    force = ChannelChange(time, hit["contact_force"][:, np.newaxis], start)
    wind_ups = (float(np.max(np.abs(free["wind_up"]))), float(np.max(np.abs(hit["wind_up"]))))
    made = InjectedContact.of(changes, force, approach, wind_ups, assumption)
    reliable = time <= made.reliable_until
    doubts = {
        Doubt.RIGID_DRIVE: model.drive.is_rigid,
        Doubt.WIND_UP_BEYOND_FREE_RUNS: _winds_up_beyond(model, free, hit, reliable),
        Doubt.SLOPE_BEYOND_FREE_RUNS: assumption.slew is SlewBeyond.NO_LIMIT
        and _rises_beyond(model, hit, reliable & (time >= start)),
        Doubt.APPROACH_SPEED: deviation > 0.05,  # a contact at another speed has another force
        Doubt.ACCELEROMETER_UNKNOWN: sensors.accelerometer_hz == 0.0,
    }
    return made.with_doubts(doubts)


def _winds_up_beyond(model: AxisModel, free: AxisMotion, hit: AxisMotion, reliable: BoolArray) -> bool:
    """Whether the contact winds the drive up by 5 % more than its stiffness is known for."""
    if model.drive.is_rigid:
        return False
    known = max(float(np.max(np.abs(free["wind_up"]))), model.drive.observed_wind_up)
    return float(np.max(np.abs(hit["wind_up"][reliable]))) > BEYOND * known


def _rises_beyond(model: AxisModel, hit: AxisMotion, reliable: BoolArray) -> bool:
    """Whether a command without a known slew limit rises by 5 % faster than it was observed to."""
    controller = model.controller
    if controller is None or math.isfinite(controller.slew_limit) or controller.observed_slope == 0.0:
        return False
    slope = np.abs(np.diff(hit["command"], prepend=hit["command"][0])) / hit.period
    return float(np.max(slope[reliable])) > BEYOND * controller.observed_slope


def _moves_backward(run: AxisRun, contact: float) -> bool:
    speed = _filled(run.time, _speed(run), np.array([contact]))
    return bool(speed[0] < 0.0)


def _has_two_flanks(model: AxisModel) -> bool:
    """Whether the drive has another stiffness in one direction than in the other."""
    drive = model.drive
    return math.isfinite(drive.take_up_travel) or math.isfinite(drive.end_stiffness) or drive.backlash > 0.0


def _turned(run: AxisRun) -> AxisRun:
    """Return the run of the same axis with its positive direction reversed."""
    values = {name: getattr(run, name) for name in USED}
    return replace(run, **{name: -item for name, item in values.items() if item is not None})


def _turned_model(model: AxisModel) -> AxisModel:
    friction = replace(
        model.friction,
        coulomb_forward=model.friction.coulomb_backward,
        coulomb_backward=model.friction.coulomb_forward,
        offset=-model.friction.offset,
    )
    return replace(model, friction=friction)


def _turned_contact(contact: InjectedContact) -> InjectedContact:
    changes = {name: replace(change, values=-change.values) for name, change in contact.changes.items()}
    return replace(contact, changes=changes, speed=-contact.speed)


def _measured_speed(model: AxisModel, rows: Mapping[str, FloatArray], period: float) -> FloatArray:
    """Return the change of the speed channel: the controller's own, or the log's derivative of the position."""
    corner = model.sensors.speed_hz
    if corner == 0.0:
        return rows["measured_speed"]
    constant = 1.0 / (2.0 * math.pi * corner)
    steps = np.diff(rows["motor_position"], prepend=0.0) / period
    return first_order_low_pass(first_order_low_pass(steps, constant, period), constant, period)


def separation_time(time: FloatArray, force: FloatArray) -> float:
    """Return when the force first falls to nothing after the contact [s]; infinite if it does not."""
    peak = np.maximum.accumulate(force)
    # The load has lost the contact when the force is below 0.1 % of the peak so far.
    lost = (peak > 0.0) & (force <= 1e-3 * peak)
    return float(time[np.argmax(lost)]) if lost.any() else math.inf
