"""Tables of text whose head states the clock of each column: a column of stamps, or a start and a period.

A channel has a sample in each row in which its clock has a time. Rows may end before their last cell, and cells may be
blank: a channel has no sample there.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Generator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Protocol

import numpy as np

from cdtool.columns import Column, Piece
from cdtool.errors import RecordingError
from cdtool.findings import Finding
from cdtool.formats.csv.cell_values import RequestedColumns, not_numeric
from cdtool.formats.csv.dialect import Dialect
from cdtool.formats.csv.rows import RowReader, Rows
from cdtool.formats.csv.stamps import MISSING_STAMP
from cdtool.large_integers import rounded_integers, rounding_finding
from cdtool.recording import BoolArray, FloatArray

# A clock's step may differ from the stated period by this share of it.
_SAME_PERIOD = 0.01


class RowClock(Protocol):
    """The times of a table's rows; `numbers` and `whole` are the columns that it needs."""

    @property
    def numbers(self) -> tuple[int, ...]:
        """Columns of numbers."""
        ...

    @property
    def whole(self) -> tuple[int, ...]:
        """Columns of integers with more digits than float64 can represent."""
        ...

    def times(self, rows: Rows) -> FloatArray:
        """Return the time [s] of each row (n,); NaN if it has none."""
        ...


@dataclass(frozen=True)
class StampClock:
    """A column of stamps; `per_second` of them are a second, and `offset` [s] is added."""

    column: int
    per_second: float = 1.0
    offset: float = 0.0
    whole: tuple[int, ...] = ()

    @property
    def numbers(self) -> tuple[int, ...]:
        """The column."""
        return (self.column,)

    def times(self, rows: Rows) -> FloatArray:
        """Return the stamps in seconds."""
        times = rows.numbers[self.column] / self.per_second
        return times + self.offset if self.offset else times


@dataclass(frozen=True)
class TickClock:
    """A column of integers, which count `per_second` ticks in a second; `first` is the tick at time 0."""

    column: int
    per_second: float
    first: int
    numbers: tuple[int, ...] = ()

    @property
    def whole(self) -> tuple[int, ...]:
        """The column."""
        return (self.column,)

    def times(self, rows: Rows) -> FloatArray:
        """Return the seconds since the first tick: differences are exact before they are rounded."""
        ticks = rows.whole[self.column]
        return np.where(ticks == MISSING_STAMP, np.nan, (ticks - self.first) / self.per_second)


@dataclass(frozen=True)
class ClockGroup:
    """Columns that share a clock. `columns`: their names, with the number of the column in the table.

    `sparse`: a row without any value of the group is no sample. `held`: a row that repeats the one before is no sample
    either. `period` [s] is the period that the head states (0: none).
    """

    name: str
    columns: Mapping[str, int]
    clock: RowClock
    sparse: bool = False
    held: bool = False
    period: float = 0.0


@dataclass
class TimedTable:
    """What is known of a timed table after its last row: `left_out` columns, the number of `rows`, and findings."""

    left_out: set[str] = field(default_factory=set)
    rows: int = 0
    findings: list[Finding] = field(default_factory=list)


def timed_pieces(
    path: Path, dialect: Dialect, groups: Sequence[ClockGroup], keys: Collection[str], survey: bool
) -> Generator[Piece, None, TimedTable]:
    """Yield the columns of a table with their times, block by block.

    Parameters
    ----------
    path
        The file, for messages.
    dialect
        The dialect of the rows, with `short_rows`.
    groups
        The columns of the table by their clocks.
    keys
        The names of the columns to read.
    survey
        Leave out a column that is not numeric, with a finding; otherwise that is an error.

    Returns
    -------
    generator
        Pieces of each group's samples; its return value is what is known after the last row.

    Raises
    ------
    RecordingError
        A line cannot be read, the words are those of a clock, or the rows would not fit into memory.
    """
    left_out = {
        column: not_numeric(key, dialect.words[column].line, dialect.words[column].text)
        for group in groups
        for key, column in group.columns.items()
        if survey and key in keys and column in dialect.words
    }
    wanted = [
        replace(group, columns={k: column for k, column in group.columns.items() if k in keys}) for group in groups
    ]
    samples = [_GroupRows(group) for group in wanted if group.columns]
    clocks = [each.group.clock for each in samples]
    times = {column for clock in clocks for column in clock.numbers}
    needed = {column for group in wanted for column in group.columns.values()} - left_out.keys() | times
    whole = {column for clock in clocks for column in clock.whole}
    reader = RowReader(dialect, RequestedColumns(sorted(needed), left_out=left_out, whole=sorted(whole)), survey)
    for rows in reader.pieces():
        for column in times - {*reader.values.numeric}:
            raise RecordingError(f"{path}: {reader.values.left_out[column]}", "it is the clock of a channel")
        with np.errstate(over="ignore", invalid="ignore"):  # of damaged stamps, which are then no times
            yield from [each.piece(rows) for each in samples]
    lost = {
        key for each in samples for key, column in each.group.columns.items() if column not in reader.values.numeric
    }
    findings = [*reader.findings, *(found for each in samples for found in each.findings(lost))]
    return TimedTable(lost, reader.lines.rows, findings)


class _GroupRows:
    """The rows of one group, block after block."""

    def __init__(self, group: ClockGroup) -> None:
        self.group = group
        self.untimed: Counter[str] = Counter()
        self.rounded: Counter[str] = Counter()
        self.repeated = 0
        self.last: tuple[float, dict[str, float]] | None = None
        self.step = 0.0  # in the first block

    def piece(self, rows: Rows) -> Piece:
        """Return the samples in the next rows of the table."""
        group = self.group
        time = group.clock.times(rows)
        empty = np.full(rows.count, np.nan)
        values = {key: rows.numbers.get(column, empty) for key, column in group.columns.items()}
        timed = np.isfinite(time)
        if group.sparse:
            timed &= np.logical_or.reduce([np.isfinite(column) for column in values.values()])
        if not timed.all():
            untimed = ~np.isfinite(time)
            self.untimed.update(
                {key: int(np.count_nonzero(np.isfinite(column[untimed]))) for key, column in values.items()}
            )
            time, values = time[timed], {key: column[timed] for key, column in values.items()}
        if group.held and len(time):
            new = self._is_new(time, values)
            self.repeated += int(np.count_nonzero(~new))
            self.last = float(time[-1]), {key: float(column[-1]) for key, column in values.items()}
            if not new.all():
                time, values = time[new], {key: column[new] for key, column in values.items()}
        if not self.step and len(time) > 1:
            self.step = float(np.median(np.diff(time)))
        self.rounded.update({key: rounded_integers(column) for key, column in values.items()})
        return Piece(group.name, time, values, len(time))

    def _is_new(self, time: FloatArray, values: Mapping[str, FloatArray]) -> BoolArray:
        """Return whether each row differs from the one before, which may be in the block before."""
        last_time, last_values = self.last or (np.nan, dict.fromkeys(values, np.nan))
        same: BoolArray = time == np.concatenate(([last_time], time[:-1]))
        for key, column in values.items():
            if not same.any():
                break
            before = np.concatenate(([last_values[key]], column[:-1]))
            same &= (column == before) | (np.isnan(column) & np.isnan(before))
        return ~same

    def findings(self, left_out: Collection[str]) -> list[Finding]:
        """Return what was found about the group's columns and their clock."""
        keys = [key for key in self.group.columns if key not in left_out]
        findings = [
            Finding("values_without_time", key, {"count": self.untimed[key]}) for key in keys if self.untimed[key]
        ]
        for key in keys:
            findings += rounding_finding(key, self.rounded[key])
        if self.repeated and keys:
            findings.append(Finding("repeated_rows", keys[0], {"count": self.repeated}))
        stated = self.group.period
        if keys and stated and self.step and abs(self.step / stated - 1.0) > _SAME_PERIOD:
            findings.append(Finding("stated_period_differs", keys[0], {"stated": stated, "step": self.step}))
        return findings


def headers(groups: Sequence[ClockGroup], units: Mapping[str, str | None], keys: Collection[str]) -> dict[str, Column]:
    """Return the columns `keys` of the groups without their rows."""
    names = [key for group in groups for key in group.columns if key in keys]
    return {key: Column(key, np.empty(0), np.empty(0), units.get(key)) for key in names}
