"""Check the units in a log's header against those in the machine file."""

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

# Units of plain numbers.
_PLAIN = ("1", "count")
# A scale that converts another unit is often rounded: 0.1047 for rpm. No two units of one kind are this close.
_ROUNDED = 1e-3


def unit_findings(source: Source, channels: ChannelMap) -> list[Finding]:
    """Return a warning for each channel whose columns have units that contradict the machine file, in kind or factor.

    An explicit scale that converts the header's unit to the channel's is not a contradiction. A header without a unit,
    with an unknown one, or with "1" is not checked. The map's columns are resolved (resolve_columns).
    """
    findings = []
    for item in channels.sources:
        findings += channel_unit_findings(item, [source.columns[key] for key in item.keys])
    return findings


def channel_unit_findings(item: ChannelSource, columns: Sequence[Column]) -> list[Finding]:
    """Return the warnings of one channel, one per contradicting unit; `columns` are those of its joints."""
    stated = find_unit(item.stated) if item.stated else None
    if stated is None:
        return []
    by_unit: dict[str, list[Column]] = {}
    for column, factor in zip(columns, item.factor, strict=False):
        header_unit = find_unit(column.unit) if column.unit else None
        if header_unit is not None and not _fits(header_unit, stated, item.unit, abs(factor)):
            by_unit.setdefault(str(column.unit), []).append(column)
    return [Finding(_contradiction(item, stated, unit, columns), item.channel) for unit, columns in by_unit.items()]


def check_clock_unit(path: Path, time: TimeSource, column: Column, origin: float = 0.0) -> list[Finding]:
    """Return the warning on a clock whose steps are implausible in the unit that the machine file states.

    `origin`, in seconds according to that unit, has been subtracted from the time stamps. Raises RecordingError if the
    time stamps cannot be times in that unit, but are times since 1970 in another one.
    """
    if time.rate is not None:
        return []
    first = _first_stamp(time, column, origin)
    stated, header_unit = time.unit or "s", find_unit(column.unit) if column.unit else None
    header = _header_text(column) if header_unit == Unit("s", time.factor) else ""
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
    """Return the warning on a clock whose column has another unit than the machine file states, or is not a time.

    If the time stamps count from 1970 in the machine file's unit, the header is wrong and there is no warning.
    """
    header_unit = find_unit(column.unit) if column.unit else None
    if header_unit is not None and header_unit.si == "s":
        meant = contradicted_by_epoch(_first_stamp(time, column, origin), header_unit.factor)
        if meant and math.isclose(SECONDS[meant], time.factor):
            return []
    if header_unit is None or header_unit.si in _PLAIN:
        return []
    if header_unit.si == "s" and math.isclose(header_unit.factor, time.factor):
        return []
    ratio = _ratio(header_unit, Unit("s", time.factor))
    fact = ClockUnitContradicted(_header_text(column), str(column.unit), time.unit or "s", time.rate or 0.0, ratio)
    return [Finding(fact, "time")]


def _first_stamp(time: TimeSource, column: Column, origin: float) -> float:
    """Return the first time stamp as in the file, in the unit of the machine file; 0 if all are missing."""
    finite = np.isfinite(column.values)
    first = int(np.argmax(finite)) if len(finite) else 0
    return float(column.values[first]) + origin / time.factor if len(finite) and finite[first] else 0.0


def _fits(header_unit: Unit, stated: Unit, channel_unit: str, factor: float) -> bool:
    if header_unit == Unit("1", 1.0) and stated.si != "1":  # some loggers write "1" if the unit is unknown
        return True
    same_kind = header_unit.si == stated.si or (header_unit.si in _PLAIN and stated.si in _PLAIN)
    if stated.si == "SI":  # linear and rotary joints together: each has its own SI unit
        same_kind = header_unit.si not in RAW_UNITS
    if same_kind and math.isclose(header_unit.factor, stated.factor):
        return True
    return header_unit.si == channel_unit and math.isclose(header_unit.factor, factor, rel_tol=_ROUNDED)


def _contradiction(item: ChannelSource, stated: Unit, unit: str, columns: Sequence[Column]) -> UnitContradicted:
    header_unit = find_unit(unit)
    assert header_unit is not None
    advice: Literal["unit", "unit and scale", "unit without scale", "other column"] = "unit"
    if item.duty is None and header_unit.si in RAW_UNITS and stated.si != header_unit.si:
        advice = "unit and scale"
    elif header_unit.si == item.unit and stated.si in RAW_UNITS:
        advice = "unit without scale"
    elif header_unit.si not in (item.unit, stated.si, *RAW_UNITS):
        advice = "other column"
    scale = f"{item.unit} per {header_unit.si}" if advice == "unit and scale" else ""
    header, ratio = _header_text(columns[0]), _ratio(header_unit, stated)
    return UnitContradicted(header, unit, len(columns) - 1, str(item.stated), ratio, advice, scale)


def _ratio(header_unit: Unit, stated: Unit) -> float:
    """Return the factor by which values are wrong if the header is right; 0 for units of different kinds."""
    if header_unit.si != stated.si:
        return 0.0
    ratio = header_unit.factor / stated.factor
    return max(ratio, 1.0 / ratio)


def _header_text(column: Column) -> str:
    return column.name if split_unit(column.name)[1] is not None else f"{column.name} [{column.unit}]"
