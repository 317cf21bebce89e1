"""A contact of one axis as the difference of two simulations of its model, one with and one without the obstacle.

The obstacle stands where the model's own load is at the instant of contact: the model's load need not be where the
log's is. Both simulations follow the same references, so that they are equal up to that instant and their difference is
the effect of the contact alone; friction that the model does not know cancels to first order.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.base.errors import RecordingError
from cdtool.commands.inject.assumption import Assumption, ControllerReaction, DriveBeyond, SlewBeyond
from cdtool.commands.inject.channel_change import ChannelChange
from cdtool.commands.inject.injected_contact import Doubt, InjectedContact, Signals, injected_contact
from cdtool.machines.axis_model.axis_run import USED, AxisRun
from cdtool.machines.axis_model.obstacle import Obstacle
from cdtool.machines.axis_model.parameters import AxisModel, Controller
from cdtool.machines.axis_model.simulation import AxisInputs, AxisMotion, simulate_axis

# What is simulated before the contact where the axis is never at rest before it [s].
_LONGEST_APPROACH = 30.0
# A rest is at least as long as this [s].
_SHORTEST_REST = 0.2
# A controller without which the motor would not notice the contact: as stiff as the sampling permits.
_STIFF_SHARE = 0.2
# The speed is compared with the log's during the last time before the contact [s].
_COMPARED_TIME = 0.1
# It may differ by these shares: another speed is another force, and further off the model is not the log's.
_DOUBTFUL_DEVIATION, _LARGEST_DEVIATION = 0.05, 0.2
# Correlation of the measured torque and the model's during the approach below which one has the opposite sign.
_OPPOSITE = -0.3
# The brackets' controller has at most this period [s], whatever the log's: how it reacts must not depend on the log.
_LONGEST_PERIOD = 1e-3


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
    made = injected_contact(
        (model,),
        (_signals(free), _signals(hit)),
        ChannelChange(time, hit["contact_force"][:, np.newaxis], contact),
        approach,
        assumption,
    )
    return made.with_doubts({Doubt.APPROACH_SPEED: deviation > _DOUBTFUL_DEVIATION})


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
    last = (run.time > contact - _COMPARED_TIME) & (run.time <= contact)
    logged, clock = _speed(run), run.time
    simulated = np.interp(clock[last], time, free["motor_speed"])
    known = np.isfinite(logged[last])
    speed = float(np.mean(logged[last][known]))
    deviation = abs(float(np.mean(simulated[known])) - speed) / abs(speed) if speed else math.inf
    if deviation > _LARGEST_DEVIATION:
        raise RecordingError(
            f"{run.name}: before the contact at {contact:.3f} s the model moves at {float(np.mean(simulated)):.3g}, "
            f"the log at {speed:.3g} m/s or rad/s",
            "check masses, friction and [model.controller], or identify them",
        )
    approach = (clock >= time[0]) & (clock <= contact) & np.isfinite(run.torque)
    measured, force = run.torque[approach], np.interp(clock[approach], time, free["drive_force"])
    if len(measured) > 1 and np.std(measured) > 0.0 and np.std(force) > 0.0:
        correlation = float(np.corrcoef(measured, force)[0, 1])
        if correlation < _OPPOSITE:
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
    period = min(run.period, _LONGEST_PERIOD)
    gain = _STIFF_SHARE * model.drive.total_mass / period
    follows = Controller(
        period=period, speed_gain=gain, integral_gain=0.1 * gain / period * _STIFF_SHARE, speed_filter_order=0
    )
    return replace(model, controller=follows)


def _beginning(run: AxisRun, contact: float) -> float:
    """Return when the simulation begins [s]: in the last rest before the contact, or 30 s before it."""
    speed = _speed(run)
    moving = np.abs(np.nan_to_num(speed)) > 0.02 * float(np.nanmax(np.abs(speed)))
    return max(contact - _LONGEST_APPROACH, last_rest(run.time, (run.time <= contact) & ~moving, run.period), run.start)


def last_rest(time: FloatArray, resting: BoolArray, period: float) -> float:
    """Return when the last rest of 0.2 s or more has its last 0.2 s [s]; minus infinity without one.

    A shorter one may be noise, or the turning point of a stroke.
    """
    long = max(round(_SHORTEST_REST / period), 1)
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


def _signals(motion: AxisMotion) -> Signals:
    """Return what the sensors and the drive of the axis would log of a motion."""
    names = {"torque": "drive_force", "speed": "measured_speed", "position": "motor_position"}
    names |= {"acceleration": "load_acceleration", "reference_torque": "command", "wind_up": "wind_up"}
    return Signals(motion.period, {name: motion[row][:, np.newaxis] for name, row in names.items()})


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
