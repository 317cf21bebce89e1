"""TDMS files of LabVIEW and DIAdem, by npTDMS."""

from __future__ import annotations

import logging
import os
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import RecordingError
from cdtool.base.findings import Finding
from cdtool.formats.channels.channel_map import ChannelMap
from cdtool.formats.column_names import OWN_CLOCK, requested_keys
from cdtool.formats.columns import Column, as_float64
from cdtool.formats.containers.container_checks import check_size, left_out_finding, library, one_line_errors
from cdtool.formats.epoch_clock import EpochClock, common_origin, with_plausible_unit
from cdtool.formats.groups import Group, Part, Parts, WrittenNames, prefix_keys
from cdtool.formats.large_integers import rounded_integers, rounding_finding
from cdtool.formats.pieces import Pieces, PiecewiseFormat
from cdtool.formats.slices import SlicedColumn, header_of, interleave
from cdtool.formats.source import Source
from cdtool.recordings.units import find_unit

_MAGIC = b"TDSm"
_UNIT_KEYS = ("unit_string", "NI_UnitDescription", "unit")
_CLOCK_NAMES = ("time", "t", "timestamp")


@dataclass(frozen=True)
class Tdms(PiecewiseFormat):
    """TDMS files: a column is a channel, prefixed with its group if several groups have a channel of that name.

    The clock of a channel is its waveform's (`wf_increment`), or the channel `time` of its group with a unit of time.
    """

    name: ClassVar[str] = "tdms"
    suffixes: ClassVar[tuple[str, ...]] = (".tdms",)

    def sniff(self, path: Path) -> bool:
        """Return whether the file starts like a TDMS file."""
        with path.open("rb") as file:
            return file.read(len(_MAGIC)) == _MAGIC

    def _read(self, path: Path, wanted: ChannelMap | None, some: Collection[str] | None) -> Pieces:
        nptdms = library("nptdms", "tdms")
        findings: list[Finding] = []
        with (
            one_line_errors("a TDMS file"),
            collect_warnings("nptdms") as warnings,
            nptdms.TdmsFile.open(os.fspath(path)) as file,
        ):
            channels = _channels(file, findings)
            keys = [key for key in requested_keys(wanted, tuple(channels)) if some is None or key in some]
            if not keys:
                raise RecordingError("has no channel of numbers", "see cdtool info")
            check_size(path, sum(len(channels[key]) for key in keys))
            incomplete = getattr(file.file_status, "incomplete_final_segment", False)
            if incomplete:
                findings.append(Finding("last_segment_incomplete"))
            tree = _Channels(channels, findings)
            origin = tree.set_origin(keys, file.properties)
            columns = [tree.column(key) for key in keys]
            yield from interleave(columns)
            findings += [finding for key in keys for finding in rounding_finding(key, tree.rounded[key])]
            findings += [
                Finding("library_message", "", {"library": "npTDMS", "text": text}, "note" if incomplete else "warning")
                for text in warnings
            ]
            details = {key: str(value)[:80] for key, value in file.properties.items()}
        headers = {column.name: header_of(column) for column in columns}
        return Source(path, self.name, headers, origin, tuple(dict.fromkeys(findings)), details, tuple(channels))


def _channels(file: Any, findings: list[Finding]) -> dict[str, Any]:
    """Return the channels of numbers by column name."""
    candidates = [channel for group in file.groups() for channel in group.channels()]
    count = Counter(channel.name for channel in candidates)
    channels = {}
    for channel in candidates:
        name = channel.name if count[channel.name] == 1 else f"{channel.group_name}/{channel.name}"
        kind = channel.dtype.kind if channel.dtype is not None else "O"
        if not len(channel):
            findings.append(left_out_finding(name, "empty"))
        elif kind not in "biuf":
            findings.append(left_out_finding(name, "of time stamps" if kind == "M" else "not numeric"))
        else:
            channels[name] = channel
    return channels


class _Channels:
    """The channels of an open file as columns, with the clocks that the file has for them."""

    def __init__(self, channels: Mapping[str, Any], findings: list[Finding]) -> None:
        self._channels, self._findings = channels, findings
        self.rounded: Counter[str] = Counter()
        self._origin = self._epoch = Fraction(0)  # of waveforms, of stamps
        self._clocks: dict[str, EpochClock] = {}

    def set_origin(self, keys: Sequence[str], properties: Mapping[str, Any]) -> float:
        """Set and return the origin of all times [s].

        It is the origin that `cdtool convert` wrote, or else the earliest start of a waveform or clock since 1970, or 0
        if no start is known. Channels without a start are assumed to start at the origin.
        """
        if "cdtool.origin_s" in properties:
            return float(properties["cdtool.origin_s"])
        starts = {key: _start(self._channels[key]) for key in keys if _step(self._channels[key]) is not None}
        known = [start for start in starts.values() if start is not None]
        clocks = {key: clock[1] for key in keys if key not in starts and (clock := self._clock(key)) is not None}
        self._epoch = common_origin(clocks.values())
        known += [self._epoch] if self._epoch else []
        self._origin = min(known, default=Fraction(0))
        unknown = [key for key, start in starts.items() if start is None] + [key for key in clocks if not self._epoch]
        if known and unknown:
            self._findings.append(Finding("no_start_time", "", {"channels": tuple(unknown)}))
        return float(self._origin)

    def column(self, key: str) -> SlicedColumn:
        """Return a channel as a column."""
        channel = self._channels[key]
        count, unit, step = len(channel), _unit(channel), _step(channel)

        def values(start: int, end: int) -> FloatArray:
            return self._values(key, start, end)

        if step is not None:
            first = self._first(channel)

            def by_step(start: int, end: int) -> FloatArray:
                return first + np.arange(start, end, dtype=np.float64) * step

            return SlicedColumn(key, count, values, f"{first!r} {step!r} {count}", by_step, unit)
        own = self._clock(key)
        if own is None:
            return SlicedColumn(key, count, values, unit=unit)
        path, clock = own

        def by_clock(start: int, end: int) -> FloatArray:
            return clock.times(start, end, self._origin if self._epoch else Fraction(0))

        return SlicedColumn(key, count, values, f"{path} {count}", by_clock, unit)

    def _values(self, key: str, start: int, end: int) -> FloatArray:
        raw = self._channels[key][start:end]
        values = as_float64(raw)
        self.rounded[key] += rounded_integers(values) if raw.dtype.kind in "iu" else 0
        if len(values) == end - start:
            return values
        self._findings.append(
            Finding("values_cut_off", key, {"count": end - start - len(values), "first": start + len(values)})
        )
        return np.pad(values, (0, end - start - len(values)), constant_values=np.nan)

    def _first(self, channel: Any) -> float:
        """Return the time [s] of a waveform's first sample."""
        start = _start(channel)
        later = float(start - self._origin) if start is not None and self._origin else 0.0
        return later + float(channel.properties.get("wf_start_offset", 0.0))

    def _clock(self, key: str) -> tuple[str, EpochClock] | None:
        """Return path and clock of the channel of times in the same group; None if there is no such channel."""
        channel = self._channels[key]
        for clock in self._channels.values():
            is_candidate = clock.group_name == channel.group_name and clock.name in _CLOCK_NAMES
            if not is_candidate or clock is channel or channel.name in _CLOCK_NAMES:
                continue
            unit = find_unit(_unit(clock) or "?")
            if unit is None or unit.si != "s" or len(clock) < len(channel):
                continue
            if clock.path not in self._clocks:
                epoch_clock = EpochClock(partial(_raw, clock), unit.factor)
                stated = str(_unit(clock))
                self._clocks[clock.path] = with_plausible_unit(epoch_clock, stated, self._findings, clock.name)
            return clock.path, self._clocks[clock.path]
        return None


def _raw(channel: Any, start: int, end: int) -> Any:
    return channel[start:end]


def _step(channel: Any) -> float | None:
    """Return a waveform's sample period [s]; None for any other channel."""
    step = channel.properties.get("wf_increment")
    known = isinstance(step, int | float | np.number) and not isinstance(step, bool) and 0.0 < float(step) < np.inf
    return float(step) if known else None


def _start(channel: Any) -> Fraction | None:
    """Return a waveform's start [s] since 1970; None if it has no start, or the start of an empty stamp (1904)."""
    start = channel.properties.get("wf_start_time")
    if start is None:
        return None
    microseconds = np.datetime64(start, "us").astype(np.int64)
    seconds = Fraction(int(microseconds), 10**6)
    return seconds if seconds > 0 else None


def _unit(channel: Any) -> str | None:
    return next((str(channel.properties[key]) for key in _UNIT_KEYS if channel.properties.get(key)), None)


def write_tdms(path: Path, groups: Sequence[Group], parts: Parts, provenance: Mapping[str, str]) -> WrittenNames:
    """Write one channel per column with its unit, one group per clock with its `time`, and one segment per part."""
    nptdms = library("nptdms", "tdms")
    many = len(groups) > 1
    shared = Counter(part.name for group in groups for part in chain(*group.flat))
    with nptdms.TdmsWriter(str(path)) as writer:
        objects = [nptdms.RootObject(properties=prefix_keys(provenance))]
        objects += [nptdms.GroupObject(group.name) for group in groups]
        writer.write_segment(objects)
        for ready in parts:
            rows = [_channel_rows(nptdms, group, part) for group, part in zip(groups, ready, strict=True)]
            writer.write_segment(list(chain(*rows)))
    return [
        [
            [f"{group.name}/{part.name}" if many and shared[part.name] > 1 else part.name for part in parts]
            for parts in group.flat
        ]
        for group in groups
    ]


def _channel_rows(nptdms: Any, group: Group, part: Part | None) -> list[Any]:
    """Return a group's channels with their next rows."""
    if part is None:
        return []
    columns, values = list(chain(*group.flat)), part.flat
    if group.own_clock and part.time is not None:
        columns, values = [Column(OWN_CLOCK, part.time, unit="s"), *columns], [part.time, *values]
    return [
        nptdms.ChannelObject(group.name, column.name, array, {"unit_string": column.unit} if column.unit else {})
        for column, array in zip(columns, values, strict=True)
    ]


@contextmanager
def collect_warnings(library: str) -> Iterator[list[str]]:
    """Yield a list that collects the warnings of a library's loggers within the context; no handler prints them.

    Only loggers of modules that are already imported are collected. Files that are read at the same time share the
    warnings.
    """
    known = [name for name in logging.Logger.manager.loggerDict if name == library or name.startswith(f"{library}.")]
    loggers, lines = [logging.getLogger(name) for name in known], list[str]()

    def collect(record: logging.LogRecord) -> bool:
        lines.append(" ".join(record.getMessage().split())[:200])
        return False

    for logger in loggers:
        logger.addFilter(collect)
    try:
        yield lines
    finally:
        for logger in loggers:
            logger.removeFilter(collect)
