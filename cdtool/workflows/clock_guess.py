"""Which column of a table is its clock, and in which unit? A guess, for a first look without a machine file."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from cdtool.clock import clean_time, gap_findings
from cdtool.formats.source import Column, Source
from cdtool.recording import Finding, FloatArray, Series
from cdtool.units import find_unit

_NAMES = re.compile(r"^(t|ts|time|timestamp|zeit|clock|tempo|temps)([^a-z]|$)", re.IGNORECASE)
# Median step -> unit: log rates of 2 Hz to 2 MHz in each of them.
_UNITS = ((0.5, "s"), (500.0, "ms"), (5e5, "us"), (np.inf, "ns"))
# A clock that counts from 1970 in one of these stands there between the years 2001 and 2100.
_EPOCHS = ((1e9, 4.1e9, "s"), (1e12, 4.1e12, "ms"), (1e15, 4.1e15, "us"), (1e18, 4.1e18, "ns"))
# Days since 1899-12-30, as Excel counts them, of the years 2000 to 2100; a clock in seconds would step by more.
_EXCEL_FIRST, _EXCEL_LAST, _EXCEL_STEP = 36526.0, 73051.0, 2e-6
_DAY = 86400.0
# A clock goes forward at this share of its steps at least, and most steps are about as long as the median.
_FORWARD, _REGULAR = 0.95, 0.8


@dataclass(frozen=True)
class GuessedClock:
    """The column taken for the clock, its times [s], and what is odd about them."""

    column: str
    time: FloatArray
    findings: tuple[Finding, ...]


def guess_clock(source: Source) -> GuessedClock | None:
    """A table's clock by the name of a column, else by its steps; None where no column looks like one."""
    tables = [column for column in source.columns.values() if column.time is None and column.values.ndim == 1]
    # A counter may bear such a name beside the real clock: it comes last.
    named = sorted((c for c in tables if _NAMES.match(c.name)), key=lambda c: bool(np.all(np.diff(c.values) == 1.0)))
    for column in [*named, *tables]:
        if _looks_like_a_clock(column.values):
            return _described(column, source.first_row)
    return None


def _looks_like_a_clock(values: FloatArray) -> bool:
    steps = np.diff(values[np.isfinite(values)])
    if len(steps) < 3:
        return False
    median = float(np.median(steps))
    near = np.abs(steps - median) <= 0.5 * median
    return median > 0.0 and float(np.mean(steps >= 0.0)) >= _FORWARD and float(np.mean(near)) >= _REGULAR


def _described(column: Column, first_row: int) -> GuessedClock:
    finite = column.values[np.isfinite(column.values)]
    step, start = float(np.median(np.diff(finite))), float(finite[0])
    known = find_unit(column.unit) if column.unit else None
    epoch = next((name for low, high, name in _EPOCHS if low <= start < high), "")
    if known is not None and known.si == "s":
        unit, why = str(column.unit), "its header says so"
    elif epoch:
        unit, why = epoch, f"from its start, {start:.0f} after 1970"
    elif _EXCEL_FIRST < start < _EXCEL_LAST and step < _EXCEL_STEP:
        unit, why = "days", f"as Excel counts them, from its start {start:.9g} and its steps of {step:.3g}"
    else:
        unit, why = next(name for most, name in _UNITS if step < most), f"from its steps of {step:.4g}"
    factor = _DAY if unit == "days" else found.factor if (found := find_unit(unit)) else 1.0
    # An epoch is taken off before scaling, so that no digit is lost.
    stamps = column.values - start if epoch or unit == "days" else column.values
    clean = clean_time(stamps * factor, first_row, "line" if first_row else "sample")
    text = f"taken to be the clock, in {unit} ({why}); a machine file says it for sure"
    series = Series(clean.time, np.zeros(len(clean.time)), "s")
    findings = (Finding(text, column.name, "note"), *clean.findings, *gap_findings(series, column.name))
    return GuessedClock(column.name, clean.time, findings)
