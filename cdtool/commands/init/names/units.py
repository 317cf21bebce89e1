"""Guess a channel's unit from header, message type, ratio of position to speed or name; otherwise ask for it."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from cdtool.commands.init.machine_side import Side
from cdtool.commands.init.names.units_in_names import label
from cdtool.commands.init.names.words import is_current, says, word_for
from cdtool.commands.init.speed_ratio import Ratio, implausible, motion_kind, rotation_unit, stated, whole_numbers
from cdtool.commands.init.stream import Stream
from cdtool.commands.init.streams import Channels
from cdtool.recordings.units import find_unit

_RAW = ("A", "V", "1", "count")
# Message types with SI units by the ROS convention (REP 103).
_SI_PACKAGES = ("sensor_msgs", "geometry_msgs", "nav_msgs", "control_msgs", "trajectory_msgs")
_MOTION = ("position", "speed")
_MASS = re.compile(r"(kg|lbs?|lbm|oz|kilogramm?e?|pounds?|ounces?)\b(?![- ]?(f|kraft))", re.IGNORECASE)


@dataclass(frozen=True)
class Logged:
    """A unit with its scale (None: 1), the reason, and what to check (empty: certain).

    An empty unit is that of the message type, which a machine file need not name.
    """

    unit: str
    why: str
    scale: tuple[float, ...] | None = None
    check: str = ""


@dataclass(frozen=True)
class Evidence:
    """All evidence for units: the channels, the machine, the ratio, the clock, and message types."""

    channels: Channels
    side: Side
    ratio: Ratio | None
    clock_unit: str
    clock_told: bool
    message_types: dict[str, str]

    def logged(self, channel: str) -> Logged:
        """Return unit and scale of a channel; the scale of a raw channel, and all without evidence, must be checked."""
        stream, accepted = self.channels.found[channel].stream, self.side.accepted(channel)
        quantity = channel.removeprefix("reference_")
        told = stated(channel, stream)
        if told.by == "log" and not (quantity == "position" and told.si == "count"):
            return self._told(channel, told.unit, told.si, accepted)
        if is_si(self.message_types.get(stream.topic, "")):
            why = f"messages of type {self.message_types[stream.topic]} are in SI units"
            return Logged("", why, check=self._contradicted(channel))
        if channel != quantity and quantity in self.channels.found and not told.unit and not self._differs(channel):
            same = self.logged(quantity)
            return Logged(
                same.unit or accepted[0],
                f"as the measured {quantity}",
                same.scale,
                same.check or "not stated: does it have the same unit?",
            )
        if quantity in _MOTION:
            return self._of_motion(channel)
        if told.unit:
            return self._named(told.unit, told.si, accepted)
        if quantity == "torque":
            return _of_torque(stream, accepted, self.channels.joints)
        largest = float(np.nanmax(np.abs(stream.values)))
        why = f"the header says '{stream.unit}', which is not a unit" if stream.unit else "the unit is not stated"
        return Logged(accepted[0], "", check=f"{why}; values reach {largest:.3g}: {others(accepted[0])}?")

    def _differs(self, channel: str) -> bool:
        """Whether one is a current and the other a torque: a set torque next to a measured current."""
        quantity = channel.removeprefix("reference_")
        names = [label(self.channels.found[name].stream) for name in (channel, quantity)]
        return quantity == "torque" and is_current(names[0]) != is_current(names[1])

    def _told(self, channel: str, unit: str, si: str, accepted: tuple[str, ...]) -> Logged:
        if self.channels.found[channel].stream.name.isdigit():  # a table without names states no unit
            return Logged(unit, "by the circle")
        if si in accepted:
            weight = "a mass: is it its weight, 1 kg = 9.81 N?" if _MASS.search(unit) else ""
            return Logged(unit, "stated in the log", check=weight or self._contradicted(channel))
        if si in _RAW:
            return _raw(unit, accepted[0], self.channels.joints, "stated in the log")
        return Logged(unit, "stated in the log", check=f"with this type and these coordinates it is {accepted[0]}")

    def _named(self, unit: str, si: str, accepted: tuple[str, ...]) -> Logged:
        if si in _RAW:
            return _raw(unit, accepted[0], self.channels.joints, "from its name")
        check = "" if si in accepted else f"with this type and these coordinates it is {accepted[0]}"
        return Logged(unit, "from its name", check=check or "known only from its name")

    def _of_motion(self, channel: str) -> Logged:
        quantity = channel.removeprefix("reference_")
        stream, accepted = self.channels.found[channel].stream, self.side.accepted(channel)
        told = stated(channel, stream)
        if channel == quantity and self.side.gear is not None:
            unit = self.side.gear.position if quantity == "position" else self.side.gear.speed
            why = "from its name" if told.unit else "" if quantity == "position" else "its name"
            return Logged(unit, why, check=f"not certain: {others(unit)}? The transmission ratio depends on it")
        if channel == quantity and self.ratio is not None and self.ratio.fitting and told.si not in _RAW:
            return self._fitting(quantity)
        if quantity == "position" and (told.si == "count" or self._counts(channel)):
            return self._counted(channel, told.unit or "count")
        if told.unit:
            return self._named(told.unit, told.si, accepted)
        usual = self._usual(quantity, stream, accepted)
        return Logged(usual, "", check=f"not stated: {others(usual)}?")

    def _fitting(self, quantity: str) -> Logged:
        assert self.ratio is not None
        first, *rest = self.ratio.fitting
        clock = f" (clock in {first.clock})" if first.clock and not self.clock_told else ""
        per_second = self.ratio.per_second(first.clock)
        text = f"the position's derivative is {per_second:.4g} of the speed{clock}: {first.position} and {first.speed}"
        agreed = all(
            find_unit(stated(name, self.channels.found[name].stream).unit) == find_unit(unit)
            for name, unit in (("position", first.position), ("speed", first.speed))
        )
        check = ""
        if not (self.ratio.certain or (agreed and self.clock_told)):
            check = f"not certain; {self._rest(len(rest) > 0)}"
        return Logged(getattr(first, quantity), text, check=check)

    def _rest(self, several: bool) -> str:
        assert self.ratio is not None
        if not several:
            off = 100 * self.ratio.fitting[0].off
            return "a gear may also have this ratio" if off < 1.0 else f"the ratio is {off:.1f} % off"
        return f"{fits_as_well(self.ratio, self.clock_told)} as well"

    def _counts(self, channel: str) -> bool:
        """Whether no unit explains a position: an encoder's counts."""
        stream = self.channels.found[channel].stream
        own = self.ratio is not None and channel == "position"
        return not stated(channel, stream).unit and (own or whole_numbers(stream))

    def _counted(self, channel: str, unit: str) -> Logged:
        accepted, joints = self.side.accepted(channel)[0], self.channels.joints
        if self.ratio is None or self.ratio.tick:  # a counter's rate is itself only a guess
            return _raw(unit, accepted, joints, "whole numbers" if unit == "count" else "")
        speed = self.logged("speed")
        known = find_unit(speed.unit)
        si, factor = (known.si, known.factor) if known is not None else ("rad/s", 1.0)
        si = self.side.accepted("speed")[0] if si in _RAW else si
        factor *= speed.scale[0] if speed.scale else 1.0
        slope = self.ratio.per_second(self.clock_unit)
        scale = (float(f"{factor / slope:.5g}"),) * joints
        per = f"{si.removesuffix('/s')} per count, from the ratio {slope:.4g} to the speed in {speed.unit or si}"
        return Logged(unit, per, scale, check="correct only if the speed's unit, its scale and the clock are")

    def _usual(self, quantity: str, stream: Stream, accepted: tuple[str, ...]) -> str:
        if quantity == "speed" and "rad/s" in accepted and (usual := rotation_unit(stream)):
            return usual
        unit = accepted[0]
        if quantity == "position" and len(accepted) > 1 and motion_kind("position", self.channels) == "length":
            unit = accepted[1]
        if implausible(unit, stream, self.channels.joints):
            return {"rad": "deg", "rad/s": "deg/s", "m": "mm", "m/s": "mm/s"}[unit]
        return unit

    def _contradicted(self, channel: str) -> str:
        """Return the contradiction between the stated units of position and speed, or an empty text."""
        if channel not in _MOTION or self.ratio is None or self.ratio.fitting or self.side.gear is not None:
            return ""
        streams = [self.channels.found[name].stream for name in _MOTION]
        if all(is_si(self.message_types.get(stream.topic, "")) for stream in streams):
            return f"the position's derivative is {self.ratio.raw:.4g} of the speed: it must be 1 in SI units"
        known = [find_unit(stated(name, stream).unit) for name, stream in zip(_MOTION, streams, strict=True)]
        factors = [unit.factor for unit in known if unit is not None and unit.si not in _RAW]
        if len(factors) < 2:
            return ""
        slope = self.ratio.per_second(self.clock_unit) * factors[0] / factors[1]
        return f"with these units the position's derivative is {slope:.4g} of the speed, not 1"


def is_si(message_type: str) -> bool:
    """Whether units of a message type are SI by convention: `sensor_msgs/msg/JointState`."""
    return message_type.split("/")[0].split(".")[0] in _SI_PACKAGES


def fits_as_well(ratio: Ratio, clock_told: bool) -> str:
    """Return the other combinations that fit: "s with m, mm/s; ms with mm, mm/s fit"."""
    texts = [
        f"{'' if clock_told or not item.clock else f'{item.clock} with '}{item.position}, {item.speed}"
        for item in ratio.fitting[1:]
    ]
    return f"{'; '.join(texts)} {'fit' if len(texts) > 1 else 'fits'}"


def others(unit: str) -> str:
    """Return a unit and the units it may be instead."""
    alike = {
        "N": "N or kN", "N m": "N m or mN m", "m/s2": "m/s2 or g", "rad": "rad or deg", "rad/s": "rad/s or deg/s",
        "m": "m or mm", "mm": "mm or m", "m/s": "m/s or mm/s", "rad/s2": "rad/s2 or deg/s2", "rpm": "rpm or rad/s",
    }  # fmt: skip
    return alike.get(unit, unit)


def _of_torque(stream: Stream, accepted: tuple[str, ...], joints: int) -> Logged:
    name = label(stream)
    if is_current(name):
        return _raw("A", accepted[0], joints, "its name")
    strength, word = word_for("torque", name)
    if strength > 1.0 and word not in ("pwm", "duty"):
        unit = (
            accepted[-1] if word == "drive force" or says("force_of_drive", name) not in ("", "effort") else accepted[0]
        )
        return Logged(unit, "its name", check=f"{_reach(stream)}: {others(unit)}?")
    return _raw("1", accepted[0], joints, "")


def _raw(unit: str, target: str, joints: int, why: str) -> Logged:
    known = find_unit(unit)
    per = f"{target} at 100 %" if unit == "%" else f"{target} per {known.si if known else unit}"
    return Logged(unit, why, (1.0,) * joints, f"the scale 1 is a placeholder: {per}")


def _reach(stream: Stream) -> str:
    largest = float(np.nanmax(np.abs(stream.values)))
    return f"values reach {largest:.0f}" if 1000.0 <= largest < 1e7 else f"values reach {largest:.3g}"
