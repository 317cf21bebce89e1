"""Guess which column of a table is its clock, and its unit, for commands without a machine file."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.findings import Finding
from cdtool.formats.channels.log_statistics import ClockStatistics, ColumnStatistics
from cdtool.formats.columns import Column
from cdtool.formats.epoch_clock import EXCEL_2000, EXCEL_2100, SHORTEST_STEP
from cdtool.formats.source import Source
from cdtool.recordings.clock.plausible_unit import both_readings, contradicted_by_epoch, unit_since_1970
from cdtool.recordings.clock.stamps import EDGE_ROWS, ClockCleaner, count_leading_strays, gaps_in
from cdtool.recordings.distribution import Distribution
from cdtool.recordings.units import DAY_S, find_unit

# The last part of a name counts: `log.t` of a struct, `Sheet1!time` of a workbook.
_NAMES = re.compile(r"^([^\[]*[.!])?(t|ts|time|timestamp|zeit|clock|tempo|temps)([^a-z]|$)", re.IGNORECASE)
# Upper limit of the median step -> unit: it covers sample rates of 2 Hz to 2 MHz in each unit.
_UNITS = ((0.5, "s"), (500.0, "ms"), (5e5, "us"), (np.inf, "ns"))
# Steps are near the median within the first limits, as multiples of it, or the second ones if the column has the name
# of a clock.
_NEAR, _NEAR_IF_NAMED = (0.5, 1.5), (0.1, 10.0)
# Yields the pieces of a column's values; each call starts again from the first piece.
ReadColumn = Callable[[str], Iterable[FloatArray]]


@dataclass(frozen=True)
class GuessedClock:
    """The column used as the clock, its times [s], and the findings on them."""

    column: str
    time: FloatArray
    findings: tuple[Finding, ...]


@dataclass(frozen=True)
class TableClock:
    """The column of a table used as its clock: its zero and unit factor, its statistics, and the findings on it."""

    column: str
    origin: float
    factor: float
    statistics: ClockStatistics
    findings: tuple[Finding, ...]

    def times(self, stamps: Iterable[FloatArray], cleaner: ClockCleaner) -> Iterator[FloatArray]:
        """Yield strictly increasing times [s] for pieces of stamps; the last rows of a piece come with the next one.

        The cleaner has the findings on dropped rows after the last piece.
        """
        for piece in stamps:
            yield cleaner.times((piece - self.origin) * self.factor, piece)
        yield cleaner.times(np.empty(0), np.empty(0), final=True)


def is_clock_name(name: str) -> bool:
    """Return True if a column has a typical name of a clock."""
    return _NAMES.match(name) is not None


def guess_clock(source: Source) -> GuessedClock | None:
    """Return the clock of a table in memory; None if no column looks like a clock."""
    statistics: dict[str, ColumnStatistics] = {}
    for name, column in source.columns.items():
        statistics[name] = ColumnStatistics()
        statistics[name].add(column.values, in_table=True)
    clock = find_clock(source, statistics, lambda name: [source.columns[name].values])
    if clock is None:
        return None
    times = np.concatenate(list(clock.times([source.columns[clock.column].values], ClockCleaner())))
    return GuessedClock(clock.column, times, clock.findings)


def find_clock(
    source: Source, statistics: Mapping[str, ColumnStatistics], read_column: ReadColumn
) -> TableClock | None:
    """Return a table's clock, found by the names of columns, then by their steps; None if no column looks like a clock.

    `source` may be without rows: `statistics` are those of its columns, and `read_column` yields their values.
    """
    tables = [column for column in source.columns.values() if column.time is None and column.values.ndim == 1]
    # Columns that count by one come last: a row counter may have such a name, next to the real clock.
    named = sorted((c for c in tables if _NAMES.match(c.name)), key=lambda c: statistics[c.name].by_one)
    for column in dict.fromkeys(column.name for column in (*named, *tables)):
        known = statistics[column]
        if known.steps < 3 or known.forward < 0.95 * known.steps:
            continue
        stamps = _stamps(column, known.present, read_column)
        step = _usual_step(stamps(), _NEAR_IF_NAMED if is_clock_name(column) else _NEAR)
        if step is not None:
            return _describe(source.columns[column], source.first_row, step, stamps)
    return None


def _stamps(column: str, count: int, read_column: ReadColumn) -> Callable[[], Iterable[FloatArray]]:
    """Return a function that yields a column's pieces: from memory if they are few, otherwise read again each time."""
    if count > 1 << 22:  # 32 MiB
        return lambda: read_column(column)
    kept = [piece.copy() for piece in read_column(column)]  # copies, as a view would keep all columns of the piece
    return lambda: kept


def _usual_step(stamps: Iterable[FloatArray], near: tuple[float, float]) -> float | None:
    """Return the median step between time stamps; None if the steps are too irregular for a clock."""
    steps, last = Distribution(), np.empty(0)
    for piece in stamps:
        known = np.concatenate((last, piece[np.isfinite(piece)]))
        steps.add(np.diff(known))
        last = known[-1:]
    median = steps.median
    # A column is a clock if 95 % of its steps are forward, and 80 % near the median.
    regular = median > 0.0 and steps.share(near[0] * median, near[1] * median) >= 0.8
    return median if regular else None


def _describe(column: Column, first_row: int, step: float, stamps: Callable[[], Iterable[FloatArray]]) -> TableClock:
    known = find_unit(column.unit) if column.unit else None
    evidence: Literal["header", "epoch", "excel", "digits", "steps"]
    start = _start(stamps())
    epoch = unit_since_1970(start)
    wrong: tuple[Finding, ...] = ()
    stated = known is not None and known.si == "s"
    if known is not None and stated and contradicted_by_epoch(start, known.factor):
        stated = False
        readings = both_readings(start, known.factor, str(column.unit), epoch)
        wrong = (Finding("header_unit_implausible", column.name, {"readings": readings}),)
    if stated:
        unit, evidence = str(column.unit), "header"
    elif epoch:
        unit, evidence = epoch, "epoch"
    elif EXCEL_2000 < start < EXCEL_2100 and step < SHORTEST_STEP:
        unit, evidence = "days", "excel"
    else:
        unit, evidence = next(name for most, name in _UNITS if step < most), "steps"
        if unit == "s" and start > DAY_S and all(map(_may_be_digits_of_a_day, stamps())):
            evidence = "digits"
    factor = DAY_S if unit == "days" else found.factor if (found := find_unit(unit)) else 1.0
    # An epoch is subtracted before scaling, so that no digit is lost.
    origin = start if epoch or unit == "days" else 0.0
    assumed = Finding("assumed_clock", column.name, {"unit": unit, "evidence": evidence, "start": start, "step": step})
    clock = TableClock(column.name, origin, factor, ClockStatistics(), (assumed, *wrong))
    return _with_findings(clock, first_row, stamps)


def _may_be_digits_of_a_day(stamps: FloatArray) -> bool:
    """Return whether time stamps may be written as HHMMSS: 235959.98 is 23:59:59.98."""
    known = stamps[np.isfinite(stamps)]
    return bool(np.all((known < 240000.0) & (known % 10000.0 < 6000.0) & (known % 100.0 < 60.0)))


def _start(stamps: Iterable[FloatArray]) -> float:
    """Return the first time stamp that is not stray, nor outside of an epoch if a later one is within it."""
    known = next(found for piece in stamps if len(found := piece[np.isfinite(piece)]))
    rows = count_leading_strays(known, np.inf)
    if not rows and not unit_since_1970(known[0]):
        rows = next((i for i, stamp in enumerate(known[: EDGE_ROWS + 1]) if unit_since_1970(stamp)), 0)
    return float(known[rows])


def _with_findings(clock: TableClock, first_row: int, stamps: Callable[[], Iterable[FloatArray]]) -> TableClock:
    """Return the clock with its statistics and all findings."""
    cleaner = ClockCleaner()
    for times in clock.times(stamps(), cleaner):
        clock.statistics.add(times, len(times))
    gaps = gaps_in(clock.times(stamps(), ClockCleaner()), clock.statistics.steps.median, clock.column)
    return replace(clock, findings=(*clock.findings, *cleaner.findings(first_row), *gaps))
