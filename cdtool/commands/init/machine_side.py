"""Guess the kind of machine and whether a log is of its motor or its load: units first, then names and ranges."""

from __future__ import annotations

from dataclasses import dataclass

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
_LINEAR = {"torque": "N", "speed": "m/s", "position": "m", "acceleration": "m/s2"}
_ROTARY = {"torque": "N m", "speed": "rad/s", "position": "rad", "acceleration": "rad/s2"}


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
        load = (_LINEAR if self.type == "linear_axis" else _ROTARY)[quantity]
        both = self.coordinates == "motor" and quantity != "acceleration"
        return tuple(dict.fromkeys((_ROTARY[quantity], load))) if both else (load,)


def side_of(channels: Channels, ratio: Ratio | None, clock: DraftedClock | None, messages_si: bool) -> Side:
    """Guess linear or rotary, motor or load: from stated units, names, and the range and speed of rotation."""
    told = {name: stated(name, found.stream).si for name, found in channels.found.items()}
    torque = told.get("torque", "")
    lengths = told.get("position") == "m" or told.get("speed") == "m/s"
    motor = _motor_by(channels, ratio, messages_si)
    if channels.joints > 1:
        turns = torque == "N m" if lengths else bool(motor)
        why = f"{channels.joints} joints without a known model; {motor or 'nothing indicates a motor'}"
        kind = "linear_axis" if lengths else "rotary_axis"
        return Side(kind, "motor" if turns else "load", why, "planar_arm or urdf for coupled joints")
    if (gear := _gear(channels, ratio, clock)) is not None:
        return Side("linear_axis", "motor", "a travel and a speed of rotation are logged", "", gear)
    if lengths:
        side = (
            ("motor", "a travel and a torque are logged") if torque == "N m" else ("load", "a unit of length is logged")
        )
        return Side("linear_axis", *side)
    if motor:
        return Side("linear_axis", "motor", f"one joint; {motor}", _MOTOR_OF_SLIDE)
    is_angle = "angle" in {motion_kind(name, channels) for name in ("position", "speed")}
    if is_angle and torque == "N":
        return Side("linear_axis", "motor", "one joint, an angle and a force", _MOTOR_OF_SLIDE)
    fits_angle = ratio is not None and bool(ratio.fitting) and si_of(ratio.fitting[0].position) == "rad"
    if is_angle or torque == "N m" or seems_to_turn(channels) or fits_angle or messages_si:
        return Side("rotary_axis", "load", "one joint that turns, by a name or unit", _MOTOR_OF_LOAD)
    return Side("linear_axis", "load", "one joint", "rotary_axis for a rotating joint")


def _gear(channels: Channels, ratio: Ratio | None, clock: DraftedClock | None) -> Gear | None:
    """Return a travel and a rotation, by units or names, whose ratio is that of a gear."""
    if ratio is None or ratio.fitting:
        return None
    position, speed = (channels.found[name].stream for name in ("position", "speed"))
    units = stated("position", position), stated("speed", speed)
    slope = ratio.per_second(clock.unit if clock is not None else "")
    why = f"from the position's derivative over the speed, r = {ratio.correlation:.3f}"
    if units[0].si == "rad" and units[1].si == "m/s":
        travel = factor_of(units[1].unit) / (slope * factor_of(units[0].unit))
        return Gear(units[0].unit, units[1].unit, travel, why)
    turning = units[1].unit if units[1].si == "rad/s" else "" if units[1].si else rotation_unit(speed)
    lengths = (units[0].unit,) if units[0].si == "m" else () if units[0].si else _LENGTHS
    guessed = not units[0].si
    if not turning or (guessed and (motion_kind("position", channels) == "angle" or whole_numbers(position))):
        return None
    travels = {unit: slope * factor_of(unit) / factor_of(turning) for unit in lengths}
    fitting = (unit for unit, travel in travels.items() if not guessed or _GEARS[0] <= abs(travel) <= _GEARS[1])
    return next((Gear(unit, turning, travels[unit], why) for unit in fitting), None)


def _motor_by(channels: Channels, ratio: Ratio | None, messages_si: bool) -> str:
    """Return what indicates that a log is of the motor; empty if nothing does."""
    fitting = ratio.fitting[0] if ratio is not None and ratio.fitting else None
    for name in ("position", "speed", "torque"):
        if name not in channels.found:
            continue
        stream = channels.found[name].stream
        if any("motor" in word for word in words(stream.name)):
            return f"'{stream.name}' indicates a motor"
        if name == "speed" and "rpm" in (stated(name, stream).unit, rotation_unit(stream)):
            return f"'{stream.name}' is a speed of rotation, typical of a motor"
        usual = "1" if name == "torque" else "rad" if messages_si else getattr(fitting, name, "1")
        known = find_unit(stated(name, stream).unit or usual)
        if known is not None and known.si in ("rad", "rad/s") and known.factor * stream.reach > _MOTOR_RANGE:
            return f"'{stream.name}' goes beyond {_MOTOR_RANGE:g} {known.si}, as only a motor does"
    return ""
