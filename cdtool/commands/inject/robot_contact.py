"""A contact of a point of a robot's link, as the difference of two simulations with and without the obstacle.

The obstacle is a plane that the point moves into. It stands where the model's own point is at the instant of contact,
so that both simulations are equal up to that instant; tau_c = J' F loads all joints (thesis 2.5). As for an axis, see
`axis_contact`: both follow the references of the log, and what they differ by is the effect of the contact.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.base.errors import RecordingError
from cdtool.commands.inject.assumption import Assumption, ControllerReaction, assumptions_of
from cdtool.commands.inject.axis_contact import BEYOND, STIFF_SHARE, Doubt, InjectedContact, last_rest
from cdtool.commands.inject.channel_change import ChannelChange
from cdtool.machines.axis_model.axis_run import AxisRun
from cdtool.machines.axis_model.obstacle import Obstacle
from cdtool.machines.axis_model.parameters import AxisModel, Controller
from cdtool.machines.axis_model.sensor_filters import first_order_low_pass, second_order_low_pass
from cdtool.machines.robot_model.parameters import RobotModel, Vector, point_in_joint
from cdtool.machines.robot_model.simulation import PointContact, RobotInputs, RobotMotion, simulate_robot

# A joint below this share of its own greatest speed is at rest.
_AT_REST = 0.02


@dataclass(frozen=True)
class StruckPoint:
    """The point that meets the obstacle: `link` by name or by the index of its joint, `point` in its frame [m].

    `direction`: normal of the obstacle's plane in the axes of the base; None: the direction in which the point moves at
    the instant of contact. The obstacle is on the side to which the point moves, whatever the direction's sign.
    """

    link: str | int
    point: Vector = (0.0, 0.0, 0.0)
    direction: Vector | None = None


@dataclass(frozen=True, eq=False)
class RobotLog:
    """The channels of all joints on one clock, as `axis_run` returns them, with the unit of the logged acceleration."""

    axes: tuple[AxisRun, ...]
    acceleration_unit: str = ""

    def __post_init__(self) -> None:
        if any(axis.position is None for axis in self.axes):
            raise RecordingError(
                f"{self.name}: no position", "the inertia of a robot depends on its pose: map position in [channels]"
            )

    @property
    def name(self) -> str:
        """Return the name of the log."""
        return self.axes[0].name

    @property
    def start(self) -> float:
        """Return the time of the first sample [s]."""
        return self.axes[0].start

    @property
    def period(self) -> float:
        """Return the period of the samples [s]."""
        return self.axes[0].period

    @property
    def time(self) -> FloatArray:
        """Return the times of the samples (n,) [s]."""
        return self.axes[0].time

    def at(self, channel: str, clock: FloatArray) -> FloatArray | None:
        """Return a channel (m, J) at other times, linear between its samples and over gaps; None if it is not logged.

        A joint without any sample stands still.
        """
        columns = []
        for axis in self.axes:
            values = getattr(axis, channel)
            if values is None:
                return None
            known = np.isfinite(values)
            columns.append(np.interp(clock, self.time[known], values[known]) if known.any() else np.zeros(len(clock)))
        return np.column_stack(columns)

    def speed(self) -> FloatArray:
        """Return the joints' mean speeds over 20 ms (n, J), of the positions if no speed is logged."""
        speed = self.at("speed", self.time)
        if speed is None:
            position = self.at("position", self.time)
            assert position is not None
            speed = np.asarray(np.gradient(position, self.period, axis=0))
        width = min(max(round(0.02 / self.period), 1), len(speed))  # s
        mean = np.ones(width) / width
        return np.column_stack([np.convolve(column, mean, mode="same") for column in speed.T])


def robot_contact(
    log: RobotLog,
    model: RobotModel,
    struck: StruckPoint,
    obstacle: Obstacle,
    contact: float,
    duration: float = 1.0,
    assumption: Assumption | None = None,
) -> InjectedContact:
    """Return the effect of an obstacle that a point reaches at the time `contact` [s], for `duration` [s] after it.

    The changes have a column per joint. `assumption`: one of `assumptions_of(least_known_joint(model))`; without
    controllers in the model it must be a bracket. Raises RecordingError where the contact is outside the log, the point
    stands still or moves along the obstacle then, or where the contact changes nothing in the model.
    """
    if not log.start <= contact <= log.time[-1]:
        raise RecordingError(
            f"{log.name}: the contact at {contact:.3f} s is outside the log",
            f"choose a time from {log.start:.3f} to {log.time[-1]:.3f} s",
        )
    assumption = assumption or Assumption()
    begin = _beginning(log, contact)
    model = _assumed(_with_controllers(model, log, assumption.controller), assumption)
    period = _controllers(model)[0].period
    count = math.ceil((min(contact + duration, float(log.time[-1])) - begin) / period) + 2
    time: FloatArray = begin + period * np.arange(count, dtype=np.float64)
    inputs = _inputs(log, time)
    free = simulate_robot(model, inputs)
    met, approach = _meeting(log, model, free, struck, (contact - begin) / period)
    placed = replace(met, obstacle=replace(obstacle, position=met.obstacle.position))
    frozen = assumption.controller is ControllerReaction.FROZEN
    against = replace(inputs, command=free["command"]) if frozen else inputs
    hit = simulate_robot(model, against, placed)
    return _difference(model, (free, hit), time, (contact, approach), assumption, log.acceleration_unit)


def least_known_joint(model: RobotModel) -> AxisModel:
    """Return the joint about whose drive, sensors and controller least is known: it decides what can be tested."""

    def known(axis: AxisModel) -> tuple[bool, bool, bool, int]:
        has_drive = not axis.drive.is_rigid or axis.drive.stated_rigid
        has_sensor = axis.sensors.accelerometer_hz > 0.0
        return has_drive, has_sensor, axis.controller is not None, -len(assumptions_of(axis))

    return min(model.axes, key=known)


def _controllers(model: RobotModel) -> list[Controller]:
    return [axis.controller for axis in model.axes if axis.controller is not None]


def _with_controllers(model: RobotModel, log: RobotLog, reaction: ControllerReaction) -> RobotModel:
    """Return a model that follows the log: with its own controllers, or with stiff ones for the brackets."""
    if reaction is ControllerReaction.KNOWN:
        if len(_controllers(model)) < len(model.axes):
            raise RecordingError(
                f"{log.name}: the model has no controller", "identify it, or use the brackets 'frozen' and 'stiff'"
            )
        return model
    period = log.period / max(math.ceil(log.period / 1e-3 - 1e-6), 1)  # at most 1 ms, as that of an axis
    gain = STIFF_SHARE / period
    follows = Controller(period=period, speed_gain=gain, integral_gain=0.1 * gain**2, speed_filter_order=0)
    axes = tuple(replace(axis, controller=follows) for axis in model.axes)
    return replace(model, axes=axes, gains_of_inertia=True)


def _assumed(model: RobotModel, assumption: Assumption) -> RobotModel:
    """Return the model under an assumption, at each joint only where it leaves that open."""
    axes = []
    for axis in model.axes:
        own = [item for item in assumptions_of(axis) if item.drive is assumption.drive]
        if own and assumption.drive is not Assumption().drive:
            axis = replace(axis, drive=Assumption(drive=assumption.drive).model(axis).drive)
        own = [item for item in assumptions_of(axis) if item.slew is assumption.slew]
        if own and assumption.slew is not Assumption().slew:
            axis = Assumption(slew=assumption.slew).after_contact(axis)
        axes.append(axis)
    return replace(model, axes=tuple(axes))


def _beginning(log: RobotLog, contact: float) -> float:
    """Return when the simulation begins [s]: in the last rest of all joints before the contact, or 5 s before it."""
    speed = np.abs(log.speed())
    moving = np.any(speed > _AT_REST * np.max(speed, axis=0, initial=0.0), axis=1)
    # Where the robot is never at rest before the contact, 5 s of its approach are simulated.
    return max(contact - 5.0, last_rest(log.time, (log.time <= contact) & ~moving, log.period), log.start)


def _inputs(log: RobotLog, time: FloatArray) -> RobotInputs:
    """Return the references on the clock of the controllers; what is not logged is the measured motion."""
    position = log.at("position", time)
    assert position is not None
    speeds = log.speed()
    wanted = log.at("reference_position", time)
    reference = log.at("reference_speed", time)
    measured = np.column_stack([np.interp(time, log.time, column) for column in speeds.T])
    if reference is None:
        reference = measured if wanted is None else np.asarray(np.gradient(wanted, time[1] - time[0], axis=0))
    at_rest = np.abs(measured[0]) < _AT_REST * np.max(np.abs(speeds), axis=0)
    return RobotInputs(
        reference_speed=reference,
        reference_position=position if wanted is None else wanted,
        initial_position=position[0].copy(),
        initial_speed=np.where(at_rest, 0.0, measured[0]),
    )


def _meeting(
    log: RobotLog, model: RobotModel, free: RobotMotion, struck: StruckPoint, sample: float
) -> tuple[PointContact, float]:
    """Return the plane that the model's own point meets at a (fractional) sample, and the speed towards it [m/s]."""
    link = model.link(struck.link)
    point = point_in_joint(link, struck.point)
    positions, speeds = free["link_position"], free["link_speed"]
    clock = np.arange(len(positions), dtype=np.float64)
    position, speed = (
        np.array([np.interp(sample, clock, column) for column in values.T]) for values in (positions, speeds)
    )
    velocity = _velocity(model, link.joint, point, position, speed)
    own = float(np.linalg.norm(velocity))
    shown = range(0, len(positions), max(len(positions) // 100, 1))
    fastest = max(
        float(np.linalg.norm(_velocity(model, link.joint, point, positions[index], speeds[index]))) for index in shown
    )
    if own <= 1e-3 * fastest or own == 0.0:  # the point does not move
        raise RecordingError(
            f"{log.name}: the point of link '{link.name}' is at rest at the contact",
            "choose a contact while it moves",
        )
    normal = velocity / own
    if struck.direction is not None:
        given = np.array(struck.direction) / np.linalg.norm(struck.direction)
        towards = float(given @ velocity)
        if abs(towards) < 0.02 * own:  # a point that moves along a plane does not meet it
            raise RecordingError(
                f"{log.name}: the point of link '{link.name}' moves along the obstacle at the contact",
                "choose another direction",
            )
        normal = math.copysign(1.0, towards) * given
    direction = (float(normal[0]), float(normal[1]), float(normal[2]))
    place, _ = model.point_along(position, link.joint, point, direction)
    plane = Obstacle.spring(1.0).at(place, 1)
    return PointContact(link.joint, point, direction, plane, math.floor(sample)), float(normal @ velocity)


def _velocity(model: RobotModel, joint: int, point: Vector, position: FloatArray, speed: FloatArray) -> FloatArray:
    """Return the velocity (3,) of a point in base axes [m/s]."""
    axes: tuple[Vector, ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    return np.array([float(model.point_along(position, joint, point, axis)[1] @ speed) for axis in axes])


def _difference(
    model: RobotModel,
    motions: tuple[RobotMotion, RobotMotion],
    time: FloatArray,
    contact: tuple[float, float],
    assumption: Assumption,
    acceleration_unit: str,
) -> InjectedContact:
    free, hit = motions
    start, approach = contact
    period = hit.period
    torque, command = hit["drive_torque"] - free["drive_torque"], hit["command"] - free["command"]
    channels = {
        "torque": _filtered(model, torque, period, "torque"),
        "speed": _measured_speed(model, motions),
        "position": hit["motor_position"] - free["motor_position"],
        "reference_torque": command,
    }
    knows_accelerometer = all(axis.sensors.accelerometer_hz > 0.0 for axis in model.axes)
    if knows_accelerometer:
        sensed = _sensed(model, hit, acceleration_unit) - _sensed(model, free, acceleration_unit)
        channels["acceleration"] = _filtered(model, sensed, period, "acceleration")
    held = {"reference_torque"}
    if all(axis.sensors.speed_hz == 0.0 for axis in model.axes):
        held.add("speed")
    changes = {name: ChannelChange(time, values, start, held=name in held) for name, values in channels.items()}
    force = ChannelChange(time, hit.contact_force[:, np.newaxis], start)
    wind_ups = (float(np.max(np.abs(free["wind_up"]))), float(np.max(np.abs(hit["wind_up"]))))
    made = InjectedContact.of(changes, force, approach, wind_ups, assumption)
    reliable = time <= made.reliable_until
    doubts = {
        Doubt.RIGID_DRIVE: model.is_rigid,
        Doubt.WIND_UP_BEYOND_FREE_RUNS: _winds_up_beyond(model, motions, reliable),
        Doubt.SLOPE_BEYOND_FREE_RUNS: _rises_beyond(model, hit, reliable),
        Doubt.ACCELEROMETER_UNKNOWN: not knows_accelerometer,
    }
    return made.with_doubts(doubts)


def _filtered(model: RobotModel, change: FloatArray, period: float, channel: str) -> FloatArray:
    """Return a change (n, J) as the sensors of its channel show it."""
    columns = []
    for axis, column in zip(model.axes, change.T, strict=True):
        sensors = axis.sensors
        if channel == "torque":
            columns.append(first_order_low_pass(column, sensors.torque_filter_time, period))
        else:
            damping = sensors.accelerometer_damping
            columns.append(second_order_low_pass(column, sensors.accelerometer_hz, damping, period))
    return np.column_stack(columns)


def _measured_speed(model: RobotModel, motions: tuple[RobotMotion, RobotMotion]) -> FloatArray:
    """Return the change of the speed channel: the controller's own, or the log's derivative of the position."""
    free, hit = motions
    change = hit["measured_speed"] - free["measured_speed"]
    position = hit["motor_position"] - free["motor_position"]
    for joint, axis in enumerate(model.axes):
        if axis.sensors.speed_hz > 0.0:
            constant = 1.0 / (2.0 * math.pi * axis.sensors.speed_hz)
            steps = np.diff(position[:, joint], prepend=0.0) / hit.period
            once = first_order_low_pass(steps, constant, hit.period)
            change[:, joint] = first_order_low_pass(once, constant, hit.period)
    return change


def _sensed(model: RobotModel, motion: RobotMotion, unit: str) -> FloatArray:
    """Return what ideal accelerometers measure (n, J): the joints' accelerations, or of the links in m/s2."""
    if unit == "m/s2" and model.link_sensors is not None:
        return model.link_sensors.specific_force(
            motion["link_position"], motion["link_speed"], motion["link_acceleration"]
        )
    return motion["link_acceleration"]


def _winds_up_beyond(model: RobotModel, motions: tuple[RobotMotion, RobotMotion], reliable: BoolArray) -> bool:
    """Whether the contact winds a joint's drive up by 5 % more than its stiffness is known for."""
    free, hit = (np.abs(motion["wind_up"]) for motion in motions)
    observed = np.array([axis.drive.observed_wind_up for axis in model.axes])
    elastic = np.array([not axis.drive.is_rigid for axis in model.axes])
    known = np.maximum(np.max(free, axis=0), observed)
    return bool(np.any(elastic & (np.max(hit[reliable], axis=0) > BEYOND * known)))


def _rises_beyond(model: RobotModel, hit: RobotMotion, reliable: BoolArray) -> bool:
    """Whether a command without a known slew limit rises by 5 % faster than it was observed to."""
    command = hit["command"]
    slope = np.abs(np.diff(command, axis=0, prepend=command[:1])) / hit.period
    highest = np.max(slope[reliable], axis=0)
    return any(
        math.isinf(controller.slew_limit) and 0.0 < BEYOND * controller.observed_slope < own
        for controller, own in zip(_controllers(model), highest, strict=True)
    )
