"""Merge pieces of several clocks in the order of their times, even if the file stores some of them late."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.formats.columns import Column, Piece

# Rows are yielded when this many are buffered, or twice as many as remained in the buffer the last time.
_ROWS = 1 << 15


@dataclass
class Lateness:
    """The largest delay `late` [s] of a row's time behind the highest time before it: how long other rows must wait."""

    highest: float = -np.inf
    late: float = 0.0

    def add(self, time: FloatArray) -> None:
        """Add the times of a piece."""
        known = time[np.isfinite(time)]
        if not len(known):
            return
        before = np.maximum.accumulate(np.concatenate(([self.highest], known)))
        self.highest = float(before[-1])
        self.late = max(self.late, float(np.max(before[:-1] - known)))


def by_time(
    pieces: Iterable[Piece], columns: Mapping[str, Sequence[Column]], late: float, sort: bool, most: int = _ROWS
) -> Iterator[dict[str, Piece]]:
    """Yield the rows of all clocks in the order of their times, a piece of each clock at once.

    Rows with the same time are in the same step. `columns` are the columns of each clock: a value that a piece does not
    have is NaN, and clocks that are not named are skipped. No row may be delayed by more than `late` [s] (see
    `Lateness`): memory contains that time span of the log and up to `most` rows. Without `sort` the rows of a clock
    stay in the file's order even if its times run backward.
    """
    waiting: dict[str, list[Piece]] = {clock: [] for clock in columns}
    highest, buffered, left = -np.inf, 0, 0
    for piece in pieces:
        if piece.clock not in columns or piece.time is None or not piece.rows:
            continue
        waiting[piece.clock].append(piece)
        highest = float(np.fmax(highest, np.fmax.reduce(piece.time)))
        buffered += piece.rows
        if buffered >= max(most, 2 * left):
            # A margin for rounding errors, so that rows with the same time stay together.
            limit = highest - late - 4.0 * np.spacing(abs(highest) + late)
            ready = _ready(waiting, columns, limit, sort)
            left = buffered = sum(part.rows for parts in waiting.values() for part in parts)
            if ready:
                yield ready
    if rest := _ready(waiting, columns, np.inf, sort):
        yield rest


def _ready(
    waiting: dict[str, list[Piece]], columns: Mapping[str, Sequence[Column]], limit: float, sort: bool
) -> dict[str, Piece]:
    """Return the rows of each clock before `limit` [s]; the other rows stay in `waiting`."""
    ready: dict[str, Piece] = {}
    for clock, parts in waiting.items():
        if not parts:
            continue
        time = np.concatenate([part.time for part in parts if part.time is not None])
        order = np.argsort(time, kind="stable") if sort and np.any(time[1:] < time[:-1]) else slice(None)
        time = time[order]
        values = {column.name: _column(parts, column)[order] for column in columns[clock]}
        cut = len(time) if limit == np.inf else int(np.searchsorted(np.fmax.accumulate(time), limit, side="left"))
        if cut:
            ready[clock] = _part(clock, time, values, slice(None, cut))
        waiting[clock] = [_part(clock, time, values, slice(cut, None))] if cut < len(time) else []
    return ready


def _part(clock: str, time: FloatArray, values: Mapping[str, FloatArray], rows: slice) -> Piece:
    """Return a copy of these rows: a view would keep the whole arrays in memory."""
    return Piece(
        clock, time[rows].copy(), {name: column[rows].copy() for name, column in values.items()}, len(time[rows])
    )


def _column(parts: Sequence[Piece], column: Column) -> FloatArray:
    return np.concatenate([values_of(part, column) for part in parts])


def values_of(piece: Piece, column: Column) -> FloatArray:
    """Return a column's values in a piece; NaN if the piece does not contain the column."""
    values = piece.values.get(column.name)
    return np.full((piece.rows, *column.values.shape[1:]), np.nan) if values is None else values
