"""Does a log's header measure a channel in the unit that the machine file states for it?"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import numpy as np

from cdtool.channels import ChannelMap, ChannelSource, TimeSource
from cdtool.clock.plausible_unit import SECONDS, both_readings, contradicted_by_epoch, contradicted_by_steps
from cdtool.columns import Column
from cdtool.errors import RecordingError
from cdtool.findings import Finding
from cdtool.findings.channels import UnitContradicted
from cdtool.findings.clocks import ClockUnitContradicted, StepsImplausible
from cdtool.formats.column_names import split_unit
from cdtool.formats.source import Source
from cdtool.units import RAW_UNITS, Unit, find_unit

# Plain numbers, whatever they are called.
_PLAIN = ("1", "count")
# A scale that makes up for another unit is often rounded: 0.1047 for rpm. No two units of one kind are so close.
_ROUNDED = 1e-3


def unit_findings(source: Source, channels: ChannelMap) -> list[Finding]:
    """A warning for each channel whose columns' units contradict the machine file, in kind or by a factor.

    An explicit scale that leads from the header's unit to the channel's is no contradiction; a header without a unit,
    with one that is not known, or with "1", says nothing. The map's columns are resolved (resolve_columns).
    """
    findings = []
    for item in channels.sources:
        findings += channel_unit_findings(item, [source.columns[key] for key in item.keys])
    return findings


def channel_unit_findings(item: ChannelSource, columns: Sequence[Column]) -> list[Finding]:
    """The warnings of one channel, one for each unit that contradicts: `columns` are those of its joints."""
    stated = find_unit(item.stated) if item.stated else None
    if stated is None:
        return []
    by_unit: dict[str, list[Column]] = {}
    for column, factor in zip(columns, item.factor, strict=False):
        told = find_unit(column.unit) if column.unit else None
        if told is not None and not _fits(told, stated, item.unit, abs(factor)):
            by_unit.setdefault(str(column.unit), []).append(column)
    return [Finding(_contradiction(item, stated, unit, found), item.channel) for unit, found in by_unit.items()]


def check_clock_unit(path: Path, time: TimeSource, column: Column, origin: float = 0.0) -> list[Finding]:
    """The warning on a clock whose steps no log has in the unit that the machine file states.

    `origin` [s in that unit] has been taken off the stamps.
    Raises RecordingError where its stamps cannot be times in that unit, and count from 1970 in another one.
    """
    if time.rate is not None:
        return []
    first = _first_stamp(time, column, origin)
    stated, told = time.unit or "s", find_unit(column.unit) if column.unit else None
    header = _shown(column) if told == Unit("s", time.factor) else ""
    meant = contradicted_by_epoch(first, time.factor)
    if meant:
        also = f", as its header says '{header}'" if header else ""
        raise RecordingError(
            f"{path}: the machine file states {stated} for the clock '{column.name}'{also}, but "
            f"{both_readings(first, time.factor, stated, meant)}",
            f'write time = {{ column = "{column.name}", unit = "{meant}" }} in [channels]',
        )
    likely, step = contradicted_by_steps(column.values, time.factor)
    if not likely:
        return []
    rate = time.factor / (step * SECONDS[likely])
    return [Finding(StepsImplausible(step, stated, header, likely, rate), "time")]


def time_unit_findings(time: TimeSource, column: Column, origin: float = 0.0) -> list[Finding]:
    """The warning on a clock whose column has another unit than the machine file states, or is no time at all.

    None where the stamps count from 1970 in the unit of the machine file: the header is wrong, and nothing is to do.
    """
    told = find_unit(column.unit) if column.unit else None
    if told is not None and told.si == "s":
        meant = contradicted_by_epoch(_first_stamp(time, column, origin), told.factor)
        if meant and math.isclose(SECONDS[meant], time.factor):
            return []
    if told is None or told.si in _PLAIN or (told.si == "s" and math.isclose(told.factor, time.factor)):
        return []
    ratio = _ratio(told, Unit("s", time.factor))
    fact = ClockUnitContradicted(_shown(column), str(column.unit), time.unit or "s", time.rate or 0.0, ratio)
    return [Finding(fact, "time")]


def _first_stamp(time: TimeSource, column: Column, origin: float) -> float:
    """The first stamp as the file holds it, in the unit of the machine file; 0 where there is none."""
    known = np.flatnonzero(np.isfinite(column.values))
    return float(column.values[known[0]]) + origin / time.factor if len(known) else 0.0


def _fits(told: Unit, stated: Unit, channel_unit: str, factor: float) -> bool:
    if told == Unit("1", 1.0) and stated.si != "1":  # what some loggers write where they know no unit
        return True
    alike = told.si == stated.si or (told.si in _PLAIN and stated.si in _PLAIN)
    if stated.si == "SI":  # of joints of both kinds each has its own SI unit
        alike = told.si not in RAW_UNITS
    if alike and math.isclose(told.factor, stated.factor):
        return True
    return told.si == channel_unit and math.isclose(told.factor, factor, rel_tol=_ROUNDED)


def _contradiction(item: ChannelSource, stated: Unit, unit: str, columns: Sequence[Column]) -> UnitContradicted:
    told = find_unit(unit)
    assert told is not None
    advice: Literal["unit", "unit and scale", "unit without scale", "other column"] = "unit"
    if item.duty is None and told.si in RAW_UNITS and stated.si != told.si:
        advice = "unit and scale"
    elif told.si == item.unit and stated.si in RAW_UNITS:
        advice = "unit without scale"
    elif told.si not in (item.unit, stated.si, *RAW_UNITS):
        advice = "other column"
    scale = f"{item.unit} per {told.si}" if advice == "unit and scale" else ""
    header, ratio = _shown(columns[0]), _ratio(told, stated)
    return UnitContradicted(header, unit, len(columns) - 1, str(item.stated), ratio, advice, scale)


def _ratio(told: Unit, stated: Unit) -> float:
    """By how much values of one kind are wrong where the header is right; 0 for units of two kinds."""
    if told.si != stated.si:
        return 0.0
    ratio = told.factor / stated.factor
    return max(ratio, 1.0 / ratio)


def _shown(column: Column) -> str:
    return column.name if split_unit(column.name)[1] is not None else f"{column.name} [{column.unit}]"
