"""Find the columns that the machine file requests: by name, by name without its unit, or by number."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from difflib import get_close_matches
from typing import Literal

from cdtool.base.errors import RecordingError, nearest
from cdtool.base.findings import Finding
from cdtool.formats.channels.channel_map import ChannelMap, ChannelSource, TimeSource
from cdtool.formats.source import Source
from cdtool.recordings.recording import GROUND_TRUTH

# In [channels], the name of the clock that the container itself provides: `time = { column = "time", unit = "s" }`.
OWN_CLOCK = "time"
# `torque [Nm]`, `torque (Nm)`: a name and its unit. A number in brackets is an index, not a unit.
_BRACKET = re.compile(r"^(?P<name>.*?\S)\s*(?:\[(?P<square>[^\[\]]*)\]|\((?P<round>[^()]*)\))$")


def split_unit(name: str) -> tuple[str, str | None]:
    """Return name and unit: `torque [Nm]` -> ("torque", "Nm"); the unit is None if the name has no unit."""
    match = _BRACKET.match(name)
    if match is None:
        return name, None
    unit = (match["square"] if match["square"] is not None else match["round"]).strip()
    if unit in ("", ":") or unit.isdigit():
        return name, None
    return match["name"], unit


def column_key(column: str | int, names: Sequence[str]) -> str | None:
    """Return the full name of a column given by number (from 0), name, or name without its unit if that is unique.

    The result is None if there is no such column.
    """
    if isinstance(column, int):
        return names[column] if column < len(names) else None
    if column in names:
        return column
    short = [name for name in names if split_unit(name)[0] == column]
    return short[0] if len(short) == 1 else None


def wanted_keys(wanted: ChannelMap, names: Sequence[str]) -> list[str]:
    """Return the names of the columns that a channel map requests, without repetition and in the file's order.

    Ground truth may be absent, because the load cell is fitted for impact tests only. Raises RecordingError if any
    other column is missing.
    """
    resolved, _ = _resolved(wanted, names)
    keys = {resolved.time.key, resolved.time.nanoseconds_key}.union(*(source.keys for source in resolved.sources))
    return [name for name in names if name and name in keys]


def requested_keys(wanted: ChannelMap | None, names: Sequence[str]) -> list[str]:
    """Return the columns that a map requests (all if there is no map), except the container's own clock."""
    if wanted is None:
        return list(names)
    if wanted.time.column == OWN_CLOCK and OWN_CLOCK not in names:
        wanted = replace(wanted, time=TimeSource())
    return wanted_keys(wanted, names)


def find_key(channel: str, column: str | int, names: Sequence[str]) -> str:
    """Return the name of one column; raises RecordingError naming file, channel, column and the nearest known names."""
    key = column_key(column, names)
    if key is not None:
        return key
    if isinstance(column, int):
        raise RecordingError(
            f"no column {column} (channel '{channel}')",
            f"the file has {len(names)} columns, numbered from 0 to {len(names) - 1}",
            channel=channel,
        )
    numbers = _numbers_of(column, names)
    if len(numbers) > 1:
        raise RecordingError(
            f"{len(numbers)} columns have the name '{column}' (channel '{channel}')",
            f"give the column's number instead: {' or '.join(numbers)}",
            channel=channel,
        )
    raise RecordingError(f"no column '{column}' (channel '{channel}')", nearest(column, names), channel=channel)


def is_absent(column: str | int, names: Sequence[str]) -> bool:
    """Return whether no column has that name or number; a name of several columns is not absent."""
    return column_key(column, names) is None and (isinstance(column, int) or not _numbers_of(column, names))


def resolve_columns(source: Source, channels: ChannelMap) -> tuple[Source, ChannelMap]:
    """Return the source and the map with the file's own column names (`keys`), without ground truth that is missing.

    Each missing ground truth is a note in the source's findings. The clock that the container itself provides is not a
    column. Raises RecordingError if any other column is missing, or if several columns have the same name.
    """
    names = tuple(source.columns) if channels.topics else source.names or tuple(source.columns)
    own = channels.time.column == OWN_CLOCK and any(column.time is not None for column in source.columns.values())
    plain = replace(channels, time=TimeSource()) if own else channels
    resolved, absent = _resolved(plain, names)
    resolved = replace(resolved, time=channels.time) if own else resolved
    what: Literal["column", "topic"] = "topic" if channels.topics else "column"
    notes = [
        Finding("absent_truth", cell.channel, {"what": what, "name": cell.described, "similar": _similar(cell, names)})
        for cell in absent
    ]
    return replace(source, findings=(*source.findings, *notes)), resolved


def _resolved(channels: ChannelMap, names: Sequence[str]) -> tuple[ChannelMap, list[ChannelSource]]:
    """Return the map with the file's own column names, and the ground truth that is missing from the file."""
    asked = [(each, (each.described,) if channels.topics else each.columns) for each in channels.sources]
    absent = [
        source
        for source, columns in asked
        if source.channel in GROUND_TRUTH and any(is_absent(column, names) for column in columns)
    ]
    time = channels.time
    if time.column is not None:
        time = replace(time, key=find_key("time", time.column, names))
    if time.nanoseconds is not None:
        time = replace(time, nanoseconds_key=find_key("time", time.nanoseconds, names))
    sources = tuple(
        replace(source, keys=tuple(find_key(source.channel, column, names) for column in columns))
        for source, columns in asked
        if source not in absent
    )
    return replace(channels, time=time, sources=sources), absent


def _similar(source: ChannelSource, names: Sequence[str]) -> str:
    return next(iter(get_close_matches(source.described, names, n=1, cutoff=0.6)), "")


def _numbers_of(column: str, names: Sequence[str]) -> list[str]:
    """Return the numbers of all columns with this name, whatever their units."""
    return [str(i) for i, name in enumerate(names) if column in (name.partition("#")[0], split_unit(name)[0])]
