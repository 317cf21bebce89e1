"""Which column of a table is its clock, and in which unit? A guess, for a first look without a machine file."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from cdtool.clock.plausible_unit import both_readings, contradicted_by_epoch, unit_since_1970
from cdtool.clock.stamps import EDGE_ROWS, ClockCleaner, count_leading_strays, gaps_in
from cdtool.columns import Column
from cdtool.distribution import Distribution
from cdtool.findings import Finding
from cdtool.findings.clocks import AssumedClock, HeaderUnitImplausible
from cdtool.formats.source import Source
from cdtool.ingest.log_statistics import ClockFigures, ColumnFigures
from cdtool.recording import FloatArray
from cdtool.units import find_unit

_NAMES = re.compile(r"^(t|ts|time|timestamp|zeit|clock|tempo|temps)([^a-z]|$)", re.IGNORECASE)
# Median step -> unit: log rates of 2 Hz to 2 MHz in each of them.
_UNITS = ((0.5, "s"), (500.0, "ms"), (5e5, "us"), (np.inf, "ns"))
# Days since 1899-12-30, as Excel counts them, of the years 2000 to 2100; a clock in seconds would step by more.
_EXCEL_FIRST, _EXCEL_LAST, _EXCEL_STEP = 36526.0, 73051.0, 5e-5
_DAY = 86400.0
# A clock goes forward at this share of its steps at least, and most steps are about as long as the median.
_FORWARD, _REGULAR = 0.95, 0.8
# Stamps of a clock that are kept rather than read again: 32 MiB.
_KEPT = 1 << 22
# The pieces of a column's values, from the first again with each call.
Reread = Callable[[str], Iterable[FloatArray]]


@dataclass(frozen=True)
class GuessedClock:
    """The column taken for the clock, its times [s], and what is odd about them."""

    column: str
    time: FloatArray
    findings: tuple[Finding, ...]


@dataclass(frozen=True)
class TableClock:
    """The column of a table taken for its clock: how its stamps become seconds, its figures, what is odd about it."""

    column: str
    origin: float
    factor: float
    figures: ClockFigures
    findings: tuple[Finding, ...]

    def times(self, stamps: Iterable[FloatArray]) -> Iterator[FloatArray]:
        """The stamps' pieces as times [s] that strictly increase; the last rows of a piece come with the next one."""
        return self.cleaned(ClockCleaner(), stamps)

    def cleaned(self, clean: ClockCleaner, stamps: Iterable[FloatArray]) -> Iterator[FloatArray]:
        """The same through a given cleaner, which then says what was dropped."""
        for piece in stamps:
            yield clean.times((piece - self.origin) * self.factor, piece)
        yield clean.times(np.empty(0), np.empty(0), final=True)


def is_clock_name(name: str) -> bool:
    """True for a column that is called as clocks are."""
    return _NAMES.match(name) is not None


def guess_clock(source: Source) -> GuessedClock | None:
    """The clock of a table that is in memory; None where no column looks like one."""
    figures: dict[str, ColumnFigures] = {}
    for name, column in source.columns.items():
        figures[name] = ColumnFigures()
        figures[name].add(column.values, in_table=True)
    found = find_clock(source, figures, lambda name: [source.columns[name].values])
    if found is None:
        return None
    times = np.concatenate(list(found.times([source.columns[found.column].values])))
    return GuessedClock(found.column, times, found.findings)


def find_clock(source: Source, figures: Mapping[str, ColumnFigures], reread: Reread) -> TableClock | None:
    """A table's clock by the name of a column, else by its steps; None where no column looks like one.

    `source` may be without its rows: `figures` are those of its columns, and `reread` gives their values.
    """
    tables = [column for column in source.columns.values() if column.time is None and column.values.ndim == 1]
    # A counter may bear such a name beside the real clock: it comes last.
    named = sorted((c for c in tables if _NAMES.match(c.name)), key=lambda c: figures[c.name].by_one)
    for column in dict.fromkeys(column.name for column in (*named, *tables)):
        known = figures[column]
        if known.steps < 3 or known.forward < _FORWARD * known.steps:
            continue
        stamps = _stamps(column, known.present, reread)
        step = _usual_step(stamps())
        if step is not None:
            return _described(source.columns[column], source.first_row, step, stamps)
    return None


def _stamps(column: str, count: int, reread: Reread) -> Callable[[], Iterable[FloatArray]]:
    """A column's pieces: few are kept, many are read again each time."""
    if count > _KEPT:
        return lambda: reread(column)
    kept = [piece.copy() for piece in reread(column)]  # a piece of many columns is not kept for the sake of one
    return lambda: kept


def _usual_step(stamps: Iterable[FloatArray]) -> float | None:
    """The median step between stamps, where a clock may have such steps."""
    steps, last = Distribution(), np.empty(0)
    for piece in stamps:
        known = np.concatenate((last, piece[np.isfinite(piece)]))
        steps.add(np.diff(known))
        last = known[-1:]
    median = steps.median
    regular = median > 0.0 and steps.share(0.5 * median, 1.5 * median) >= _REGULAR
    return median if regular else None


def _described(column: Column, first_row: int, step: float, stamps: Callable[[], Iterable[FloatArray]]) -> TableClock:
    known = find_unit(column.unit) if column.unit else None
    evidence: Literal["header", "epoch", "excel", "steps"]
    start = _start(stamps())
    epoch = unit_since_1970(start)
    wrong: tuple[Finding, ...] = ()
    stated = known is not None and known.si == "s"
    if known is not None and stated and contradicted_by_epoch(start, known.factor):
        stated = False
        readings = both_readings(start, known.factor, str(column.unit), epoch)
        wrong = (Finding(HeaderUnitImplausible(readings), column.name),)
    if stated:
        unit, evidence = str(column.unit), "header"
    elif epoch:
        unit, evidence = epoch, "epoch"
    elif _EXCEL_FIRST < start < _EXCEL_LAST and step < _EXCEL_STEP:
        unit, evidence = "days", "excel"
    else:
        unit, evidence = next(name for most, name in _UNITS if step < most), "steps"
    factor = _DAY if unit == "days" else found.factor if (found := find_unit(unit)) else 1.0
    # An epoch is taken off before scaling, so that no digit is lost.
    origin = start if epoch or unit == "days" else 0.0
    assumed = Finding(AssumedClock(unit, evidence, start, step), column.name, "note")
    clock = TableClock(column.name, origin, factor, ClockFigures(), (assumed, *wrong))
    return _checked(clock, first_row, stamps)


def _start(stamps: Iterable[FloatArray]) -> float:
    """The first stamp that is not wild; the first of an epoch where one that is of none stands before it."""
    known = next(found for piece in stamps if len(found := piece[np.isfinite(piece)]))
    rows = count_leading_strays(known, np.inf)
    if not rows and not unit_since_1970(known[0]):
        rows = next((i for i, stamp in enumerate(known[: EDGE_ROWS + 1]) if unit_since_1970(stamp)), 0)
    return float(known[rows])


def _checked(clock: TableClock, first_row: int, stamps: Callable[[], Iterable[FloatArray]]) -> TableClock:
    """The clock with its figures and all that is odd about it."""
    clean = ClockCleaner()
    for times in clock.cleaned(clean, stamps()):
        clock.figures.add(times, len(times))
    gaps = gaps_in(clock.times(stamps()), clock.figures.steps.median, clock.column)
    return replace(clock, findings=(*clock.findings, *clean.findings(first_row), *gaps))
