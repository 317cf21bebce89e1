"""Statistics of a log that is read once, piece by piece; the memory they need does not depend on its length."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.formats.columns import Piece
from cdtool.formats.pieces import PieceRun, Pieces
from cdtool.formats.source import Source
from cdtool.formats.time_order import Lateness, by_time
from cdtool.recordings.distribution import Distribution


@dataclass
class ColumnStatistics:
    """A column's values so far: the count of finite ones, their extremes, and for a column of a table its steps.

    `steps` counts the steps between finite values, `forward` those that are not negative, and `apart` those over rows
    without a value. `by_one`: every step is 1 and no value is missing.
    """

    present: int = 0
    minimum: float = np.inf
    maximum: float = -np.inf
    steps: int = 0
    forward: int = 0
    apart: int = 0
    by_one: bool = True
    last: float = np.nan

    def add(self, values: FloatArray, in_table: bool) -> None:
        """Add the rows of a piece."""
        numbers = values.ravel()
        finite = np.isfinite(numbers)
        present = numbers[finite]
        if in_table and values.ndim == 1 and len(present) < len(numbers):
            self.apart += int(np.count_nonzero(np.diff(np.flatnonzero(finite)) > 1))
        if in_table and values.ndim == 1:
            self._add_steps(present, len(present) == len(numbers))
        if len(present):
            self.present += len(present)
            self.minimum = min(self.minimum, float(present.min()))
            self.maximum = max(self.maximum, float(present.max()))

    @property
    def is_of_lower_rate(self) -> bool:
        """Return whether most values of a table's column are followed by a row without one (clock.lower_rate)."""
        return 0 < self.steps <= 2 * self.apart

    def _add_steps(self, present: FloatArray, all_present: bool) -> None:
        steps = np.diff(present) if self.present == 0 else np.diff(present, prepend=self.last)
        self.steps += len(steps)
        self.forward += int(np.count_nonzero(steps >= 0.0))
        self.by_one = self.by_one and all_present and bool(np.all(steps == 1.0))
        if len(present):
            self.last = float(present[-1])


@dataclass
class ClockStatistics:
    """A clock's times so far [s]; clocks with the same `digest` are equal to the bit."""

    rows: int = 0
    first: float = np.nan
    last: float = np.nan
    lowest: float = np.inf
    steps: Distribution = field(default_factory=Distribution)
    lateness: Lateness = field(default_factory=Lateness)
    digest: Any = field(default_factory=lambda: hashlib.blake2b(digest_size=16))

    def add(self, time: FloatArray | None, rows: int) -> None:
        """Add the times of a piece."""
        if time is not None and rows:
            steps = np.diff(time) if self.rows == 0 else np.diff(time, prepend=self.last)
            self.steps.add(steps[np.isfinite(steps)])
            self.lateness.add(time)
            self.first = float(time[0]) if self.rows == 0 else self.first
            self.last = float(time[-1])
            self.lowest = min(self.lowest, float(np.fmin.reduce(time)))
            self.digest.update(np.ascontiguousarray(time))
            if len(steps) and np.isnan(steps).any():
                self.digest.update(b"unknown times are those of no other clock")
        self.rows += rows

    @property
    def rate(self) -> float | None:
        """The sample rate from the median step [Hz]; None if there is no step."""
        period = self.steps.median
        return 1.0 / period if period > 0.0 else None


class LogStatistics:
    """A log's `source` (its columns without rows), and the statistics of each column and of its clock (`clock_of`).

    `read` opens the log, for some of its columns or all. `in_order`: rows are sorted by their times, as for messages of
    topics, instead of in the order of the file. `late` [s] is how long rows then wait for earlier ones (by_time).
    """

    def __init__(self, read: Callable[[Collection[str] | None], Pieces], in_order: bool) -> None:
        self._read, self.sorted = read, in_order
        self.columns: dict[str, ColumnStatistics] = {}
        self.clocks: dict[str, ClockStatistics] = {}
        self.clock_of: dict[str, str] = {}
        self.digests: dict[str, Any] = {}  # of columns of tables: one may be the clock of others
        lateness = Lateness()
        run = PieceRun(read(None))
        for piece in run:
            self._add(piece)
            if piece.time is not None:
                lateness.add(piece.time)
        self.source: Source = run.source
        for name in self.source.columns.keys() - self.columns.keys():  # a table without a row
            self.columns[name] = ColumnStatistics()
        self.late = lateness.late
        if self.sorted and any(clock.lateness.late > 0.0 for clock in self.clocks.values()):
            self._repeat_in_order()

    def pieces(self, keys: Collection[str] | None = None) -> Iterator[Piece]:
        """Read the log again."""
        return iter(PieceRun(self._read(keys)))

    def values_of(self, name: str) -> Iterator[FloatArray]:
        """Read a column's values again, piece by piece."""
        return (piece.values[name] for piece in self.pieces([name]) if name in piece.values)

    def rows(self, name: str) -> int:
        """Return the number of rows of a column."""
        clock = self.clock_of.get(name)
        return 0 if clock is None else self.clocks[clock].rows

    def _add(self, piece: Piece) -> None:
        self.clocks.setdefault(piece.clock, ClockStatistics()).add(piece.time, piece.rows)
        for name, values in piece.values.items():
            self.clock_of.setdefault(name, piece.clock)
            self.columns.setdefault(name, ColumnStatistics()).add(values, piece.time is None)
            if piece.time is None and values.ndim == 1:
                digest = self.digests.setdefault(name, hashlib.blake2b(digest_size=16))
                digest.update(np.ascontiguousarray(values))

    def _repeat_in_order(self) -> None:
        """Compute the statistics of the clocks again in the order of their times, which is not that of the file."""
        self.clocks = {clock: ClockStatistics() for clock in self.clocks}
        for ready in by_time(self.pieces(), dict.fromkeys(self.clocks, ()), self.late, sort=True):
            for clock, piece in ready.items():
                self.clocks[clock].add(piece.time, piece.rows)
