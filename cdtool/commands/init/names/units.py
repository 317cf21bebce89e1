"""Guess a channel's unit from header, message type, ratio of position to speed or name; otherwise ask for it."""

from __future__ import annotations

import re
from dataclasses import dataclass

from cdtool.commands.init.machine_side import Side
from cdtool.commands.init.names.units_in_names import alike, factor_of, label, si_of
from cdtool.commands.init.names.words import BOUND, is_current, says, word_for
from cdtool.commands.init.speed_ratio import (
    Combination,
    Ratio,
    Stated,
    implausible,
    motion_kind,
    rotation_unit,
    stated,
    whole_numbers,
)
from cdtool.commands.init.streams import Channels
from cdtool.recordings.units import RAW_UNITS, find_unit

# Message types with SI units by the ROS convention (REP 103).
_SI_PACKAGES = ("sensor_msgs", "geometry_msgs", "nav_msgs", "control_msgs", "trajectory_msgs")
_MOTION = ("position", "speed")
_MASS = re.compile(r"(kg|lbs?|lbm|oz|kilogramm?e?|pounds?|ounces?)\b(?![- ]?(f|kraft))", re.IGNORECASE)
_IN_SMALLER = {"rad": "deg", "rad/s": "deg/s", "m": "mm", "m/s": "mm/s"}


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
        stream = self.channels.found[channel].stream
        quantity = channel.removeprefix("reference_")
        told = stated(channel, stream)
        if told.by == "log" and not (quantity == "position" and told.si == "count"):
            return self._told(channel, told)
        if is_si(message_type := self.message_types.get(stream.topic, "")):
            return Logged("", f"messages of type {message_type} are in SI units", check=self._contradicted(channel))
        if channel != quantity and quantity in self.channels.found and not told.unit and not self._differs(channel):
            same = self.logged(quantity)
            check = same.check or "not stated: does it have the same unit?"
            return Logged(same.unit or self.side.accepted(channel)[0], f"as the measured {quantity}", same.scale, check)
        if channel in _MOTION and self.side.gear is not None:
            unit = getattr(self.side.gear, channel)
            why = "from its name" if told.unit else ""
            return Logged(unit, why, check=f"not certain: {alike(unit)}? The transmission ratio depends on it")
        if channel in _MOTION and self.ratio is not None and self.ratio.fitting and told.si not in RAW_UNITS:
            return self._fitting(channel, self.ratio, self.ratio.fitting[0])
        if quantity == "position" and (told.si == "count" or (not told.unit and self._counts(channel))):
            return self._counted(channel, told.unit or "count")
        return self._told(channel, told) if told.unit else self._assumed(channel)

    def _differs(self, channel: str) -> bool:
        """Whether one is a current and the other a torque: a set torque next to a measured current."""
        quantity = channel.removeprefix("reference_")
        names = [label(self.channels.found[name].stream) for name in (channel, quantity)]
        return quantity == "torque" and is_current(names[0]) != is_current(names[1])

    def _told(self, channel: str, told: Stated) -> Logged:
        accepted = self.side.accepted(channel)
        if self.channels.found[channel].stream.name.isdigit():  # a table without names states no unit
            return Logged(told.unit, "by the circle")
        why = "stated in the log" if told.by == "log" else "from its name"
        if told.si in RAW_UNITS:
            return self._raw(told.unit, accepted[0], why)
        check = self._contradicted(channel) if told.by == "log" else "known only from its name"
        if told.si not in accepted:
            check = f"with this type and these coordinates it is {accepted[0]}"
        elif told.by == "log" and _MASS.search(told.unit):
            check = "a mass: is it its weight, 1 kg = 9.81 N?"
        return Logged(told.unit, why, check=check)

    def _fitting(self, quantity: str, ratio: Ratio, first: Combination) -> Logged:
        clock = f" (clock in {first.clock})" if first.clock and not self.clock_told else ""
        derivative = f"the position's derivative is {ratio.per_second(first.clock):.4g} of the speed"
        agreed = self.clock_told and all(
            find_unit(stated(name, self.channels.found[name].stream).unit) == find_unit(getattr(first, name))
            for name in _MOTION
        )
        check = ""
        if not agreed and not ratio.certain(self.channels):
            off = 100 * ratio.off(first)
            alone = "a gear may also have this ratio" if off < 1.0 else f"the ratio is {off:.1f} % off"
            check = f"not certain; {fits_as_well(ratio, self.clock_told) or alone}"
        return Logged(getattr(first, quantity), f"{derivative}{clock}: {first.position} and {first.speed}", check=check)

    def _counts(self, channel: str) -> bool:
        """Whether no unit explains a position: an encoder's counts."""
        own = self.ratio is not None and channel == "position"
        return own or whole_numbers(self.channels.found[channel].stream)

    def _counted(self, channel: str, unit: str) -> Logged:
        accepted = self.side.accepted(channel)[0]
        if self.ratio is None or self.ratio.tick:  # a counter's rate is itself only a guess
            return self._raw(unit, accepted, "whole numbers" if unit == "count" else "")
        speed = self.logged("speed")
        si = si_of(speed.unit or "rad/s")
        factor = factor_of(speed.unit) * (speed.scale[0] if speed.scale else 1.0)
        slope = self.ratio.per_second(self.clock_unit)
        length = (self.side.accepted("speed")[0] if si in RAW_UNITS else si).removesuffix("/s")
        why = f"{length} per count, from the ratio {slope:.4g} to the speed in {speed.unit or si}"
        scale = (float(f"{factor / slope:.5g}"),) * self.channels.joints
        return Logged(unit, why, scale, check="correct only if the speed's unit, its scale and the clock are")

    def _assumed(self, channel: str) -> Logged:
        """Return the usual unit of a channel whose unit nothing states."""
        stream, accepted = self.channels.found[channel].stream, self.side.accepted(channel)
        quantity, name = channel.removeprefix("reference_"), label(stream)
        unit, why = accepted[0], ""
        if quantity == "torque":
            strength, word = word_for("torque", name)
            if is_current(name) or strength < BOUND or word in ("pwm", "duty"):
                return self._raw("A", unit, "its name") if is_current(name) else self._raw("1", unit, "")
            is_force = word == "drive force" or says("force_of_drive", name) not in ("", "effort")
            unit, why = accepted[-1] if is_force else unit, "its name"
        elif quantity == "speed" and "rad/s" in accepted:
            unit = rotation_unit(stream) or unit
        elif quantity == "position" and motion_kind("position", self.channels) == "length":
            unit = accepted[-1]
        if implausible(unit, stream, self.channels.joints):
            unit = _IN_SMALLER[unit]
        text = f"the header says '{stream.unit}', which is not a unit" if stream.unit else "not stated"
        return Logged(unit, why, check=f"{text}; values reach {_digits(stream.reach)}: {alike(unit)}?")

    def _raw(self, unit: str, target: str, why: str) -> Logged:
        per = f"{target} at 100 %" if unit == "%" else f"{target} per {si_of(unit) or unit}"
        return Logged(unit, why, (1.0,) * self.channels.joints, f"the scale 1 is a placeholder: {per}")

    def _contradicted(self, channel: str) -> str:
        """Return the contradiction between the stated units of position and speed, or an empty text."""
        if channel not in _MOTION or self.ratio is None or self.ratio.fitting or self.side.gear is not None:
            return ""
        streams = {name: self.channels.found[name].stream for name in _MOTION}
        if all(is_si(self.message_types.get(stream.topic, "")) for stream in streams.values()):
            return f"the position's derivative is {self.ratio.raw:.4g} of the speed: it must be 1 in SI units"
        position, speed = (stated(name, stream) for name, stream in streams.items())
        if {position.si, speed.si} & {"", *RAW_UNITS}:
            return ""
        slope = self.ratio.per_second(self.clock_unit) * factor_of(position.unit) / factor_of(speed.unit)
        return f"with these units the position's derivative is {slope:.4g} of the speed, not 1"


def is_si(message_type: str) -> bool:
    """Whether units of a message type are SI by convention: `sensor_msgs/msg/JointState`."""
    return message_type.split("/")[0].split(".")[0] in _SI_PACKAGES


def fits_as_well(ratio: Ratio, clock_told: bool) -> str:
    """Return the other combinations that fit: "s with m, mm/s; ms with mm, mm/s fit as well"; empty without any."""
    texts = [
        f"{'' if clock_told or not item.clock else f'{item.clock} with '}{item.position}, {item.speed}"
        for item in ratio.fitting[1:]
    ]
    return f"{'; '.join(texts)} {'fit' if len(texts) > 1 else 'fits'} as well" if texts else ""


def _digits(value: float) -> str:
    return f"{value:.0f}" if 1000.0 <= value < 1e7 else f"{value:.3g}"
