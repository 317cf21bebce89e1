"""In which unit is a channel logged? The header, the ratio of position to speed or the name tells; else a question."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from cdtool.units import find_unit
from cdtool.workflows import draft_motion as motion
from cdtool.workflows.draft_streams import Channels, Found, Stream
from cdtool.workflows.draft_words import words

_RAW = ("A", "V", "1", "count")
# Above this a rotation [rad, rad/s] is a motor's, not a load's.
_MOTOR_RANGE = 20.0
_ROTARY_WORDS = ("winkel", "angle", "phi", "theta", "rot", "deg", "q")
# Units of position and speed that belong together, the likelier first.
_PAIRS = (
    ("rad", "rad/s"), ("m", "m/s"), ("mm", "mm/s"), ("deg", "deg/s"), ("rad", "rpm"), ("deg", "rpm"), ("rev", "rpm"),
    ("deg", "rad/s"), ("m", "mm/s"), ("mm", "m/s"), ("mm", "m/min"), ("m", "m/min"), ("rad", "deg/s"),
)  # fmt: skip


@dataclass(frozen=True)
class Side:
    """The kind of machine and the side that its log tells of, and why."""

    type: str
    coordinates: str
    why: str

    def accepted(self, channel: str) -> tuple[str, ...]:
        """SI units that this kind of machine takes for a channel, as cdtool.machines has them."""
        quantity = channel.removeprefix("reference_")
        if quantity == "force":
            return ("N",)
        linear = {"torque": "N", "speed": "m/s", "position": "m", "acceleration": "m/s2"}
        rotary = {"torque": "N m", "speed": "rad/s", "position": "rad", "acceleration": "rad/s2"}
        load = (linear if self.type == "linear_axis" else rotary)[quantity]
        if self.coordinates == "load" or quantity == "acceleration" or load == rotary[quantity]:
            return (load,)
        return rotary[quantity], load


@dataclass(frozen=True)
class Logged:
    """A unit with its scale (None: 1), why it is thought so, and what is to be checked (empty: it is known)."""

    unit: str
    why: str
    scale: tuple[float, ...] | None = None
    check: str = ""


def side_of(channels: Channels, topics: bool) -> Side:
    """Linear or rotary, motor or load: from the units told, from names and from how far and how fast it turns."""
    if channels.joints > 1:
        motor, why = _is_motor(channels, topics)
        text = f"{channels.joints} joints of which no model is known"
        return Side("rotary_axis", "motor" if motor else "load", f"{text}; {why}")
    told = [_told(found.stream) for name, found in channels.found.items() if name in ("position", "speed")]
    if any(unit in ("m", "m/s") for unit in told):
        return Side("linear_axis", "load", "one joint, position or speed in a unit of length")
    motor, why = _is_motor(channels, topics)
    if motor:
        return Side("linear_axis", "motor", f"one joint; {why}; rotary_axis for a hinged door or a turntable")
    names = [word for name in ("position", "speed") if name in channels.found for word in words(_name(channels, name))]
    if any(unit in ("rad", "rad/s") for unit in told) or any(word in _ROTARY_WORDS[:-1] for word in names):
        return Side("rotary_axis", "load", "one joint, and it tells of angles")
    if topics:
        return Side("rotary_axis", "load", "one joint in SI units; linear_axis for a joint that slides")
    return Side("linear_axis", "load", "one joint; rotary_axis for one that turns")


def logged_unit(channel: str, channels: Channels, side: Side, topics: bool) -> Logged:
    """Unit and scale of one channel; a raw one's scale, and what no evidence tells, is to be checked."""
    stream, accepted = channels.found[channel].stream, side.accepted(channel)
    if stream.unit and (known := find_unit(stream.unit)):
        if known.si in accepted:
            return Logged(stream.unit, "the log says so")
        if known.si in _RAW:
            return _raw(stream.unit, accepted[0], channels.joints, "the log says so")
    quantity = channel.removeprefix("reference_")
    if topics:
        return Logged(accepted[0], "messages are in SI units")
    if quantity in ("position", "speed"):
        return _of_motion(channel, channels, side)
    if quantity == "torque":
        return _of_torque(stream, accepted, channels.joints)
    largest = float(np.nanmax(np.abs(stream.values)))
    unit = accepted[0] if accepted[0] != "rad/s2" else "rad/s2"
    return Logged(unit, "", check=f"the unit is not told; values reach {largest:.3g}: {_others(unit)}?")


def _of_motion(channel: str, channels: Channels, side: Side) -> Logged:
    quantity = channel.removeprefix("reference_")
    own = channels.found.get(quantity)
    if channel != quantity and own is not None:
        same = logged_unit(quantity, channels, side, topics=False)
        return Logged(same.unit, f"as the measured {quantity}", same.scale, same.check)
    accepted = side.accepted(channel)
    units = [unit for pair in _PAIRS for unit in pair if (known := find_unit(unit)) and known.si in accepted]
    likely = _by_name(channel, channels.found[channel], side)
    if not {"position", "speed"} <= channels.found.keys():
        unit = likely or units[0]
        return Logged(unit, "its name" if likely else "", check="" if likely else f"not told: {_others(unit)}?")
    slope = motion.integral_fit(channels.found["position"].stream, channels.found["speed"].stream).slope
    speed = likely if quantity == "speed" else _by_name("speed", channels.found["speed"], side)
    fitting = [pair for pair in _PAIRS if _pair_fits(pair, slope, side)]
    fitting.sort(key=lambda pair: speed is not None and pair[1] != speed)
    if fitting:
        pair = fitting[0]
        text = f"{pair[0]} and {pair[1]} go with the ratio of the position's derivative to the speed, {slope:.4g}"
        check = f"not told; {_others(pair[0])} and {_others(pair[1])} fit as well" if abs(slope - 1.0) < 0.05 else ""
        return Logged(pair[quantity == "speed"], text, check=check)
    unit = speed or next(pair[1] for pair in _PAIRS if _pair_fits(pair, None, side))
    if quantity == "speed":
        return Logged(unit, "its name" if speed else "", check="" if speed else f"not told: {_others(unit)}?")
    if not math.isfinite(slope) or slope == 0.0 or (known := find_unit(unit)) is None:
        return _raw("count", accepted[0], channels.joints, "")
    scale = (float(f"{known.factor / slope:.5g}"),) * channels.joints
    per = f"{known.si.removesuffix('/s')} per count, from the ratio {slope:.4g} to the speed in {unit}"
    return Logged("count", per, scale, check=f"right only if the speed is in {unit}")


def _pair_fits(pair: tuple[str, str], slope: float | None, side: Side) -> bool:
    position, speed = find_unit(pair[0]), find_unit(pair[1])
    if position is None or speed is None:
        return False
    if position.si not in side.accepted("position") or speed.si not in side.accepted("speed"):
        return False
    return slope is None or abs(slope * position.factor / speed.factor - 1.0) < 0.05


def _of_torque(stream: Stream, accepted: tuple[str, ...], joints: int) -> Logged:
    parts = words(stream.name)
    whole = "".join(parts)
    if "current" in whole or "strom" in whole or any(part in ("i", "iq", "amps") for part in parts):
        return _raw("A", accepted[0], joints, "its name")
    if any(long in whole for long in ("torque", "moment", "effort", "kraft", "force")) or "tau" in parts:
        largest = float(np.nanmax(np.abs(stream.values)))
        unit = accepted[0]
        return Logged(unit, "its name", check=f"values reach {largest:.3g}: {_others(unit)}?")
    return _raw("1", accepted[0], joints, "")


def _raw(unit: str, target: str, joints: int, why: str) -> Logged:
    return Logged(unit, why, (1.0,) * joints, f"the scale 1 is a placeholder: {target} per {unit}")


def _by_name(channel: str, found: Found, side: Side) -> str | None:
    """The unit that a name usually goes with."""
    parts = words(found.stream.name)
    if channel.endswith("speed") and (side.type != "linear_axis" or side.coordinates == "motor"):
        if any(part in ("n", "rpm") or "drehzahl" in part for part in parts):
            return "rpm"
        if any(part in ("qd", "dq", "w", "omega", "dphi", "qp") for part in parts):
            return "rad/s"
    return None


def _is_motor(channels: Channels, topics: bool) -> tuple[bool, str]:
    for name in ("position", "speed", "torque"):
        if name in channels.found and any("motor" in word for word in words(_name(channels, name))):
            return True, f"'{_name(channels, name)}' tells of a motor"
    speed, position = channels.found.get("speed"), channels.found.get("position")
    if speed is not None and (
        find_unit(speed.stream.unit or "") == find_unit("rpm") or "n" in words(speed.stream.name)
    ):
        return True, f"'{speed.stream.name}' is a speed of rotation, as motors have"
    known = topics or any(_told(item.stream) in ("rad", "rad/s") for item in (speed, position) if item)
    for item in (position, speed):
        if known and item is not None and float(np.nanmax(np.abs(item.stream.values))) > _MOTOR_RANGE:
            return True, f"'{item.stream.name}' goes beyond {_MOTOR_RANGE:g}, as only a motor does"
    return False, "nothing tells of a motor"


def _told(stream: Stream) -> str:
    known = find_unit(stream.unit) if stream.unit else None
    return known.si if known else ""


def _name(channels: Channels, channel: str) -> str:
    return channels.found[channel].stream.name


def _others(unit: str) -> str:
    """A unit and those that it may be instead."""
    alike = {"N": "N or kN", "N m": "N m or mN m", "m/s2": "m/s2 or g", "rad": "rad or deg", "rad/s": "rad/s or deg/s"}
    return alike.get(unit, {"m": "m or mm", "m/s": "m/s or mm/s", "rad/s2": "rad/s2 or deg/s2"}.get(unit, unit))
