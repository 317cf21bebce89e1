"""Find a table's clock column and its unit; without a stated unit, its steps and the ratio determine it."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

import numpy as np

from cdtool.commands.init.names.units_in_names import factor_of, unit_in_name
from cdtool.commands.init.names.words import BOUND, is_counter, name_in_group, says, word_for, words
from cdtool.formats.channels.clock_guess import GuessedClock, guess_clock
from cdtool.formats.columns import Column
from cdtool.formats.source import Source
from cdtool.recordings.recording import MEASURED
from cdtool.recordings.units import DAY_S, find_unit

_NANOSECONDS = re.compile(r"(?<![a-z])n(?:ano)?s(?:ecs?|econds?)?$", re.IGNORECASE)
_UNITS = ("s", "ms", "us", "ns", "min")
# Sampling rates [Hz] that logs of a machine usually have, and those that are possible.
_USUAL, _POSSIBLE = (20.0, 20e3), (0.5, 500e3)
_RARE = 2.0  # minutes are this much less likely than an unusual rate


@dataclass(frozen=True)
class DraftedClock:
    """A table's clock: the median `step` of its stamps, in its own unit, its jitter, and the seconds assumed per unit.

    `jitter` is the median deviation of a step, as a share of the median one. `told` is the source of the unit; if it is
    empty, `unit` is guessed from the steps. `written`: this source is only a text, the header or the column's name,
    which the motion may contradict.
    """

    column: str
    step: float
    assumed: float
    unit: str
    told: str
    counts: bool = False
    written: bool = False
    jitter: float = 0.0

    def units(self) -> tuple[str, ...]:
        """Return the possible units of its stamps; empty for a counter."""
        if self.told:
            return (self.unit,)
        return () if self.counts else tuple(unit for unit in _UNITS if self.unlikely(unit) < 2 * _RARE)

    def unlikely(self, unit: str) -> float:
        """Return 0 if the unit gives a usual sampling rate, more otherwise."""
        rate = 1.0 / (self.step * factor_of(unit))
        # Above 2 kHz samples are timed by hardware: a jitter of more than 2 % of the step is unlikely.
        rare = _RARE if unit == "min" else 1.5 if rate > 2e3 and self.jitter > 0.02 else 0.0
        if _USUAL[0] <= rate <= _USUAL[1]:
            return rare
        return 1.0 + rare if _POSSIBLE[0] <= rate <= _POSSIBLE[1] else 2 * _RARE


def table_clock(source: Source) -> tuple[DraftedClock, GuessedClock] | None:
    """Return the clock of a table and its times; None if no column looks like a clock."""
    found = _named(source) or _unnamed(source)
    if found is None:
        return None
    column, guess = source.columns[found.column], found.findings[0].numbers
    steps = np.diff(column.values[np.isfinite(column.values)])
    step = float(np.median(steps))
    jitter = float(np.median(np.abs(steps - step))) / abs(step) if step else 0.0
    # Numbers that rise by one without a name are those of the rows; the rate follows from position and speed.
    is_row = not re.search(r"[^\W\d_]", found.column) and bool((steps == 1.0).all())
    unit, days = guess["unit"], guess["unit"] == "days"
    assumed = DAY_S if days else factor_of(unit)
    clock = DraftedClock(found.column, step, assumed, unit, "", is_counter(found.column) or is_row, jitter=jitter)
    if guess["evidence"] == "header":
        return replace(clock, told="the header, which states the unit", written=True), found
    if guess["evidence"] != "steps":
        start = f"{guess['start']:.9g} days of Excel" if days else f"{guess['start']:.0f} after 1970"
        against = any(item.kind == "header_unit_implausible" for item in found.findings)
        told = f"its start, {start}" + (f", although its header states {column.unit}" if against else "")
        # The reader of a table converts days to seconds.
        return replace(clock, unit="s" if days else unit, told=told), found
    named = unit_in_name("time", found.column)
    if named and clock.unlikely(named) < 2 * _RARE:
        return replace(clock, unit=named, told="the unit in its name", written=True), found
    return replace(clock, unit=min(clock.units() or (unit,), key=clock.unlikely)), found


def split_stamp(source: Source) -> tuple[str, str] | None:
    """Return the columns of a stamp of seconds and of the nanoseconds within each, by their names; None without."""
    for name, column in source.columns.items():
        ending = _NANOSECONDS.search(name)
        if ending is None or column.values.ndim != 1 or not np.nanmax(column.values, initial=0.0) < 1e9:
            continue
        whole = re.compile(re.escape(name[: ending.start()]) + "s(?:ecs?|econds?)?", re.IGNORECASE)
        for other in filter(whole.fullmatch, source.columns):
            if not np.nanmax(source.columns[other].values % 1.0, initial=0.0):
                return other, name
    return None


def _named(source: Source) -> GuessedClock | None:
    """Return the clock among columns with the name or unit of a time.

    If possible a complete one, not a counter, with a name, with a unit, and named as nothing but a time: `timestamp`
    rather than `positionTimestamp`.
    """
    names = [
        name
        for name, column in source.columns.items()
        if column.time is None and column.values.ndim == 1 and (_has_time_unit(column) or _has_clock_name(name))
    ]

    def rank(name: str) -> tuple[bool, ...]:
        column = source.columns[name]
        known = column.values[np.isfinite(column.values)]
        # With steps of exactly 1 a column counts samples, whatever its name.
        counts = is_counter(name) or bool(np.mean(np.diff(known) == 1.0) > 0.9) if len(known) > 1 else True
        plain = all(says("clock", word) for word in words(name))
        return len(known) < len(column.values), counts, name.isdigit(), not _has_time_unit(column), not plain

    for name in sorted(names, key=rank):
        found = guess_clock(replace(source, columns={name: source.columns[name]}))
        if found is not None and not _wraps(source.columns[name]):
            return found
    return None


def _unnamed(source: Source) -> GuessedClock | None:
    """Return the first column that rises like a clock and whose name and unit are not those of a measured value."""
    columns = {
        name: column
        for name, column in source.columns.items()
        if not _wraps(column) and not _is_measured(name) and (not column.unit or _has_time_unit(column))
    }
    return guess_clock(replace(source, columns=columns)) if columns else None


def _is_measured(name: str) -> bool:
    # A word for a quantity in the name of a clock makes it doubtful: `t_pos`.
    return any(word_for(quantity, name)[0] >= BOUND for quantity in (*MEASURED, "force"))


def _has_clock_name(name: str) -> bool:
    own = name_in_group(name)
    return bool(says("clock", own)) and not _is_measured(own)


def _has_time_unit(column: Column) -> bool:
    known = find_unit(column.unit) if column.unit else None
    return known is not None and known.si == "s"


def _wraps(column: Column) -> bool:
    """Whether a column restarts after each full unit: nanoseconds within a second are no clock."""
    known = column.values[np.isfinite(column.values)] if column.values.ndim == 1 else np.empty(0)
    steps = np.diff(known)
    back = steps[steps < 0.0]
    # Fractions of a second wrap at a power of ten, at least twice.
    if len(back) < 2:
        return False
    turns = np.log10(float(np.median(steps[steps > 0.0])) - back) if (steps > 0.0).any() else np.zeros(1)
    powers = np.rint(turns)
    return bool(np.all(np.abs(turns - powers) < 0.02) and np.ptp(powers) == 0.0 and powers[0] > 2.0)
