"""The mapped channels of message files, as logged and in SI, piece by piece; used by `cdtool convert`."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from cdtool.channels import ChannelSource
from cdtool.clock.stamps import ClockCleaner, GapStatistics, missing_findings
from cdtool.columns import Column, Piece
from cdtool.errors import RecordingError
from cdtool.findings import Finding
from cdtool.formats.column_names import resolve_columns
from cdtool.formats.groups import Group, Part
from cdtool.formats.pieces import MappedLog, PieceRun
from cdtool.formats.source import Source
from cdtool.formats.time_order import Lateness, by_time
from cdtool.ingest.channel_assembly import (
    check_width,
    convert_to_si,
    disjoint_clock_findings,
    masked_findings,
    stuck_findings,
)
from cdtool.ingest.log_statistics import ClockStatistics
from cdtool.ingest.parts import ChannelSpan, PartSpan, check_parts, part_gap_findings, with_file_name
from cdtool.ingest.reading import LogFolder
from cdtool.machine_file import MachineFile
from cdtool.recording import MEASURED, FloatArray


class LoggedChannel:
    """Cleans a channel's samples, converts them to SI, and collects statistics and findings.

    `period` [s] is the median step; if it is known, gaps are also reported.
    """

    def __init__(self, path: Path, item: ChannelSource, names: Sequence[str], period: float | None = None) -> None:
        self._path, self.item, self.joints, self._names = path, item, len(item.factor), names
        self.cleaner, self.clock = ClockCleaner(), ClockStatistics()
        self._gaps = None if period is None else GapStatistics(period, item.channel)
        self._masked, self._known = np.zeros((3, self.joints), np.int64), np.zeros(self.joints, np.int64)
        self._least, self._most = np.full(self.joints, np.inf), np.full(self.joints, -np.inf)

    def add(self, stamps: FloatArray, values: FloatArray | None, final: bool = False) -> tuple[FloatArray, FloatArray]:
        """Add the next samples, in the order of their stamps [s]; return their times [s] and values (n, J).

        The times include `time_offset`. The last samples are returned with the following ones, or with `final`.
        """
        table = np.full((len(stamps), self.joints), np.nan) if values is None else _table(values)
        check_width(self._path, self.item, table.shape[1])
        time, table = self.cleaner.rows(stamps, stamps, table, final)
        rows, masked = convert_to_si(self.item, table)
        self._masked += masked
        self._known += np.count_nonzero(np.isfinite(rows), axis=0)
        self._least = np.fmin(self._least, np.fmin.reduce(rows, axis=0, initial=np.inf))
        self._most = np.fmax(self._most, np.fmax.reduce(rows, axis=0, initial=-np.inf))
        self.clock.add(time, len(time))
        if self._gaps is not None:
            self._gaps.add(time)
        return (time + self.item.time_offset if self.item.time_offset else time), rows

    @property
    def is_coarse(self) -> bool:
        """True if the clock must be replaced by a straight line, for which clean_time needs the whole clock."""
        return self.item.channel != "event" and self.cleaner.is_coarse

    @property
    def span(self) -> tuple[float, float]:
        """First and last time [s], `time_offset` included."""
        return self.clock.first + self.item.time_offset, self.clock.last + self.item.time_offset

    @property
    def constant(self) -> list[bool]:
        """Joint by joint, whether the value never changes."""
        return list(map(bool, (self._known > 1) & (self._least == self._most)))

    def findings(self) -> list[Finding]:
        """Return the findings, the same as those of channel_assembly."""
        findings = [replace(item, channel=f"{self.item.channel} time") for item in self.cleaner.findings(0)]
        findings += masked_findings(self._masked, self.item, self._names)
        findings += self._gaps.findings() if self._gaps is not None else []
        values = self.clock.rows * self.joints
        absent = values - int(self._known.sum())
        return findings + missing_findings(absent, values, self.item.channel, int(self._masked.sum()))


class LoggedFile:
    """A file of messages, read once for its statistics, and twice if the messages are not in the order of time.

    `channels` have the statistics; `late` [s] is the largest lateness of a sample (Lateness). Gaps are known after
    `pieces` has been exhausted. `log` yields the mapped fields of the file at `path`. Raises RecordingError.
    """

    def __init__(self, path: Path, machine_file: MachineFile, log: MappedLog) -> None:
        self.path, self._items, self._joints = path, machine_file.topics.sources, machine_file.topics.joints
        self._log = log
        self._is_sorted = True
        self.channels = self._new_channels()
        source, lateness = self._survey()
        self.late = lateness.late
        self._columns: Mapping[str, list[Column]] = {name: [column] for name, column in source.columns.items()}
        if not (self._is_sorted and self._log.settled):
            self._survey_in_order()
        source, resolved = resolve_columns(source, machine_file.topics)
        self.channels = {item.channel: self.channels[item.channel] for item in resolved.sources}
        self.origin, self._file_findings = source.origin, source.findings
        for channel in self.channels.values():
            check_width(path, channel.item, math.prod(source.columns[channel.item.described].values.shape[1:]))
            if not channel.clock.rows:
                name = channel.item.channel
                raise RecordingError(f"{path}: channel '{name}' has no sample with a time", channel=name)
        offsets = [item.time_offset for item in resolved.sources]
        self.late += max(offsets, default=0.0) - min(offsets, default=0.0)

    @property
    def start(self) -> float:
        """Time of the first sample of any channel [s]."""
        return min((channel.span[0] for channel in self.channels.values()), default=np.inf)

    @property
    def end(self) -> float:
        """Time of the last sample of any channel [s]."""
        return max((channel.span[1] for channel in self.channels.values()), default=-np.inf)

    @property
    def part_span(self) -> PartSpan:
        """The time spans of the channels."""
        spans = {
            name: ChannelSpan(*each.span, each.clock.steps.median if each.clock.steps.count else np.inf, each.item.unit)
            for name, each in self.channels.items()
        }
        return PartSpan(str(self.path), self.origin, spans)

    @property
    def is_coarse(self) -> bool:
        """True if the clock of a channel cannot be cleaned piece by piece."""
        return any(channel.is_coarse for channel in self.channels.values())

    @property
    def findings(self) -> tuple[Finding, ...]:
        """The findings of the file and its channels."""
        findings = [*self._file_findings, *(item for channel in self.channels.values() for item in channel.findings())]
        constant = {name: self.channels[name].constant for name in MEASURED if name in self.channels}
        findings += stuck_findings(constant, self._joints)
        findings += disjoint_clock_findings({name: channel.span for name, channel in self.channels.items()})
        return tuple(findings)

    def pieces(self, names: Collection[str], shift: float) -> Iterator[Piece]:
        """Yield pieces of the channels `names`, each with its own clock; `shift` [s] is added to their times."""
        channels = {
            name: LoggedChannel(self.path, channel.item, self._joints, channel.clock.steps.median)
            for name, channel in self.channels.items()
            if name in names
        }
        for channel, time, rows in _add_pieces(channels, self._in_order()):
            if len(time):
                name, values = channel.item.channel, rows if channel.joints > 1 else rows[:, 0]
                yield Piece(name, time + shift, {name: values}, len(time))
        self.channels |= channels

    def _survey(self) -> tuple[Source, Lateness]:
        """Collect the statistics, assuming that all messages are in the order of time."""
        lateness, orders = Lateness(), dict[str, Lateness]()
        run = PieceRun(self._log.pieces())

        def checked_pieces() -> Iterator[Piece]:
            for piece in run:
                if piece.time is not None:
                    lateness.add(piece.time)
                    orders.setdefault(piece.clock, Lateness()).add(piece.time)
                yield piece

        for _ in _add_pieces(self.channels, checked_pieces()):
            pass
        self._is_sorted = all(order.late == 0.0 for order in orders.values())
        return run.source, lateness

    def _survey_in_order(self) -> None:
        self.channels = self._new_channels()
        for _ in _add_pieces(self.channels, self._in_order()):
            pass

    def _new_channels(self) -> dict[str, LoggedChannel]:
        return {item.channel: LoggedChannel(self.path, item, self._joints) for item in self._items}

    def _in_order(self) -> Iterator[Piece]:
        """Yield the pieces of all fields, those of each field in the order of their times."""
        run = PieceRun(self._log.pieces())
        if self._is_sorted:
            yield from run
        else:
            for ready in by_time(run, self._columns, self.late, sort=True):
                yield from ready.values()


def _add_pieces(
    channels: Mapping[str, LoggedChannel], pieces: Iterable[Piece]
) -> Iterator[tuple[LoggedChannel, FloatArray, FloatArray]]:
    """Add pieces to the channels mapped to their fields; yield channel, times and values, the last rows at the end."""
    for piece in pieces:
        for channel in channels.values():
            if channel.item.described == piece.clock and piece.time is not None:
                yield channel, *channel.add(piece.time, piece.values.get(piece.clock))
    for channel in channels.values():
        yield channel, *channel.add(np.empty(0), np.empty((0, channel.joints)), final=True)


def _table(values: FloatArray) -> FloatArray:
    """Return values (n,) or (n, J) as (n, J), also for n = 0."""
    return values[:, np.newaxis] if values.ndim == 1 else values.reshape(len(values), math.prod(values.shape[1:]))


class ChannelPieces:
    """The channels of a file of messages, or of several that are parts of one log, which need not fit into memory.

    `logs` yield the mapped fields of each file; `folder` is that of the parts. The result is the same as that of
    join_recordings, and RecordingError is raised in the same cases.
    """

    def __init__(
        self, logs: Mapping[Path, MappedLog], machine_file: MachineFile, folder: LogFolder | None = None
    ) -> None:
        files = [LoggedFile(path, machine_file, log) for path, log in logs.items()]
        self._files = sorted(files, key=lambda file: file.origin + file.start)
        self._folder, self._joints = folder, machine_file.topics.joints
        self.origin = self._files[0].origin
        self.is_coarse = any(file.is_coarse for file in self._files)
        check_parts([file.part_span for file in self._files])
        self._late = max(file.late for file in self._files)
        latest = -np.inf  # a part that begins before another ends is also late
        for file in self._files:
            shift = file.origin - self.origin
            self._late = max(self._late, latest - (file.start + shift))
            latest = max(latest, file.end + shift)
        clocks: dict[tuple[bytes, ...], list[str]] = {}
        for name in dict.fromkeys(name for file in self._files for name in file.channels):
            of_files = (file.channels.get(name) for file in self._files)
            digests = (b"" if channel is None else channel.clock.digest.digest() for channel in of_files)
            clocks.setdefault(tuple(digests), []).append(name)
        self.groups = [self._group(f"clock_{i}", names) for i, names in enumerate(clocks.values(), start=1)]

    @property
    def findings(self) -> tuple[Finding, ...]:
        """All findings; gaps are included after all rows have been read."""
        if self._folder is None:
            return self._files[0].findings
        of_parts = (item for file in self._files for item in with_file_name(file.path, file.findings))
        gaps = part_gap_findings([file.part_span for file in self._files])
        return (*self._folder.findings, *of_parts, *gaps)

    def parts(self, groups: Sequence[Group]) -> Iterator[list[Part | None]]:
        """Yield the rows of these groups, from the first on."""
        columns = {column.name: [column] for group in groups for column in group.columns}
        for ready in by_time(self._pieces(columns), columns, self._late, sort=False):
            yield [_part(group, ready) for group in groups]

    def _pieces(self, names: dict[str, list[Column]]) -> Iterator[Piece]:
        for file in self._files:
            yield from file.pieces(names, file.origin - self.origin)

    def _group(self, name: str, channels: Sequence[str]) -> Group:
        files = [file for file in self._files if channels[0] in file.channels]
        start = files[0].channels[channels[0]].span[0] + (files[0].origin - self.origin)
        rows = sum(file.channels[channels[0]].clock.rows for file in files)
        columns = tuple(_header(files[0].channels[channel]) for channel in channels)
        return Group(name, columns, rows, True, start, self._joints)


def _header(channel: LoggedChannel) -> Column:
    shape = (0, channel.joints) if channel.joints > 1 else (0,)
    unit = channel.item.unit
    return Column(channel.item.channel, np.empty(shape), None, None if unit == "1" else unit)


def _part(group: Group, ready: dict[str, Piece]) -> Part | None:
    names = [column.name for column in group.columns]
    first = ready.get(names[0])
    return None if first is None else Part(first.time, tuple(ready[name].values[name] for name in names))
