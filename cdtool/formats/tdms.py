"""TDMS, as LabVIEW and DIAdem write it, by npTDMS."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from cdtool.channels import ChannelMap
from cdtool.errors import RecordingError
from cdtool.formats.container_checks import as_numbers, check_size, left_out, library, one_line_errors
from cdtool.formats.groups import Group, Written, stored
from cdtool.formats.own_clocks import OWN_CLOCK, asked_keys
from cdtool.formats.source import Column, Source
from cdtool.recording import Finding, FloatArray
from cdtool.units import find_unit

_MAGIC = b"TDSm"
_UNIT_KEYS = ("unit_string", "NI_UnitDescription", "unit")
_CLOCK_NAMES = ("time", "t", "timestamp")


@dataclass(frozen=True)
class Tdms:
    """TDMS files: a column is a channel, with its group before it where several groups have one of that name.

    A waveform's clock (`wf_increment`), or a channel `time` of its group with a unit of time, is a channel's clock.
    """

    name: ClassVar[str] = "tdms"
    suffixes: ClassVar[tuple[str, ...]] = (".tdms",)

    def sniff(self, path: Path) -> bool:
        """True if the file starts as TDMS does."""
        with path.open("rb") as file:
            return file.read(len(_MAGIC)) == _MAGIC

    def columns(self, path: Path, wanted: ChannelMap | None = None) -> Source:
        """The columns that `wanted` names, or all numeric ones; raises RecordingError."""
        nptdms = library("nptdms", "tdms", path)
        if not self.sniff(path):
            raise RecordingError(f"{path}: is no TDMS file", "see cdtool list formats")
        findings: list[Finding] = []
        with one_line_errors(path, "a TDMS file"), nptdms.TdmsFile.open(path) as file:
            channels = _channels(file, findings)
            keys = asked_keys(path, wanted, tuple(channels))
            if not keys:
                raise RecordingError(f"{path}: holds no channel of numbers", "see cdtool info")
            check_size(path, sum(len(channels[key]) for key in keys))
            if getattr(file.file_status, "incomplete_final_segment", False):
                text = "the last segment is not complete: what it lacks is lost"
                findings.append(Finding(text, severity="loss"))
            origin = _origin(file, [channels[key] for key in keys])
            columns = {key: _column(key, channels[key], channels, origin, findings) for key in keys}
            details = {key: str(value)[:80] for key, value in file.properties.items()}
        return Source(path, self.name, columns, origin, tuple(findings), details, tuple(channels))


def _channels(file: Any, findings: list[Finding]) -> dict[str, Any]:
    """The channels of numbers by the names of their columns."""
    every = [channel for group in file.groups() for channel in group.channels()]
    count = Counter(channel.name for channel in every)
    found = {}
    for channel in every:
        name = channel.name if count[channel.name] == 1 else f"{channel.group_name}/{channel.name}"
        kind = channel.dtype.kind if channel.dtype is not None else "O"
        if not len(channel):
            findings.append(left_out(name, "empty"))
        elif kind not in "biuf":
            findings.append(left_out(name, "of time stamps" if kind == "M" else "no number"))
        else:
            found[name] = channel
    return found


def _origin(file: Any, channels: Sequence[Any]) -> float:
    """Seconds since 1970 of the earliest waveform, or what cdtool convert wrote; 0 where neither is told."""
    if "cdtool.origin_s" in file.properties:
        return float(file.properties["cdtool.origin_s"])
    starts = [_start(channel) for channel in channels if channel.properties.get("wf_increment")]
    known = [start for start in starts if start is not None]
    return min(known) if starts and len(known) == len(starts) else 0.0


def _start(channel: Any) -> float | None:
    start = channel.properties.get("wf_start_time")
    if start is None:
        return None
    seconds = (np.datetime64(start) - np.datetime64(0, "s")) / np.timedelta64(1, "us") / 1e6
    return float(seconds) if seconds > 0 else None


def _column(key: str, channel: Any, channels: Mapping[str, Any], origin: float, findings: list[Finding]) -> Column:
    values = as_numbers(key, channel[:], findings)
    if len(values) < len(channel):
        text = f"{len(channel) - len(values)} of {len(channel)} values are missing"
        findings.append(Finding(text, key, "loss"))
    return Column(key, values, _clock(channel, len(values), channels, origin), _unit(channel))


def _clock(channel: Any, count: int, channels: Mapping[str, Any], origin: float) -> FloatArray | None:
    step = channel.properties.get("wf_increment")
    if isinstance(step, float) and step > 0.0:
        offset = float(channel.properties.get("wf_start_offset", 0.0))
        start = _start(channel)
        later = start - origin if start is not None and origin else 0.0
        time: FloatArray = later + offset + np.arange(count, dtype=np.float64) * step
        return time
    for clock in channels.values():
        beside = clock.group_name == channel.group_name and clock.name in _CLOCK_NAMES and clock is not channel
        unit = find_unit(_unit(clock) or "?") if beside and channel.name not in _CLOCK_NAMES else None
        if unit is not None and unit.si == "s" and len(clock) >= count:
            values = as_numbers(clock.name, clock[:count], [])
            return values if unit.factor == 1.0 else values * unit.factor
    return None


def _unit(channel: Any) -> str | None:
    return next((str(channel.properties[key]) for key in _UNIT_KEYS if channel.properties.get(key)), None)


def write_tdms(path: Path, groups: Sequence[Group], provenance: Mapping[str, str]) -> Written:
    """Write a channel a column with its unit, a group a clock, each with its `time`."""
    nptdms = library("nptdms", "tdms", path)
    names: Written = []
    many = len(groups) > 1
    shared = Counter(part.name for group in groups for part in chain(*group.flat))
    with nptdms.TdmsWriter(str(path)) as writer:
        root = nptdms.RootObject(properties=stored(provenance))
        for group in groups:
            columns = list(chain(*group.flat))
            if group.time is not None and not group.is_table:
                columns.insert(0, Column(OWN_CLOCK, group.time, unit="s"))
            writer.write_segment([root, nptdms.GroupObject(group.name), *(_object(nptdms, group, c) for c in columns)])
            names.append(
                [
                    [f"{group.name}/{part.name}" if many and shared[part.name] > 1 else part.name for part in parts]
                    for parts in group.flat
                ]
            )
    return names


def _object(nptdms: Any, group: Group, column: Column) -> Any:
    properties = {"unit_string": column.unit} if column.unit else {}
    return nptdms.ChannelObject(group.name, column.name, np.ascontiguousarray(column.values), properties=properties)
