"""The clock in the draft: its column and unit, or the rate of what only counts, with the reason and the doubts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from cdtool.commands.init.names.units import fits_as_well
from cdtool.commands.init.names.units_in_names import factor_of, unit_in_name
from cdtool.commands.init.speed_ratio import Ratio, ratio_of
from cdtool.commands.init.streams import Channels, column_key
from cdtool.commands.init.table_clock import DraftedClock

# Below this rate [Hz] the unit that a header states for its clock is doubtful: no log of contacts is so slow.
_SLOWEST = 2.0


@dataclass(frozen=True)
class Clock:
    """The keys of `time`, the reason, what to check, and the unit of the streams' times [s]; 0 for a placeholder."""

    keys: Mapping[str, object]
    why: str
    check: str = ""
    in_seconds: float = 0.0


def draft_clock(channels: Channels, clock: DraftedClock | None, ratio: Ratio | None, geared: bool) -> Clock:
    """Return the clock of a table; `geared`: position and speed are of two sides of a gear."""
    if clock is None:
        text = "a placeholder: no column looks like a clock: give the rate, or a column with its unit"
        return Clock({"rate_hz": 1000.0}, "", text)
    why, check, rate, unit = "its name or its steps", "", 0.0, clock.unit
    if (named := unit_in_name("time", clock.column)) and not clock.counts:
        why += f", although its name ends with {named}"
    if clock.told:
        why, check = clock.told, "" if geared else _doubt(channels, clock, ratio)
    elif ratio is not None and ratio.fitting:
        first = ratio.fitting[0]
        pair = f"{first.position} and {first.speed}"
        if ratio.tick:
            why, rate = f"{why}; rate: with {pair}", 1.0 / ratio.tick
            check = f"counts, not a time: the rate is correct if position and speed are in {pair}"
        else:
            why, unit = f"{why}; unit: steps of {clock.step:.4g} {first.clock}, with {pair}", first.clock
            check = f"the unit is not stated; {fits_as_well(ratio, False) or 'no other fits the ratio'}"
    elif clock.counts:
        rate = 1000.0 / clock.step
        check = "counts, not a time: 1000 steps per second is a placeholder; give the rate"
    else:
        rates = ", ".join(f"{1.0 / (clock.step * factor_of(unit)):.6g} Hz in {unit}" for unit in clock.units())
        check = f"the unit is not stated: steps of {clock.step:.4g} are {rates}"
    keys = {"column": column_key(clock.column)}
    if rate:
        seconds = ratio.tick if ratio is not None else 0.0
        return Clock({**keys, "rate_hz": float(f"{rate:.5g}")}, why, check, seconds / clock.assumed)
    return Clock({**keys, "unit": unit}, why, check, factor_of(unit) / clock.assumed)


def _doubt(channels: Channels, clock: DraftedClock, ratio: Ratio | None) -> str:
    """Return the doubt about a clock's unit that is only written: another fits the ratio, or the rate is too low."""
    rate = 1.0 / (clock.step * factor_of(clock.unit))
    if not clock.written:
        return ""
    if ratio is not None and not ratio.fitting:
        other = ratio_of(channels, replace(clock, told=""), messages_si=False)
        if other is not None and other.fitting and not other.tick:
            first = other.fitting[0]
            return f"{first.clock} with {first.position}, {first.speed} fits the ratio, {clock.unit} does not"
    return f"steps of {clock.step:.4g} {clock.unit} are {rate:.3g} Hz" if rate < _SLOWEST else ""
