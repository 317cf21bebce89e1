"""Which columns of a file the machine file names: by name, by name without its unit, or by number."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from difflib import get_close_matches
from pathlib import Path
from typing import Literal

from cdtool.channels import ChannelMap, ChannelSource, TimeSource
from cdtool.errors import RecordingError, nearest
from cdtool.findings import Finding
from cdtool.findings.channels import AbsentTruth
from cdtool.formats.source import Source
from cdtool.recording import GROUND_TRUTH

# What [channels] calls the clock that a container itself knows: `time = { column = "time", unit = "s" }`.
OWN_CLOCK = "time"
# `torque [Nm]`, `torque (Nm)`: a name and its unit. A number in the bracket is an index, not a unit.
_BRACKET = re.compile(r"^(?P<name>.*?\S)\s*(?:\[(?P<square>[^\[\]]*)\]|\((?P<round>[^()]*)\))$")


def split_unit(name: str) -> tuple[str, str | None]:
    """`torque [Nm]` -> ("torque", "Nm"); a name without a unit comes back whole, with None."""
    match = _BRACKET.match(name)
    if match is None:
        return name, None
    unit = (match["square"] if match["square"] is not None else match["round"]).strip()
    if unit in ("", ":") or unit.isdigit():
        return name, None
    return match["name"], unit


def column_key(column: str | int, names: Sequence[str]) -> str | None:
    """The name of a column given by number (from 0), by name, or by its name without the unit if that is unique."""
    if isinstance(column, int):
        return names[column] if column < len(names) else None
    if column in names:
        return column
    short = [name for name in names if split_unit(name)[0] == column]
    return short[0] if len(short) == 1 else None


def wanted_keys(path: Path, wanted: ChannelMap, names: Sequence[str]) -> list[str]:
    """The names of the columns that a channel map asks for, each once, in the file's order; raises RecordingError.

    Ground truth may be absent: the load cell is fitted for impact tests only.
    """
    resolved, _ = _resolved(path, wanted, names)
    keys = {resolved.time.key, *(key for item in resolved.sources for key in item.keys)} - {""}
    return [name for name in names if name in keys]


def asked_keys(path: Path, wanted: ChannelMap | None, names: Sequence[str]) -> list[str]:
    """The columns that a map asks for (all without one); the container's own clock is none of them."""
    if wanted is None:
        return list(names)
    if wanted.time.column == OWN_CLOCK and OWN_CLOCK not in names:
        wanted = replace(wanted, time=TimeSource())
    return wanted_keys(path, wanted, names)


def find_key(path: Path, channel: str, column: str | int, names: Sequence[str]) -> str:
    """The name of one column; raises RecordingError naming file, channel, column and the nearest known ones."""
    key = column_key(column, names)
    if key is not None:
        return key
    if isinstance(column, int):
        raise RecordingError(
            f"{path}: no column {column} (channel '{channel}')",
            f"the file has {len(names)} columns, numbered from 0 to {len(names) - 1}",
            channel=channel,
        )
    same = _alike(column, names)
    if len(same) > 1:
        raise RecordingError(
            f"{path}: column '{column}' (channel '{channel}') is there {len(same)} times",
            f"give its number instead: {' or '.join(same)}",
            channel=channel,
        )
    raise RecordingError(f"{path}: no column '{column}' (channel '{channel}')", nearest(column, names), channel=channel)


def is_absent(column: str | int, names: Sequence[str]) -> bool:
    """True where no column has that name or number; one that is there several times is not absent."""
    return column_key(column, names) is None and (isinstance(column, int) or not _alike(column, names))


def resolve_columns(source: Source, channels: ChannelMap) -> tuple[Source, ChannelMap]:
    """Return the map with the file's own names of its columns (`keys`), without the ground truth that it does not hold.

    Absent ground truth is noted in the source. The clock that a container itself knows is no column. Raises
    RecordingError where a column is missing, or is there several times.
    """
    names = tuple(source.columns) if channels.topics else source.names or tuple(source.columns)
    own = channels.time.column == OWN_CLOCK and any(column.time is not None for column in source.columns.values())
    plain = replace(channels, time=TimeSource()) if own else channels
    resolved, absent = _resolved(source.path, plain, names)
    resolved = replace(resolved, time=channels.time) if own else resolved
    what: Literal["column", "topic"] = "topic" if channels.topics else "column"
    notes = [Finding(AbsentTruth(what, item.described, _similar(item, names)), item.channel, "note") for item in absent]
    return replace(source, findings=(*source.findings, *notes)), resolved


def _resolved(path: Path, channels: ChannelMap, names: Sequence[str]) -> tuple[ChannelMap, list[ChannelSource]]:
    """Return the map with the names that its columns have here, and the ground truth that is left out of it."""
    absent = [
        item
        for item in channels.sources
        if item.channel in GROUND_TRUTH and any(is_absent(column, names) for column in _asked(item, channels))
    ]
    time = channels.time
    if time.column is not None:
        time = replace(time, key=find_key(path, "time", time.column, names))
    sources = tuple(
        replace(item, keys=tuple(find_key(path, item.channel, column, names) for column in _asked(item, channels)))
        for item in channels.sources
        if item not in absent
    )
    return replace(channels, time=time, sources=sources), absent


def _asked(item: ChannelSource, channels: ChannelMap) -> tuple[str | int, ...]:
    """What the machine file calls the columns of a channel."""
    return (item.described,) if channels.topics else item.columns


def _similar(item: ChannelSource, names: Sequence[str]) -> str:
    return next(iter(get_close_matches(item.described, names, n=1, cutoff=0.6)), "")


def _alike(column: str, names: Sequence[str]) -> list[str]:
    """The numbers of the columns of one name, whatever their units."""
    return [str(i) for i, name in enumerate(names) if column in (name.partition("#")[0], split_unit(name)[0])]
