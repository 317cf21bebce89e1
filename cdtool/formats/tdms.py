"""TDMS, as LabVIEW and DIAdem write it, by npTDMS."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from cdtool.channels import ChannelMap
from cdtool.errors import RecordingError
from cdtool.formats.container_checks import as_numbers, check_size, left_out, library, one_line_errors
from cdtool.formats.groups import Group, Part, Parts, Written, stored
from cdtool.formats.own_clocks import OWN_CLOCK, asked_keys
from cdtool.formats.pieces import Pieces, joined
from cdtool.formats.slices import Sliced, header_of, side_by_side
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
        return joined(self._read(path, wanted, None), sort=False)

    def pieces(self, path: Path, keys: Collection[str] | None = None) -> Pieces:
        """All numeric columns, or those of `keys`, some MiB at a time; raises RecordingError."""
        return self._read(path, None, keys)

    def _read(self, path: Path, wanted: ChannelMap | None, some: Collection[str] | None) -> Pieces:
        nptdms = library("nptdms", "tdms", path)
        if not self.sniff(path):
            raise RecordingError(f"{path}: is no TDMS file", "see cdtool list formats")
        findings: list[Finding] = []
        with one_line_errors(path, "a TDMS file"), nptdms.TdmsFile.open(path) as file:
            channels = _channels(file, findings)
            keys = [key for key in asked_keys(path, wanted, tuple(channels)) if some is None or key in some]
            if not keys:
                raise RecordingError(f"{path}: holds no channel of numbers", "see cdtool info")
            check_size(path, sum(len(channels[key]) for key in keys))
            if getattr(file.file_status, "incomplete_final_segment", False):
                text = "the last segment is not complete: what it lacks is lost"
                findings.append(Finding(text, severity="loss"))
            origin = _origin(file, [channels[key] for key in keys])
            columns = [_Channel(key, channels[key], channels, findings).sliced(origin) for key in keys]
            yield from side_by_side(columns)
            details = {key: str(value)[:80] for key, value in file.properties.items()}
        headers = {column.name: header_of(column) for column in columns}
        return Source(path, self.name, headers, origin, tuple(dict.fromkeys(findings)), details, tuple(channels))


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


@dataclass(frozen=True)
class _Channel:
    """A channel of an open file, and those that may be its clock."""

    key: str
    channel: Any
    channels: Mapping[str, Any]
    findings: list[Finding]

    def sliced(self, origin: float) -> Sliced:
        """The channel as a column, with a clock where the file knows it."""
        channel, count = self.channel, len(self.channel)
        step = channel.properties.get("wf_increment")
        if isinstance(step, float) and step > 0.0:
            first = self._first(origin)

            def by_step(start: int, end: int) -> FloatArray:
                return first + np.arange(start, end, dtype=np.float64) * step

            return Sliced(self.key, count, self._values, f"{first!r} {step!r} {count}", by_step, _unit(channel))
        clock, factor = self._clock()
        if clock is None:
            return Sliced(self.key, count, self._values, unit=_unit(channel))

        def by_clock(start: int, end: int) -> FloatArray:
            times = as_numbers(clock.name, clock[start:end], [])
            return times if factor == 1.0 else times * factor

        return Sliced(self.key, count, self._values, f"{clock.path} {count}", by_clock, _unit(channel))

    def _values(self, start: int, end: int) -> FloatArray:
        values = as_numbers(self.key, self.channel[start:end], self.findings)
        if len(values) == end - start:
            return values
        text = f"{end - start - len(values)} values from number {start + len(values)} on are missing"
        self.findings.append(Finding(text, self.key, "loss"))
        return np.pad(values, (0, end - start - len(values)), constant_values=np.nan)

    def _first(self, origin: float) -> float:
        """Time [s] of a waveform's first sample."""
        start = _start(self.channel)
        later = start - origin if start is not None and origin else 0.0
        return later + float(self.channel.properties.get("wf_start_offset", 0.0))

    def _clock(self) -> tuple[Any, float]:
        """The channel of times that stands beside it, and its factor to seconds; None where there is none."""
        for clock in self.channels.values():
            beside = clock.group_name == self.channel.group_name and clock.name in _CLOCK_NAMES
            if not beside or clock is self.channel or self.channel.name in _CLOCK_NAMES:
                continue
            unit = find_unit(_unit(clock) or "?")
            if unit is not None and unit.si == "s" and len(clock) >= len(self.channel):
                return clock, unit.factor
        return None, 1.0


def _unit(channel: Any) -> str | None:
    return next((str(channel.properties[key]) for key in _UNIT_KEYS if channel.properties.get(key)), None)


def write_tdms(path: Path, groups: Sequence[Group], parts: Parts, provenance: Mapping[str, str]) -> Written:
    """Write a channel a column with its unit, a group a clock, each with its `time`; a segment for each part."""
    nptdms = library("nptdms", "tdms", path)
    many = len(groups) > 1
    shared = Counter(part.name for group in groups for part in chain(*group.flat))
    with nptdms.TdmsWriter(str(path)) as writer:
        objects = [nptdms.RootObject(properties=stored(provenance))]
        objects += [nptdms.GroupObject(group.name) for group in groups]
        writer.write_segment(objects)
        for ready in parts:
            filled = [item for group, part in zip(groups, ready, strict=True) for item in _filled(nptdms, group, part)]
            writer.write_segment(filled)
    return [
        [
            [f"{group.name}/{part.name}" if many and shared[part.name] > 1 else part.name for part in parts]
            for parts in group.flat
        ]
        for group in groups
    ]


def _filled(nptdms: Any, group: Group, part: Part | None) -> list[Any]:
    """A group's channels with their next rows."""
    if part is None:
        return []
    columns, values = list(chain(*group.flat)), part.flat
    if group.own_clock and part.time is not None:
        columns, values = [Column(OWN_CLOCK, part.time, unit="s"), *columns], [part.time, *values]
    return [
        nptdms.ChannelObject(group.name, column.name, item, {"unit_string": column.unit} if column.unit else {})
        for column, item in zip(columns, values, strict=True)
    ]
