"""The mapped channels of a file of messages as logged, in SI, piece by piece: as channel_assembly makes them."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from cdtool.channels import ChannelSource
from cdtool.clock.stamps import CleanPieces, Gaps, missing_findings
from cdtool.columns import Column, Piece
from cdtool.distribution import Distribution
from cdtool.errors import RecordingError
from cdtool.findings import Finding
from cdtool.formats.column_names import resolve_columns
from cdtool.formats.pieces import MappedLog, Run
from cdtool.formats.source import Source
from cdtool.formats.time_order import Lateness, by_time
from cdtool.ingest.channel_assembly import (
    apart_findings,
    check_width,
    in_si,
    stuck_findings,
)
from cdtool.ingest.part_gaps import PartSpan
from cdtool.machine_file import MachineFile
from cdtool.recording import MEASURED, FloatArray


class LoggedChannel:
    """A channel's samples so far: cleaned and in SI, with what is odd about them.

    `period` [s] is the median step, where it is known: then gaps are looked for, too.
    """

    def __init__(self, path: Path, item: ChannelSource, names: Sequence[str], period: float | None = None) -> None:
        self._path, self.item, self.joints, self._names = path, item, len(item.factor), names
        self.clean = CleanPieces()
        self.rows, self.first, self.last = 0, np.nan, np.nan
        self.steps = Distribution()
        self.digest: Any = hashlib.blake2b(digest_size=16)  # of the times
        self._gaps = None if period is None else Gaps(period, item.channel)
        self._masked, self._missing = in_si(item, np.empty((0, self.joints)))[1], 0
        self._known = np.zeros(self.joints, np.int64)
        self._least, self._most = np.full(self.joints, np.inf), np.full(self.joints, -np.inf)

    def add(self, stamps: FloatArray, values: FloatArray | None, final: bool = False) -> tuple[FloatArray, FloatArray]:
        """The next samples in the order of their stamps [s]: their times, `time_offset` included, and (n, J) values.

        The last ones wait for those that follow, or for `final`.
        """
        table = np.full((len(stamps), self.joints), np.nan) if values is None else _table(values)
        check_width(self._path, self.item, table.shape[1])
        time, table = self.clean.rows(stamps, stamps, table, final)
        rows, masked = in_si(self.item, table)
        self._masked += masked
        present = np.isfinite(rows)
        self._missing += rows.size - int(np.count_nonzero(present))
        self._known += np.count_nonzero(present, axis=0)
        self._least = np.fmin(self._least, np.fmin.reduce(rows, axis=0, initial=np.inf))
        self._most = np.fmax(self._most, np.fmax.reduce(rows, axis=0, initial=-np.inf))
        if len(time):
            self.steps.add(np.diff(time) if self.rows == 0 else np.diff(time, prepend=self.last))
            self.first, self.last = float(time[0]) if self.rows == 0 else self.first, float(time[-1])
            self.digest.update(time)
            self.rows += len(time)
            if self._gaps is not None:
                self._gaps.add(time)
        return (time + self.item.time_offset if self.item.time_offset else time), rows

    @property
    def is_coarse(self) -> bool:
        """Its clock is to be made a straight line of, for which clean_time needs it as a whole."""
        return self.item.channel != "event" and self.clean.is_coarse

    @property
    def span(self) -> tuple[float, float]:
        """First and last time [s], `time_offset` included."""
        return self.first + self.item.time_offset, self.last + self.item.time_offset

    @property
    def constant(self) -> list[bool]:
        """Joint by joint: does the value never change?"""
        return list(map(bool, (self._known > 1) & (self._least == self._most)))

    def findings(self) -> list[Finding]:
        """What is odd, in the words of channel_assembly."""
        found = [replace(item, channel=f"{self.item.channel} time") for item in self.clean.findings(0)]
        found += self._masked.findings(self.item, self._names)
        found += self._gaps.findings() if self._gaps is not None else []
        return found + missing_findings(self._missing, self.rows * self.joints, self.item.channel, self._masked.total)


class LoggedFile:
    """A file of messages that is read once for its figures, twice where they do not stand in the order of time.

    `channels` hold the figures, `late` [s] by how much any sample stands behind later ones. Gaps are known once
    `pieces` has been run through. `log` gives the mapped fields of the file at `path`. Raises RecordingError.
    """

    def __init__(self, path: Path, machine_file: MachineFile, log: MappedLog) -> None:
        self.path, self._items, self._joints = path, machine_file.topics.sources, machine_file.topics.joints
        self._log = log
        self._is_sorted = True
        self.channels = self._new()
        source, lateness = self._survey()
        self.late = lateness.late
        self._columns: Mapping[str, list[Column]] = {name: [column] for name, column in source.columns.items()}
        if not (self._is_sorted and self._log.settled):
            self._survey_in_order()
        source, held = resolve_columns(source, machine_file.topics)
        self.channels = {item.channel: self.channels[item.channel] for item in held.sources}
        self.origin, self._told = source.origin, source.findings
        for channel in self.channels.values():
            check_width(path, channel.item, math.prod(source.columns[channel.item.described].values.shape[1:]))
            if not channel.rows:
                name = channel.item.channel
                raise RecordingError(f"{path}: channel '{name}' has no sample with a time", channel=name)
        offsets = [item.time_offset for item in held.sources]
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
    def spanned(self) -> PartSpan:
        """What its channels span."""
        steps = {name: each.steps.median if each.steps.count else np.inf for name, each in self.channels.items()}
        return PartSpan(
            self.path, self.origin, {name: (*each.span, steps[name]) for name, each in self.channels.items()}
        )

    @property
    def is_coarse(self) -> bool:
        """A channel's clock cannot be cleaned piece by piece."""
        return any(channel.is_coarse for channel in self.channels.values())

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What is odd about the file and its channels."""
        found = [*self._told, *(item for channel in self.channels.values() for item in channel.findings())]
        constant = {name: self.channels[name].constant for name in MEASURED if name in self.channels}
        found += stuck_findings(constant, self._joints)
        found += apart_findings({name: channel.span for name, channel in self.channels.items()})
        return tuple(found)

    def pieces(self, names: Collection[str], shift: float) -> Iterator[Piece]:
        """The channels of those names, each a clock of its own; `shift` [s] is added to their times."""
        again = {
            name: LoggedChannel(self.path, channel.item, self._joints, channel.steps.median)
            for name, channel in self.channels.items()
            if name in names
        }
        for channel, time, rows in _added(again, self._in_order()):
            if len(time):
                name, values = channel.item.channel, rows if channel.joints > 1 else rows[:, 0]
                yield Piece(name, time + shift, {name: values}, len(time))
        self.channels |= again

    def _survey(self) -> tuple[Source, Lateness]:
        """The figures, as if all were in order."""
        lateness, orders = Lateness(), dict[str, Lateness]()
        run = Run(self._log.pieces())

        def looked_at() -> Iterator[Piece]:
            for piece in run:
                if piece.time is not None:
                    lateness.add(piece.time)
                    orders.setdefault(piece.clock, Lateness()).add(piece.time)
                yield piece

        for _ in _added(self.channels, looked_at()):
            pass
        self._is_sorted = all(order.late == 0.0 for order in orders.values())
        return run.source, lateness

    def _survey_in_order(self) -> None:
        self.channels = self._new()
        for _ in _added(self.channels, self._in_order()):
            pass

    def _new(self) -> dict[str, LoggedChannel]:
        return {item.channel: LoggedChannel(self.path, item, self._joints) for item in self._items}

    def _in_order(self) -> Iterator[Piece]:
        """The fields' pieces, those of each field in the order of their times."""
        run = Run(self._log.pieces())
        if self._is_sorted:
            yield from run
        else:
            for ready in by_time(run, self._columns, self.late, sort=True):
                yield from ready.values()


def _added(
    channels: Mapping[str, LoggedChannel], pieces: Iterable[Piece]
) -> Iterator[tuple[LoggedChannel, FloatArray, FloatArray]]:
    """The channels that each field's pieces are one of, with their times and values; at the end what still waits."""
    for piece in pieces:
        for channel in channels.values():
            if channel.item.described == piece.clock and piece.time is not None:
                yield channel, *channel.add(piece.time, piece.values.get(piece.clock))
    for channel in channels.values():
        yield channel, *channel.add(np.empty(0), np.empty((0, channel.joints)), final=True)


def _table(values: FloatArray) -> FloatArray:
    """(n, J) of values (n,) or (n, J), of no rows, too."""
    return values[:, np.newaxis] if values.ndim == 1 else values.reshape(len(values), math.prod(values.shape[1:]))
