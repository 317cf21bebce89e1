"""Columns of dates and times of day as seconds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from cdtool.findings import Finding
from cdtool.findings.clocks import WrittenTimes
from cdtool.formats.csv.dialect import Dialect
from cdtool.formats.csv.row_arrays import Rows
from cdtool.formats.csv.row_kernel import MISSING_STAMP, Integers
from cdtool.formats.csv.stamps import Layout, seconds_since, unwrapped
from cdtool.recording import FloatArray


class StampColumns:
    """Stamps -> seconds since the first of them that has a date (`origin` [ns]), or since midnight or the full hour.

    Rows may come piece by piece, in the file's order.
    """

    def __init__(self, dialect: Dialect, read: Sequence[int], dates: Mapping[int, int]) -> None:
        self._dialect, self._read, self._dates = dialect, read, dates
        self._columns = [column for column in read if column not in dates.values()]
        self.origin: int | None = None
        self._passed = dict.fromkeys(self._columns, 0)  # midnights, or full hours
        self._last: dict[int, Integers] = {}

    @property
    def names(self) -> list[str]:
        """The columns that it makes."""
        return [self._dialect.names[column] for column in self._columns]

    def seconds(self, rows: Rows) -> dict[str, FloatArray]:
        """The next rows."""
        return {self._dialect.names[column]: self._of(column, rows) for column in self._columns}

    def _of(self, column: int, rows: Rows) -> FloatArray:
        stamps = rows.stamps[self._read.index(column)].copy()
        known = stamps != MISSING_STAMP
        dated = self._dated(column)
        if column in self._dates:
            days = rows.stamps[self._read.index(self._dates[column])]
            known &= days != MISSING_STAMP
            stamps[known] += days[known]
        elif not dated and known.any():
            # Before them the last stamp so far: midnight may lie between two pieces.
            times = np.concatenate((self._last.get(column, stamps[known][:1]), stamps[known]))
            self._last[column] = times[-1:].copy()
            period, _ = self._layout(column).wraps
            passed = unwrapped(times, np.ones(len(times), dtype=bool), period)
            stamps[known] = times[1:] + self._passed[column] * period
            self._passed[column] += passed
        if dated and self.origin is None and known.any():
            self.origin = int(stamps[known][0])
        return seconds_since(stamps, known, self._start(column))

    def _dated(self, column: int) -> bool:
        return self._layout(column).dated or column in self._dates

    def _layout(self, column: int) -> Layout:
        return self._dialect.stamped[column].layouts[0]

    def _start(self, column: int) -> int:
        return self.origin if self._dated(column) and self.origin is not None else 0

    def findings(self) -> list[Finding]:
        """How each is written, and what its seconds count from."""
        found = []
        for column in self._columns:
            layout = self._layout(column)
            wraps = layout.wraps[1]
            fact = WrittenTimes(
                layout.pattern,
                f"{np.datetime64(self._start(column), 'ns')}" if self._dated(column) else wraps,
                days_column=self._dialect.names[self._dates[column]] if column in self._dates else "",
                wraps=wraps,
                wrapped=self._passed[column],
            )
            found.append(Finding(fact, self._dialect.names[column], "note"))
        return found
