"""TDMS, as LabVIEW and DIAdem write it, by npTDMS."""

from __future__ import annotations

import logging
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

from cdtool.channels import ChannelMap
from cdtool.columns import Column
from cdtool.errors import RecordingError
from cdtool.findings import Finding
from cdtool.findings.clocks import NoStartTime
from cdtool.findings.containers import LastSegmentIncomplete, LibraryMessage, ValuesCutOff
from cdtool.formats.column_names import OWN_CLOCK, asked_keys
from cdtool.formats.container_checks import check_size, left_out, library, one_line_errors
from cdtool.formats.epoch_clock import EpochClock, common_origin, with_plausible_unit
from cdtool.formats.groups import Group, Part, Parts, Written, stored
from cdtool.formats.pieces import InPieces, Pieces
from cdtool.formats.slices import Sliced, header_of, side_by_side
from cdtool.formats.source import Source
from cdtool.large_integers import rounded_integers, rounding_finding
from cdtool.recording import FloatArray
from cdtool.units import find_unit

_MAGIC = b"TDSm"
_UNIT_KEYS = ("unit_string", "NI_UnitDescription", "unit")
_CLOCK_NAMES = ("time", "t", "timestamp")


@dataclass(frozen=True)
class Tdms(InPieces):
    """TDMS files: a column is a channel, with its group before it where several groups have one of that name.

    A waveform's clock (`wf_increment`), or a channel `time` of its group with a unit of time, is a channel's clock.
    """

    name: ClassVar[str] = "tdms"
    suffixes: ClassVar[tuple[str, ...]] = (".tdms",)

    def sniff(self, path: Path) -> bool:
        """True if the file starts as TDMS does."""
        with path.open("rb") as file:
            return file.read(len(_MAGIC)) == _MAGIC

    def _read(self, path: Path, wanted: ChannelMap | None, some: Collection[str] | None) -> Pieces:
        nptdms = library("nptdms", "tdms", path)
        if not self.sniff(path):
            raise RecordingError(f"{path}: is no TDMS file", "see cdtool list formats")
        findings: list[Finding] = []
        with (
            one_line_errors(path, "a TDMS file"),
            collected_lines("nptdms") as lines,
            nptdms.TdmsFile.open(path) as file,
        ):
            channels = _channels(file, findings)
            keys = [key for key in asked_keys(path, wanted, tuple(channels)) if some is None or key in some]
            if not keys:
                raise RecordingError(f"{path}: holds no channel of numbers", "see cdtool info")
            check_size(path, sum(len(channels[key]) for key in keys))
            incomplete = getattr(file.file_status, "incomplete_final_segment", False)
            if incomplete:
                findings.append(Finding(LastSegmentIncomplete(), severity="loss"))
            tree = _Tree(channels, findings)
            origin = tree.take_origin(keys, file.properties)
            columns = [tree.sliced(key) for key in keys]
            yield from side_by_side(columns)
            findings += [found for key in keys for found in rounding_finding(key, tree.rounded[key])]
            findings += [
                Finding(LibraryMessage("npTDMS", line), severity="note" if incomplete else "warning") for line in lines
            ]
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


class _Tree:
    """The channels of an open file as columns, with clocks where the file knows them."""

    def __init__(self, channels: Mapping[str, Any], findings: list[Finding]) -> None:
        self._channels, self._findings = channels, findings
        self.rounded: Counter[str] = Counter()
        self._origin = self._epoch = Fraction(0)  # of waveforms, of stamps
        self._clocks: dict[str, EpochClock] = {}

    def take_origin(self, keys: Sequence[str], properties: Mapping[str, Any]) -> float:
        """What all times count from [s]: what cdtool convert wrote, or the earliest waveform or stamp since 1970.

        What does not tell its start is taken to begin with the earliest; 0 where nothing does.
        """
        if "cdtool.origin_s" in properties:
            return float(properties["cdtool.origin_s"])
        begins = {key: _start(self._channels[key]) for key in keys if _step(self._channels[key]) is not None}
        known = [start for start in begins.values() if start is not None]
        clocks = {key: found[1] for key in keys if key not in begins and (found := self._clock(key)) is not None}
        self._epoch = common_origin(clocks.values())
        known += [self._epoch] if self._epoch else []
        self._origin = min(known, default=Fraction(0))
        untold = [key for key, start in begins.items() if start is None] + [key for key in clocks if not self._epoch]
        if known and untold:
            self._findings.append(Finding(NoStartTime(tuple(untold))))
        return float(self._origin)

    def sliced(self, key: str) -> Sliced:
        """A channel as a column."""
        channel = self._channels[key]
        count, unit, step = len(channel), _unit(channel), _step(channel)

        def values(start: int, end: int) -> FloatArray:
            return self._values(key, start, end)

        if step is not None:
            first = self._first(channel)

            def by_step(start: int, end: int) -> FloatArray:
                return first + np.arange(start, end, dtype=np.float64) * step

            return Sliced(key, count, values, f"{first!r} {step!r} {count}", by_step, unit)
        found = self._clock(key)
        if found is None:
            return Sliced(key, count, values, unit=unit)
        path, clock = found

        def by_clock(start: int, end: int) -> FloatArray:
            return clock.times(start, end, self._origin if self._epoch else Fraction(0))

        return Sliced(key, count, values, f"{path} {count}", by_clock, unit)

    def _values(self, key: str, start: int, end: int) -> FloatArray:
        raw = self._channels[key][start:end]
        values = np.ascontiguousarray(raw, dtype=np.float64)
        self.rounded[key] += rounded_integers(values) if raw.dtype.kind in "iu" else 0
        if len(values) == end - start:
            return values
        self._findings.append(Finding(ValuesCutOff(end - start - len(values), start + len(values)), key, "loss"))
        return np.pad(values, (0, end - start - len(values)), constant_values=np.nan)

    def _first(self, channel: Any) -> float:
        """Time [s] of a waveform's first sample."""
        start = _start(channel)
        later = float(start - self._origin) if start is not None and self._origin else 0.0
        return later + float(channel.properties.get("wf_start_offset", 0.0))

    def _clock(self, key: str) -> tuple[str, EpochClock] | None:
        """The channel of times that stands beside it; None where there is none."""
        channel = self._channels[key]
        for clock in self._channels.values():
            beside = clock.group_name == channel.group_name and clock.name in _CLOCK_NAMES
            if not beside or clock is channel or channel.name in _CLOCK_NAMES:
                continue
            unit = find_unit(_unit(clock) or "?")
            if unit is None or unit.si != "s" or len(clock) < len(channel):
                continue
            if clock.path not in self._clocks:
                made = EpochClock(partial(_raw, clock), unit.factor)
                said = str(_unit(clock))
                self._clocks[clock.path] = with_plausible_unit(made, said, self._findings, clock.name)
            return clock.path, self._clocks[clock.path]
        return None


def _raw(channel: Any, start: int, end: int) -> Any:
    return channel[start:end]


def _step(channel: Any) -> float | None:
    """A waveform's sample period [s]; None of any other channel."""
    step = channel.properties.get("wf_increment")
    known = isinstance(step, int | float | np.number) and not isinstance(step, bool) and 0.0 < float(step) < np.inf
    return float(step) if known else None


def _start(channel: Any) -> Fraction | None:
    """Seconds since 1970 of a waveform's start; None where it has none, or that of an empty stamp (1904)."""
    start = channel.properties.get("wf_start_time")
    if start is None:
        return None
    microseconds = np.datetime64(start, "us").astype(np.int64)
    seconds = Fraction(int(microseconds), 10**6)
    return seconds if seconds > 0 else None


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


class _Lines(logging.Handler):
    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self.lines: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.lines.append(" ".join(record.getMessage().split())[:200])


@contextmanager
def collected_lines(library: str) -> Iterator[list[str]]:
    """The warnings that a library's loggers give within; none of them is printed, by its own handlers or others'.

    The loggers are those of the modules that are imported. Files that are read at the same time share their lines.
    """
    known = [name for name in logging.Logger.manager.loggerDict if name == library or name.startswith(f"{library}.")]
    loggers = [logging.getLogger(name) for name in known]
    before = [(logger.handlers, logger.propagate) for logger in loggers]
    collector = _Lines()
    for logger in loggers:
        logger.handlers, logger.propagate = [collector], False
    try:
        yield collector.lines
    finally:
        for logger, (handlers, propagate) in zip(loggers, before, strict=True):
            logger.handlers, logger.propagate = handlers, propagate
