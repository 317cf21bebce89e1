"""Read a file piece by piece, for logs that need not fit into memory.

A format that supports this has a method `pieces`; the columns of any other format become one piece per clock.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Generator, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Generic, TypeVar

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import naming
from cdtool.formats.channels.channel_map import ChannelMap
from cdtool.formats.columns import Column, Piece
from cdtool.formats.source import Format, Source

# Size of a piece: 8 MiB of float64, all columns together.
VALUES_PER_PIECE = 1 << 20


# The generator's return value is the source, whose columns have names, units and widths, but no rows.
Pieces = Generator[Piece, None, Source]

Returned = TypeVar("Returned")


class PiecewiseFormat(ABC):
    """A format that reads a file piece by piece; `columns` joins the pieces."""

    def columns(self, path: Path, wanted: ChannelMap | None = None) -> Source:
        """Return the columns that `wanted` names, or all numeric columns; raises RecordingError."""
        with naming(path):
            return join_pieces(self._read(path, wanted, None), sort=False)

    def pieces(self, path: Path, keys: Collection[str] | None = None) -> Pieces:
        """Yield all numeric columns, or the columns `keys`, some MiB at a time; raises RecordingError."""
        with naming(path):
            return (yield from self._read(path, None, keys))

    @abstractmethod
    def _read(self, path: Path, wanted: ChannelMap | None, some: Collection[str] | None) -> Pieces:
        """Yield the columns of a channel map, the columns `some`, or all columns."""


class PieceRun(Generic[Returned]):
    """An iterator over pieces; `source`, what their generator returns, is set after the last piece."""

    def __init__(self, pieces: Generator[Piece, None, Returned]) -> None:
        self._pieces = pieces
        self.source: Returned

    def __iter__(self) -> Iterator[Piece]:
        self.source = yield from self._pieces


def read_pieces(file_format: Format, path: Path, keys: Collection[str] | None = None) -> Pieces:
    """Yield all numeric columns of a file piece by piece, or at least the columns `keys`; raises RecordingError."""
    reader: Callable[..., Pieces] | None = getattr(file_format, "pieces", None)
    return (yield from (reader(path, keys) if reader is not None else split_by_clock(file_format.columns(path))))


def split_by_clock(source: Source) -> Pieces:
    """Yield a source that is in memory as one piece per clock."""
    clocks: dict[tuple[int, int], list[Column]] = {}
    for column in source.columns.values():
        clocks.setdefault((id(column.time), len(column.values)), []).append(column)
    for number, columns in enumerate(clocks.values()):
        values = {column.name: column.values for column in columns}
        yield Piece(str(number), columns[0].time, values, len(columns[0].values))
    return replace(source, columns={name: header(column) for name, column in source.columns.items()})


def header(column: Column) -> Column:
    """Return a column without its rows."""
    return replace(column, values=column.values[:0], time=None if column.time is None else column.time[:0])


def join_pieces(pieces: Pieces, sort: bool) -> Source:
    """Return a source with all its rows in memory; with `sort`, the rows of each clock are sorted by time."""
    run = PieceRun(pieces)
    times: dict[str, list[FloatArray]] = {}
    counts: dict[str, int] = {}
    parts: dict[str, tuple[str, _Grown]] = {}
    for piece in run:
        first = counts.get(piece.clock, 0)
        counts[piece.clock] = first + piece.rows
        if piece.time is not None:
            times.setdefault(piece.clock, []).append(piece.time)
        for name, values in piece.values.items():
            parts.setdefault(name, (piece.clock, _Grown()))[1].add(first, values)
    clocks = {clock: _in_order(np.concatenate(arrays), sort) for clock, arrays in times.items()}
    columns: dict[str, Column] = {}
    for name, column in run.source.columns.items():
        clock, grown = parts.pop(name, ("", _Grown()))
        values = grown.up_to(counts.get(clock, 0), column.values.shape[1:])
        time, order = clocks.get(clock, (None, None))
        columns[name] = replace(column, values=values if order is None else values[order], time=time)
    return replace(run.source, columns=columns)


class _Grown:
    """One array that grows with its pieces: a list of pieces would be in memory beside the array made of it."""

    def __init__(self) -> None:
        self._values: FloatArray | None = None
        self._filled = 0
        self._is_own = False

    def add(self, first: int, part: FloatArray) -> None:
        """Append a piece that begins at row `first`; rows before it that no piece had are missing."""
        if self._values is not None and part.shape[1:] != self._values.shape[1:]:
            return  # an array whose length changes: its source leaves it out, with a finding
        after = first + len(part)
        if self._values is None and first == 0:
            self._values = part  # the only one of a small file, without a copy
        else:
            values = self._room(after, part.shape[1:])
            values[self._filled : first] = np.nan
            values[first:after] = part
        self._filled = after

    def _room(self, rows: int, shape: tuple[int, ...]) -> FloatArray:
        if self._values is None or not self._is_own:  # a piece's array may be its time, or be seen elsewhere
            values = np.empty((rows + rows // 8, *shape))
            if self._values is not None:
                values[: self._filled] = self._values
            self._values, self._is_own = values, True
        elif len(self._values) < rows:
            self._values.resize((rows + rows // 8, *shape), refcheck=False)
        return self._values

    def up_to(self, rows: int, shape: tuple[int, ...]) -> FloatArray:
        """Return `rows` values (rows, *shape); those that no piece had are missing."""
        if self._values is not None and len(self._values) == rows == self._filled:
            return self._values
        values = self._room(rows, shape)
        values[self._filled :] = np.nan
        return values[:rows]


def _in_order(time: FloatArray, sort: bool) -> tuple[FloatArray, np.ndarray[tuple[int], np.dtype[np.intp]] | None]:
    if not sort or np.all(time[1:] >= time[:-1]):
        return time, None
    order = np.argsort(time, kind="stable")
    return time[order], order
