"""Pieces of several clocks in the order of their times, however late the file has some of them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from cdtool.columns import Column, Piece
from cdtool.recording import FloatArray

# Rows are handed on once so many wait, or twice as many as had to be left waiting before.
_ROWS = 1 << 15


@dataclass
class Lateness:
    """By how much any row's time lies behind the highest before it [s]: what has to wait for it, and how long."""

    highest: float = -np.inf
    late: float = 0.0

    def add(self, time: FloatArray) -> None:
        """Take the times of a piece."""
        known = time[np.isfinite(time)]
        if not len(known):
            return
        before = np.maximum.accumulate(np.concatenate(([self.highest], known)))
        self.highest = float(before[-1])
        self.late = max(self.late, float(np.max(before[:-1] - known)))


def by_time(
    pieces: Iterable[Piece], columns: Mapping[str, Sequence[Column]], late: float, sort: bool, most: int = _ROWS
) -> Iterator[dict[str, Piece]]:
    """The rows of all clocks in the order of their times, a piece of each clock at once; rows of one time together.

    `columns` are those of each clock: a value that a piece does not have is NaN, a clock that is not named is passed
    over. No row may be later than `late` [s] (Lateness): so much of the log is held in memory, and `most` rows. Without
    `sort` the rows of a clock stay in the file's order where its times run backward.
    """
    waiting: dict[str, list[Piece]] = {clock: [] for clock in columns}
    highest, held, left = -np.inf, 0, 0
    for piece in pieces:
        if piece.clock not in columns or piece.time is None or not piece.rows:
            continue
        waiting[piece.clock].append(piece)
        highest = float(np.fmax(highest, np.fmax.reduce(piece.time)))
        held += piece.rows
        if held >= max(most, 2 * left):
            # Rows of one time stay together, whatever the difference was rounded to.
            limit = highest - late - 4.0 * np.spacing(abs(highest) + late)
            ready = _ready(waiting, columns, limit, sort)
            left = held = sum(part.rows for parts in waiting.values() for part in parts)
            if ready:
                yield ready
    if rest := _ready(waiting, columns, np.inf, sort):
        yield rest


def _ready(
    waiting: dict[str, list[Piece]], columns: Mapping[str, Sequence[Column]], limit: float, sort: bool
) -> dict[str, Piece]:
    """What lies before `limit` [s] of each clock; the rest goes on waiting."""
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
    """A copy: a view would keep all the rest in memory."""
    return Piece(
        clock, time[rows].copy(), {name: column[rows].copy() for name, column in values.items()}, len(time[rows])
    )


def _column(parts: Sequence[Piece], column: Column) -> FloatArray:
    return np.concatenate([values_of(part, column) for part in parts])


def values_of(piece: Piece, column: Column) -> FloatArray:
    """A column's values in a piece, NaN where it has none."""
    found = piece.values.get(column.name)
    return np.full((piece.rows, *column.values.shape[1:]), np.nan) if found is None else found
