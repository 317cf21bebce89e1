"""A contact of a point of a robot's link, as the difference of two simulations with and without the obstacle.

The obstacle is a plane that the point moves into. It stands where the model's own point is at the instant of contact,
so that both simulations are equal up to that instant; tau_c = J' F loads all joints (thesis 2.5). As for an axis, see
`axis_contact`: both follow the references of the log, and what they differ by is the effect of the contact.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import RecordingError
from cdtool.commands.inject.assumption import Assumption, ControllerReaction, assumptions_of
from cdtool.commands.inject.axis_contact import last_rest
from cdtool.commands.inject.channel_change import ChannelChange
from cdtool.commands.inject.injected_contact import InjectedContact, Signals, injected_contact
from cdtool.machines.axis_model.axis_run import AxisRun
from cdtool.machines.axis_model.obstacle import Obstacle
from cdtool.machines.axis_model.parameters import AxisModel, Controller
from cdtool.machines.robot_model.parameters import RobotModel, Vector, point_in_joint
from cdtool.machines.robot_model.simulation import PointContact, RobotInputs, RobotMotion, simulate_robot

# What is simulated before the contact where the robot is never at rest before it [s].
_LONGEST_APPROACH = 5.0
# Speeds are means over this time [s].
_MEAN_SPEED_OVER = 0.02
# A joint below this share of its own greatest speed is at rest.
_AT_REST = 0.02
# A controller without which the motors would not notice the contact: as stiff as this sampling [s] permits.
_STIFF_SHARE, _STIFF_PERIOD = 0.2, 1e-3
# A point that moves along a plane, or not at all, does not meet it: share of its speed, and of the greatest one.
_ALONG_PLANE, _STANDS = 0.02, 1e-3


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
        width = min(max(round(_MEAN_SPEED_OVER / self.period), 1), len(speed))
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
    signals = [_signals(model, motion, log.acceleration_unit) for motion in (free, hit)]
    force = ChannelChange(time, hit.contact_force[:, np.newaxis], contact)
    return injected_contact(model.axes, (signals[0], signals[1]), force, approach, assumption)


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
    period = log.period / max(math.ceil(log.period / _STIFF_PERIOD - 1e-6), 1)
    gain = _STIFF_SHARE / period
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
    return max(contact - _LONGEST_APPROACH, last_rest(log.time, (log.time <= contact) & ~moving, log.period), log.start)


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
    if own <= _STANDS * fastest or own == 0.0:
        raise RecordingError(
            f"{log.name}: the point of link '{link.name}' is at rest at the contact",
            "choose a contact while it moves",
        )
    normal = velocity / own
    if struck.direction is not None:
        given = np.array(struck.direction) / np.linalg.norm(struck.direction)
        towards = float(given @ velocity)
        if abs(towards) < _ALONG_PLANE * own:
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


def _signals(model: RobotModel, motion: RobotMotion, acceleration_unit: str) -> Signals:
    """Return what the sensors and drives of the joints would log of a motion."""
    names = {"torque": "drive_torque", "speed": "measured_speed", "position": "motor_position"}
    names |= {"reference_torque": "command", "wind_up": "wind_up"}
    rows = {name: motion[row] for name, row in names.items()}
    return Signals(motion.period, {**rows, "acceleration": _sensed(model, motion, acceleration_unit)})


def _sensed(model: RobotModel, motion: RobotMotion, unit: str) -> FloatArray:
    """Return what ideal accelerometers measure (n, J): the joints' accelerations, or of the links in m/s2."""
    if unit == "m/s2" and model.link_sensors is not None:
        return model.link_sensors.specific_force(
            motion["link_position"], motion["link_speed"], motion["link_acceleration"]
        )
    return motion["link_acceleration"]
