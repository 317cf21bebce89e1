"""A file piece by piece: for logs that need not fit into memory.

A format that can hand its columns over so has a method `pieces`; the columns of any other are a piece a clock.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Generator, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Protocol

import numpy as np

from cdtool.channels import ChannelMap
from cdtool.columns import Column, Piece
from cdtool.formats.source import Format, Source
from cdtool.recording import FloatArray

# What a format cuts its pieces to: 8 MiB of float64, all columns together.
VALUES_A_PIECE = 1 << 20


# At their end pieces give the source: its columns have names, units and widths, but no rows.
Pieces = Generator[Piece, None, Source]


class MappedLog(Protocol):
    """The columns of a map piece by piece, as often as is asked for; each column is a clock of its own.

    `settled`: the times of the last pass count from the origin that its source has.
    """

    settled: bool

    def pieces(self) -> Pieces:
        """The columns from the first row on; raises RecordingError."""
        ...


def mapped_log(found: Format, path: Path, wanted: ChannelMap) -> MappedLog | None:
    """The columns that `wanted` names of a file that need not fit into memory; None where the format has none such."""
    opened: Callable[[Path, ChannelMap], MappedLog] | None = getattr(found, "mapped", None)
    return None if opened is None else opened(path, wanted)


class InPieces(ABC):
    """A format that reads a file piece by piece: all of it at once is the join of these pieces."""

    def columns(self, path: Path, wanted: ChannelMap | None = None) -> Source:
        """Return the columns that `wanted` names, or all numeric ones; raises RecordingError."""
        return joined(self._read(path, wanted, None), sort=False)

    def pieces(self, path: Path, keys: Collection[str] | None = None) -> Pieces:
        """Yield all numeric columns, or those of `keys`, some MiB at a time; raises RecordingError."""
        return self._read(path, None, keys)

    @abstractmethod
    def _read(self, path: Path, wanted: ChannelMap | None, some: Collection[str] | None) -> Pieces:
        """Yield the columns of a map, or those of `some`, or all."""


class Run:
    """Pieces on their way; `source` holds once they have been run through."""

    def __init__(self, pieces: Pieces) -> None:
        self._pieces = pieces
        self.source: Source

    def __iter__(self) -> Iterator[Piece]:
        self.source = yield from self._pieces


def read_pieces(found: Format, path: Path, keys: Collection[str] | None = None) -> Pieces:
    """All numeric columns of a file piece by piece, or at least those of `keys`; raises RecordingError."""
    reader: Callable[..., Pieces] | None = getattr(found, "pieces", None)
    return (yield from (reader(path, keys) if reader is not None else as_pieces(found.columns(path))))


def as_pieces(source: Source) -> Pieces:
    """A source that is in memory: a piece for each of its clocks."""
    clocks: dict[tuple[int, int], list[Column]] = {}
    for column in source.columns.values():
        clocks.setdefault((id(column.time), len(column.values)), []).append(column)
    for number, columns in enumerate(clocks.values()):
        values = {column.name: column.values for column in columns}
        yield Piece(str(number), columns[0].time, values, len(columns[0].values))
    return replace(source, columns={name: header(column) for name, column in source.columns.items()})


def header(column: Column) -> Column:
    """A column without its rows."""
    return replace(column, values=column.values[:0], time=None if column.time is None else column.time[:0])


def joined(pieces: Pieces, sort: bool) -> Source:
    """A source with all its rows in memory; with `sort` those of each clock in the order of its times."""
    run = Run(pieces)
    times: dict[str, list[FloatArray]] = {}
    counts: dict[str, int] = {}
    parts: dict[str, tuple[str, list[tuple[int, FloatArray]]]] = {}
    for piece in run:
        first = counts.get(piece.clock, 0)
        counts[piece.clock] = first + piece.rows
        if piece.time is not None:
            times.setdefault(piece.clock, []).append(piece.time)
        for name, values in piece.values.items():
            parts.setdefault(name, (piece.clock, []))[1].append((first, values))
    clocks = {clock: _in_order(np.concatenate(found), sort) for clock, found in times.items()}
    columns: dict[str, Column] = {}
    for name, column in run.source.columns.items():
        clock, found = parts.pop(name, ("", []))  # so that no more than one column is there twice
        values = _put(found, counts.get(clock, 0), column.values.shape[1:])
        time, order = clocks.get(clock, (None, None))
        columns[name] = replace(column, values=values if order is None else values[order], time=time)
    return replace(run.source, columns=columns)


def _put(parts: list[tuple[int, FloatArray]], rows: int, shape: tuple[int, ...]) -> FloatArray:
    values = np.full((rows, *shape), np.nan)
    for first, part in parts:
        values[first : first + len(part)] = part
    return values


def _in_order(time: FloatArray, sort: bool) -> tuple[FloatArray, np.ndarray[tuple[int], np.dtype[np.intp]] | None]:
    if not sort or np.all(time[1:] >= time[:-1]):
        return time, None
    order = np.argsort(time, kind="stable")
    return time[order], order
