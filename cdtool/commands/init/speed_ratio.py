"""Find the units of clock, position and speed that fit the ratio of the position's derivative to the speed.

With the logged values x of the position and v of the speed, dx / (v dt) = f_speed f_clock / f_position, where f are
the factors to SI. Several combinations can fit: ms with m and m/s give 0.001, as do s with m and mm/s. All are named.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from cdtool.commands.init import motion_evidence as motion
from cdtool.commands.init.names.units_in_names import factor_of, label, own_name, si_of, unit_in_name
from cdtool.commands.init.names.words import motion_of, says
from cdtool.commands.init.stream import Stream
from cdtool.commands.init.streams import Channels
from cdtool.commands.init.table_clock import DraftedClock
from cdtool.recordings.units import find_unit

# Units of position and speed that belong together, the likelier first; the first of each kind are both SI.
_PAIRS = (
    ("rad", "rad/s"), ("m", "m/s"), ("mm", "mm/s"), ("deg", "deg/s"), ("rad", "rpm"), ("deg", "rpm"), ("rev", "rpm"),
    ("deg", "rad/s"), ("m", "mm/s"), ("mm", "m/s"), ("mm", "m/min"), ("mm", "mm/min"), ("m", "m/min"),
    ("rad", "deg/s"), ("um", "mm/s"), ("deg", "deg/min"),
)  # fmt: skip
# Largest positions and speeds of axes, and of the joints of robots.
_LIMITS = {"m": 30.0, "m/s": 20.0}
_ROBOT_LIMITS = {"rad": 4.0 * math.pi, "rad/s": 25.0, **_LIMITS}
_KINDS = {"m": "length", "m/s": "length", "rad": "angle", "rad/s": "angle", "": ""}


@dataclass(frozen=True)
class Stated:
    """The unit that a log states for a channel; `by`: "log" (its header), "name", or "" without a stated unit."""

    unit: str = ""
    by: str = ""

    @property
    def si(self) -> str:
        """Return the SI unit of its dimension, or an empty text if unknown."""
        return si_of(self.unit)


@dataclass(frozen=True)
class Combination:
    """Units of clock, position and speed, and how unlikely they are together. Empty clock: stated, or a counter."""

    clock: str
    position: str
    speed: str
    unlikely: float

    @property
    def ratio(self) -> float:
        """Return the position's unit over the speed's, in seconds."""
        return factor_of(self.position) / factor_of(self.speed)


@dataclass(frozen=True)
class Ratio:
    """Result for position and speed: `raw` is dx / (v dt) in the log's units of both and in assumed seconds.

    `fitting` are the units that fit, the likeliest first; `correlation` states how reliably one follows the other.
    `tick` [s] is the step per count that the likeliest units require; 0 if the clock is not just a counter.
    """

    raw: float
    assumed: float
    correlation: float
    fitting: tuple[Combination, ...] = ()
    tick: float = 0.0

    def per_second(self, clock: str) -> float:
        """Return dx / (v dt), the time in seconds if the clock is in this unit (empty: as assumed, or its ticks)."""
        if self.tick:
            return self.raw * self.assumed / self.tick
        return self.raw * self.assumed / factor_of(clock) if clock else self.raw

    def off(self, units: Combination) -> float:
        """Return the relative deviation of the ratio from that of units."""
        return abs(self.per_second(units.clock) * units.ratio - 1.0)

    def certain(self, channels: Channels) -> bool:
        """Whether only one combination fits, well, and the names indicate the same.

        Without the names a gear might have that ratio: 1 m per turn is that of turns and 1/min. The rate of a counter
        follows from the ratio: it fits any units.
        """
        first = self.fitting[0]
        named = motion_kind("position", channels) == _KINDS[si_of(first.position)]
        # Within 1 % a single fit is certain.
        return named and not self.tick and len(self.fitting) == 1 and self.off(first) < 0.01 and first.unlikely < 1.0


def stated(channel: str, stream: Stream) -> Stated:
    """Return the unit in the header, else the unit at the end of the name."""
    if stream.unit and find_unit(stream.unit):
        return Stated(stream.unit, "log")
    unit = unit_in_name(channel.removeprefix("reference_"), own_name(stream))
    return Stated(unit, "name" if unit else "")


def motion_kind(channel: str, channels: Channels) -> str:
    """Return "angle" or "length" by unit or name; "raw" for counts, percent and volts; empty if unknown."""
    if channel not in channels.found:
        return ""
    stream = channels.found[channel].stream
    return _KINDS.get(stated(channel, stream).si, "raw") or motion_of(label(stream))


def seems_to_turn(channels: Channels) -> bool:
    """Whether a single joint turns by the name of its torque: no more than two turns, no name or unit of a length."""
    if channels.joints > 1 or "torque" not in channels.found:
        return False
    drive = channels.found["torque"].stream
    if not says("twist", label(drive)) or stated("torque", drive).si == "N":
        return False
    if any(motion_kind(name, channels) for name in ("position", "speed")):
        return False
    return "position" not in channels.found or channels.found["position"].stream.reach < 4.0 * math.pi


def ratio_of(channels: Channels, clock: DraftedClock | None, messages_si: bool) -> Ratio | None:
    """Return position over speed and all units that fit; None if one is missing or does not follow the other.

    `messages_si`: the type of the messages implies SI units.
    """
    if not {"position", "speed"} <= channels.found.keys():
        return None
    fit = motion.integral_fit(channels.found["position"].stream, channels.found["speed"].stream)
    if not math.isfinite(fit.slope) or fit.slope == 0.0:
        return None
    ratio = Ratio(fit.slope, clock.assumed if clock is not None else 1.0, fit.correlation)
    counts = clock is not None and clock.counts and not clock.told
    clocks = ("",) if clock is None or counts else clock.units()
    units = [
        Combination(unit, *pair, _unlikely(channels, pair) + 0.05 * rank + _rare(clock, unit))
        for rank, pair in enumerate(_PAIRS[:2] if messages_si else _pairs(channels))
        for unit in clocks
    ]
    units.sort(key=lambda item: item.unlikely)
    if counts:
        ratio = replace(ratio, tick=max(0.0, ratio.raw * ratio.assumed * units[0].ratio) if units else 0.0)
    # Within 2 % a ratio fits: jitter and filters change it by less.
    fitting = [item for item in units if ratio.off(item) <= 0.02 and (ratio.tick or not counts)]
    # Combinations that are less likely are not listed: stamps in minutes at 17 Hz.
    return replace(ratio, fitting=tuple(item for item in fitting if item.unlikely < fitting[0].unlikely + 2.5))


def rotation_unit(stream: Stream) -> str:
    """Return the unit of a speed of rotation, by its name."""
    name = label(stream)
    return "rpm" if says("rpm", name) else "rad/s" if says("rad_per_second", name) else ""


def whole_numbers(stream: Stream) -> bool:
    """Whether the values are counts: all integers, and many different ones."""
    return bool(np.array_equal(stream.known, np.rint(stream.known))) and len(np.unique(stream.known)) > 50


def implausible(unit: str, stream: Stream, joints: int) -> bool:
    """Whether values in this unit are beyond what machines reach: a travel of 50 m, a robot's joint at 90 rad."""
    return stream.reach > (_ROBOT_LIMITS if joints > 1 else _LIMITS).get(unit, math.inf)


def _pairs(channels: Channels) -> list[tuple[str, str]]:
    """Return possible units of position and speed: the header's if stated, a name's together with the usual ones."""
    position, speed = (stated(name, channels.found[name].stream) for name in ("position", "speed"))
    known = [(position.unit if position.by == "log" else p, speed.unit if speed.by == "log" else s) for p, s in _PAIRS]
    named = [(position.unit or p, speed.unit or s) for p, s in known]
    kinds = {motion_kind(name, channels) for name in ("position", "speed")} & {"length", "angle"}
    told = kinds if len(kinds) == 1 or (position.si and speed.si) else set()
    return [
        (p, s) for p, s in dict.fromkeys((*known, *named)) if si_of(s) == f"{si_of(p)}/s" and told <= {_KINDS[si_of(p)]}
    ]


def _rare(clock: DraftedClock | None, unit: str) -> float:
    return clock.unlikely(unit) if clock is not None and unit and not clock.told else 0.0


def _unlikely(channels: Channels, pair: tuple[str, str]) -> float:
    """Return how unlikely units of position and speed are, by what names, kinds of machine and values say."""
    kind = _KINDS[si_of(pair[0])]
    # m with mm/s; per minute is as usual
    mixed = kind == "length" and all(abs(factor_of(pair[0]) / factor_of(pair[1]) / t - 1.0) > 1e-9 for t in (1.0, 60.0))
    # If no word indicates otherwise, one joint slides and several rotate.
    usual = "angle" if channels.joints > 1 or seems_to_turn(channels) else "length"
    unlikely = 0.5 * mixed + 0.5 * (kind != usual)
    for channel, logged in zip(("position", "speed"), pair, strict=True):
        stream = channels.found[channel].stream
        told = stated(channel, stream)
        if told.by == "name":
            unlikely += 2.0 * (find_unit(told.unit) != find_unit(logged))
        elif not told.by:
            named = rotation_unit(stream) if channel == "speed" else ""
            unlikely += implausible(logged, stream, channels.joints) + (bool(named) and named != logged)
    return unlikely
