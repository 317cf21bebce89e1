"""Guess the kind of machine and whether a log is of its motor or its load: units first, then names and ranges."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cdtool.commands.init.names.units_in_names import factor_of, si_of
from cdtool.commands.init.names.words import words
from cdtool.commands.init.speed_ratio import Ratio, motion_kind, rotation_unit, seems_to_turn, stated, whole_numbers
from cdtool.commands.init.streams import Channels
from cdtool.commands.init.table_clock import DraftedClock
from cdtool.recordings.recording import RIG_UNITS
from cdtool.recordings.units import find_unit

# Above this a rotation [rad, rad/s] is the motor's, not the load's.
_MOTOR_RANGE = 20.0
# Travel per motor angle [m/rad] of spindles, belts and pinions, to match a ratio with a unit of length.
_GEARS = (2e-4, 0.2)
_LENGTHS = ("mm", "m", "um")
_MOTOR_OF_LOAD = "linear_axis with coordinates = 'motor' if this is the motor of a slide"
_MOTOR_OF_SLIDE = "rotary_axis for a hinged door or a turntable"


@dataclass(frozen=True)
class Gear:
    """Position and speed on two sides of a gear: the units of both, travel per motor angle [m/rad], and the reason."""

    position: str
    speed: str
    ratio: float
    why: str


@dataclass(frozen=True)
class Side:
    """The kind of machine and the side that the log is from, the reason, and an alternative (empty: certain)."""

    type: str
    coordinates: str
    why: str
    check: str = ""
    gear: Gear | None = None

    def accepted(self, channel: str) -> tuple[str, ...]:
        """Return the SI units that this kind of machine accepts for a channel, as in cdtool.machines."""
        quantity = channel.removeprefix("reference_")
        if quantity in RIG_UNITS:
            return (RIG_UNITS[quantity],)
        linear = {"torque": "N", "speed": "m/s", "position": "m", "acceleration": "m/s2"}
        rotary = {"torque": "N m", "speed": "rad/s", "position": "rad", "acceleration": "rad/s2"}
        load = (linear if self.type == "linear_axis" else rotary)[quantity]
        if self.coordinates == "load" or quantity == "acceleration" or load == rotary[quantity]:
            return (load,)
        return rotary[quantity], load


def side_of(channels: Channels, ratio: Ratio | None, clock: DraftedClock | None, messages_si: bool) -> Side:
    """Guess linear or rotary, motor or load: from stated units, names, and the range and speed of rotation."""
    told = {name: stated(name, found.stream).si for name, found in channels.found.items()}
    lengths = told.get("position") == "m" or told.get("speed") == "m/s"
    motor, why = _is_motor(channels, ratio, messages_si)
    if channels.joints > 1:
        text = f"{channels.joints} joints without a known model; {why}"
        kind = "linear_axis" if lengths else "rotary_axis"
        other = "planar_arm or urdf for coupled joints"
        turns = told.get("torque") == "N m" if lengths else motor
        return Side(kind, "motor" if turns else "load", text, other)
    if (gear := _gear(channels, ratio, clock)) is not None:
        return Side("linear_axis", "motor", "a travel and a speed of rotation are logged", "", gear)
    if lengths and told.get("torque") == "N m":
        return Side("linear_axis", "motor", "a travel and a torque are logged")
    if lengths:
        return Side("linear_axis", "load", "one joint, position or speed in a unit of length")
    if motor:
        return Side("linear_axis", "motor", f"one joint; {why}", _MOTOR_OF_SLIDE)
    return _load_side(channels, ratio, told, messages_si)


def _load_side(channels: Channels, ratio: Ratio | None, told: dict[str, str], messages_si: bool) -> Side:
    """Guess the kind of a single joint of which nothing indicates a motor or a length."""
    is_angle = "angle" in {motion_kind(name, channels) for name in ("position", "speed")}
    if told.get("torque") == "N" and is_angle:
        return Side("linear_axis", "motor", "one joint, an angle and a force", _MOTOR_OF_SLIDE)
    if is_angle:
        return Side("rotary_axis", "load", "one joint, in angles", _MOTOR_OF_LOAD)
    if told.get("torque") == "N m":
        return Side("rotary_axis", "load", "one joint, a torque without a travel", _MOTOR_OF_LOAD)
    if seems_to_turn(channels):
        return Side("rotary_axis", "load", "one joint, a torque by its name", _MOTOR_OF_LOAD)
    if ratio is not None and ratio.fitting and si_of(ratio.fitting[0].position) == "rad":
        return Side("rotary_axis", "load", "one joint; angles fit its speed", _MOTOR_OF_LOAD)
    if messages_si:
        return Side("rotary_axis", "load", "one joint in SI units", "linear_axis for a sliding joint")
    return Side("linear_axis", "load", "one joint", "rotary_axis for a rotating joint")


def _gear(channels: Channels, ratio: Ratio | None, clock: DraftedClock | None) -> Gear | None:
    """Return a travel and a rotation, by units or names, whose ratio is that of a gear."""
    if ratio is None or ratio.fitting:
        return None
    position, speed = (channels.found[name].stream for name in ("position", "speed"))
    units = stated("position", position), stated("speed", speed)
    slope = ratio.per_second(clock.unit if clock is not None else "")
    correlation = f"from the position's derivative over the speed, r = {ratio.correlation:.3f}"
    if units[0].si == "rad" and units[1].si == "m/s":
        travel = factor_of(units[1].unit) / (slope * factor_of(units[0].unit))
        return Gear(units[0].unit, units[1].unit, travel, correlation)
    turning = units[1].unit if units[1].si == "rad/s" else rotation_unit(speed) if not units[1].si else ""
    if not turning:
        return None
    if units[0].si == "m":
        return Gear(units[0].unit, turning, slope * factor_of(units[0].unit) / factor_of(turning), correlation)
    if units[0].si or motion_kind("position", channels) == "angle" or whole_numbers(position):
        return None
    for unit in _LENGTHS:
        travel = slope * factor_of(unit) / factor_of(turning)
        if _GEARS[0] <= abs(travel) <= _GEARS[1]:
            return Gear(unit, turning, travel, correlation)
    return None


def _is_motor(channels: Channels, ratio: Ratio | None, messages_si: bool) -> tuple[bool, str]:
    for name in ("position", "speed", "torque"):
        if name in channels.found and any("motor" in word for word in words(channels.found[name].stream.name)):
            return True, f"'{channels.found[name].stream.name}' indicates a motor"
    speed = channels.found["speed"].stream if "speed" in channels.found else None
    if speed is not None and "rpm" in (stated("speed", speed).unit, rotation_unit(speed)):
        return True, f"'{speed.name}' is a speed of rotation, typical of a motor"
    fitting = ratio.fitting[0] if ratio is not None and ratio.fitting else None
    for name in ("position", "speed"):
        if name not in channels.found:
            continue
        stream = channels.found[name].stream
        usual = "rad" if messages_si else getattr(fitting, name) if fitting is not None else "1"
        known = find_unit(stated(name, stream).unit or usual)
        if known is None or known.si not in ("rad", "rad/s"):
            continue
        if known.factor * float(np.nanmax(np.abs(stream.values))) > _MOTOR_RANGE:
            limit = f"{_MOTOR_RANGE:g} {'rad' if messages_si else known.si}"
            return True, f"'{stream.name}' goes beyond {limit}, as only a motor does"
    return False, "nothing indicates a motor"
