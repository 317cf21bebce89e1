"""Check the units in a log's header against those in the machine file."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from unicodedata import normalize

import numpy as np

from cdtool.base.errors import RecordingError
from cdtool.base.findings import Finding, Severity
from cdtool.formats.channels.channel_map import ChannelMap, ChannelSource, TimeSource
from cdtool.formats.column_names import split_unit
from cdtool.formats.columns import Column
from cdtool.formats.source import Source
from cdtool.recordings.clock.plausible_unit import SECONDS, both_readings, contradicted_by_epoch, contradicted_by_steps
from cdtool.recordings.recording import CONTACT_PRESSURE, RIG_UNITS
from cdtool.recordings.units import RAW_UNITS, Unit, find_unit

# Units of plain numbers.
_PLAIN = ("1", "count")
# Where the name of a force may state its unit: `F [kN] filtered`, `Kraft in daN`, `kN_Kraft`, `ForcekN`; not `F_N`, a
# normal force. With a factor beside it the unit is unknown: `Kraft [N]*1000`, `Kraft x10`, `Kraft 10 N`.
_IN_NAME = re.compile(
    r"[\[({<]([^\[\](){}<>]+)[\])}>]|(?<![^\W_])(?=([^\W_]{2,}))|(?<=[a-z])((?:da|[hkK])N|Kgf?|Kp|Lbf?)(?![^\W_])"
)
_FACTOR = re.compile(r"(?:(?<![^\W\d_])x|[*×·]|(?<!\w)/)\s*10+(?!\d)|(?<![\w.,])10+\s?N\b", re.IGNORECASE)


def unit_findings(source: Source, channels: ChannelMap) -> list[Finding]:
    """Return a loss for each channel whose columns have units that contradict the machine file, in kind or factor.

    An explicit scale that converts the header's unit to the channel's is not a contradiction, and a unit that the
    machine file confirms is none either. A text in the place of the unit that is not a unit is a note, as is a force's
    unit that the machine file guesses; of a pressure a loss, as that is only compared with limits. The map's columns
    are resolved (resolve_columns); topics state no units.
    """
    findings = []
    for item in channels.sources:
        found = [] if channels.topics else channel_unit_findings(item, [source.columns[key] for key in item.keys])
        if not found and item.unit_confirmed is False and item.channel in RIG_UNITS:
            found = [_unknown(item, "confirm", {"header": "", "header_unit": "", "more": 0})]
        findings += found
    return findings


def channel_unit_findings(item: ChannelSource, columns: Sequence[Column]) -> list[Finding]:
    """Return the findings of one channel, one per contradicting unit; `columns` are those of its joints."""
    stated = find_unit(item.stated) if item.stated else None
    if stated is None or item.unit_confirmed:
        return []
    by_unit: dict[str, list[Column]] = {}
    for column, factor in zip(columns, item.factor, strict=False):
        text = _unit_text(item, column, abs(factor))
        header_unit = find_unit(text) if text else None
        if text and (header_unit is None or not _fits(header_unit, stated, item, abs(factor))):
            by_unit.setdefault(text, []).append(column)
    return [_contradiction(item, stated, unit, columns) for unit, columns in by_unit.items()]


def _unit_text(item: ChannelSource, column: Column, factor: float) -> str | None:
    """Return the text in the place of a column's unit; of a force or pressure first one that contradicts."""
    if item.channel not in RIG_UNITS:
        return column.unit
    name = normalize("NFKC", column.name)
    if (found := _FACTOR.search(name)) and find_unit(column.unit or "N"):
        return found[0]
    known, stated = {}, find_unit(item.stated)
    for text in (column.unit or "", *("".join(found) for found in _IN_NAME.findall(name))):
        if text and (unit := find_unit(text)) and unit.si in (item.unit, "V"):
            known[text] = stated is not None and _fits(unit, stated, item, factor)
    bare = "1" if column.name.endswith((" [1]", " (1)")) else None
    return min(known, key=lambda text: known[text]) if known else column.unit or bare


def clock_unit_findings(time: TimeSource, column: Column, origin: float = 0.0) -> list[Finding]:
    """Return the warnings on a clock with implausible steps, or of another unit than the machine file states.

    `origin`, in seconds according to that unit, has been subtracted from the time stamps. If these count from 1970 in
    the machine file's unit, a header that differs is wrong, which is not reported. Raises RecordingError if the time
    stamps cannot be times in that unit, but are times since 1970 in another one.
    """
    first, stated = _first_stamp(time, column, origin), time.unit or "s"
    header_unit, findings = find_unit(column.unit) if column.unit else None, list[Finding]()
    if time.rate is None:
        header = _header_text(column) if header_unit == Unit("s", time.factor) else ""
        if meant := contradicted_by_epoch(first, time.factor):
            also = f", as its header says '{header}'" if header else ""
            readings = {"readings": both_readings(first, time.factor, stated, meant)}
            raise RecordingError(
                f"the machine file states {stated} for the clock '{column.name}'{also}, but "
                f"{Finding('header_unit_implausible', '', readings).words_for('readings')}",
                f'write time = {{ column = "{column.name}", unit = "{meant}" }} in [channels]',
            )
        likely, step = contradicted_by_steps(column.values, time.factor)
        if likely:
            rate = time.factor / (step * SECONDS[likely])
            known = {"step": step, "stated": stated, "header": header, "likely": likely, "rate": rate}
            findings.append(Finding("steps_implausible", "time", known))
    if header_unit is None or header_unit.si in _PLAIN:
        return findings
    if header_unit.si == "s":
        meant = contradicted_by_epoch(first, header_unit.factor)
        if math.isclose(header_unit.factor, time.factor) or (meant and math.isclose(SECONDS[meant], time.factor)):
            return findings
    fact = {
        "header": _header_text(column),
        "header_unit": str(column.unit),
        "stated": stated,
        "rate": time.rate or 0.0,
        "ratio": _ratio(header_unit, Unit("s", time.factor)),
    }
    return [*findings, Finding("clock_unit_contradicted", "time", fact)]


def _first_stamp(time: TimeSource, column: Column, origin: float) -> float:
    """Return the first time stamp as in the file, in the unit of the machine file; 0 if all are missing."""
    finite = np.isfinite(column.values)
    first = int(np.argmax(finite)) if len(finite) else 0
    return float(column.values[first]) + origin / time.factor if len(finite) and finite[first] else 0.0


def _fits(header_unit: Unit, stated: Unit, item: ChannelSource, factor: float) -> bool:
    if header_unit == Unit("1", 1.0) and stated.si != "1":  # some loggers write "1" if the unit is unknown
        return item.channel not in RIG_UNITS
    if header_unit.si in RAW_UNITS and stated.si == header_unit.si and item.channel in RIG_UNITS:
        return not math.isclose(factor, stated.factor)  # the scale 1 is that of a draft
    if header_unit.si in RAW_UNITS and stated.si == item.unit and not math.isclose(factor, stated.factor):
        return True  # the scale is a torque constant, or converts percent of the rated torque
    same_kind = header_unit.si == stated.si or (header_unit.si in _PLAIN and stated.si in _PLAIN)
    if stated.si == "SI":  # linear and rotary joints together: each has its own SI unit
        same_kind = header_unit.si not in RAW_UNITS
    if same_kind and math.isclose(header_unit.factor, stated.factor):
        return True
    # A scale that converts another unit is often rounded: 0.1047 for rpm. No two units of one kind are this close.
    return header_unit.si == item.unit and math.isclose(header_unit.factor, factor, rel_tol=1e-3)


def _contradiction(item: ChannelSource, stated: Unit, unit: str, columns: Sequence[Column]) -> Finding:
    header_unit = find_unit(unit)
    known = {"header": _header_text(columns[0]), "header_unit": unit, "more": len(columns) - 1}
    if header_unit is None or (unit == "1" and item.channel in RIG_UNITS):
        return _unknown(item, "no unit", known)
    advice = "unit"
    if item.duty is None and header_unit.si in RAW_UNITS and (stated.si != header_unit.si or item.channel in RIG_UNITS):
        advice = "unit and scale"
    elif header_unit.si == item.unit and stated.si in RAW_UNITS:
        advice = "unit without scale"
    elif header_unit.si not in (item.unit, stated.si, *RAW_UNITS):
        advice = "other column"
    scale = f"{item.unit} per {header_unit.si}" if advice == "unit and scale" else ""
    numbers = {**known, "stated": item.stated, "advice": advice, "ratio": _ratio(header_unit, stated), "scale": scale}
    return Finding("unit_contradicted", item.channel, numbers)


def _unknown(item: ChannelSource, advice: str, header: Mapping[str, object]) -> Finding:
    """Return the finding on a unit that neither the header nor the machine file knows."""
    severity: Severity = "loss" if item.channel == CONTACT_PRESSURE else "note"
    numbers = {**header, "stated": item.stated, "advice": advice, "ratio": 0.0, "scale": ""}
    return Finding("unit_contradicted", item.channel, numbers, severity)


def _ratio(header_unit: Unit, stated: Unit) -> float:
    """Return the factor by which values are wrong if the header is right; 0 for units of different kinds."""
    if header_unit.si != stated.si or header_unit == stated:
        return 0.0
    ratio = header_unit.factor / stated.factor
    return max(ratio, 1.0 / ratio)


def _header_text(column: Column) -> str:
    is_named = column.unit is None or split_unit(column.name)[1] is not None
    return column.name if is_named else f"{column.name} [{column.unit}]"
