"""The rows of an export of TwinCAT Scope: a channel has a sample in each row in which the clock beside it has a time.

Rows may end before their last cell, and cells may be blank: a channel has no sample there.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import RecordingError
from cdtool.base.findings import Finding
from cdtool.formats.channels.channel_map import ChannelMap, TablePins
from cdtool.formats.column_names import requested_keys
from cdtool.formats.columns import Column
from cdtool.formats.csv.cell_values import RequestedColumns, not_numeric
from cdtool.formats.csv.cells import kind
from cdtool.formats.csv.rows import RowReader
from cdtool.formats.csv.text import Text
from cdtool.formats.csv_dialect.dialect import Dialect
from cdtool.formats.csv_dialect.head_words import column_kinds
from cdtool.formats.csv_dialect.marks import Marks, SampleCell
from cdtool.formats.large_integers import rounded_integers, rounding_finding
from cdtool.formats.source import Source

# No recording has more columns; each row may be completed with as many empty cells.
_MOST_COLUMNS = 1 << 14


@dataclass(frozen=True)
class ClockGroup:
    """Columns that share the clock in column `clock`, by name; `period` [s] is what the head states (0: none)."""

    columns: Mapping[str, int]
    clock: int
    period: float = 0.0

    def samples(
        self, time: FloatArray, cells: Mapping[int, FloatArray], findings: list[Finding]
    ) -> tuple[FloatArray, dict[str, FloatArray]]:
        """Return times and values of the columns of which there are `cells`; the findings on them are added.

        A row without a time is no sample, nor is one that repeats the row before.
        """
        values = {key: cells[column] for key, column in self.columns.items() if column in cells}
        timed = np.isfinite(time)
        untimed = {key: int(np.count_nonzero(np.isfinite(column[~timed]))) for key, column in values.items()}
        findings += [Finding("values_without_time", key, {"count": count}) for key, count in untimed.items() if count]
        time, values = time[timed], {key: column[timed] for key, column in values.items()}
        new = np.full(len(time), False)
        for column in (time, *values.values()):
            new[1:] |= (column[1:] != column[:-1]) & ~(np.isnan(column[1:]) & np.isnan(column[:-1]))
        new[:1] = True
        if values and not new.all():
            count = int(np.count_nonzero(~new))
            findings.append(Finding("repeated_rows", next(iter(values)), {"count": count}))
        time, values = time[new], {key: column[new] for key, column in values.items()}
        step = float(np.median(np.diff(time))) if len(time) > 1 else 0.0
        # A clock's step may differ from the stated period by 1 %.
        if values and self.period and step and abs(step / self.period - 1.0) > 0.01:
            fact = {"stated": self.period, "step": step}
            findings.append(Finding("stated_period_differs", next(iter(values)), fact))
        for key, column in values.items():
            findings += rounding_finding(key, rounded_integers(column))
        return time, values


@dataclass(frozen=True)
class ScopeRows:
    """Rows, their channels by clock with units, and the log's start since 1970 [s].

    `times` returns the times [s] of the cells of a clock; NaN is no time. `ticks`: these cells are integers with more
    digits than float64 can represent, negative without one.
    """

    dialect: Dialect
    groups: Sequence[ClockGroup]
    units: Mapping[str, str | None]
    origin: float
    times: Callable[[npt.NDArray[Any]], FloatArray]
    ticks: bool

    def source(self, path: Path, name: str, wanted: ChannelMap | None) -> Source:
        """Return the channels that `wanted` names, or all, as read by the format `name`; raises RecordingError."""
        keys, dialect = requested_keys(wanted, tuple(self.units)), self.dialect
        asked = {key: at for group in self.groups for key, at in group.columns.items() if key in keys}
        groups = [group for group in self.groups if not asked.keys().isdisjoint(group.columns)]
        worded = {
            at: not_numeric(key, dialect.words[at].line, dialect.words[at].text)
            for key, at in asked.items()
            if wanted is None and at in dialect.words
        }
        clocks = {group.clock for group in groups}
        numeric = {*asked.values()} - worded.keys() | (set() if self.ticks else clocks)
        requested = RequestedColumns(sorted(numeric), left_out=worded, whole=sorted(clocks) if self.ticks else ())
        reader = RowReader(dialect, requested, survey=wanted is None)
        blocks = [*reader.pieces()]
        findings = [*reader.findings]
        for column in sorted(clocks & reader.values.left_out.keys()):
            raise RecordingError(str(reader.values.left_out[column]), "it is the clock of a channel")
        cells = {i: np.concatenate([rows.numbers[i] for rows in blocks]) for i in reader.values.numeric}
        columns: dict[str, Column] = {}
        for group in groups:
            stamps = np.concatenate([(rows.whole if self.ticks else rows.numbers)[group.clock] for rows in blocks])
            with np.errstate(over="ignore", invalid="ignore"):  # of damaged stamps, which are then no times
                times = self.times(stamps)
            time, values = group.samples(times, {at: cells[at] for at in asked.values() if at in cells}, findings)
            columns |= {key: Column(key, column, time, self.units[key]) for key, column in values.items()}
        if not columns:
            raise RecordingError("no channel has numbers", "see cdtool info")
        unique = tuple(dict.fromkeys(findings))
        details = {key: dialect.details[key] for key in ("separator", "decimal mark", "encoding")}
        return Source(path, name, columns, self.origin, unique, details, tuple(self.units))


def dialect_of_rows(
    text: Text,
    pins: TablePins,
    marks: tuple[str, str],
    place: tuple[int, int],
    names: Sequence[str],
    rows: list[list[str]],
) -> Dialect:
    """Return the dialect of rows: `marks` are separator and decimal mark, `place` line and byte of the first row.

    `names` are those of the columns, empty for columns of other cells; `rows` are the cells of the first rows.
    """
    separator, decimal = marks
    width = max([len(names), *(len(row) for row in rows if not row[-1])])
    if width > _MOST_COLUMNS:
        raise RecordingError(f"names {width} columns, more than {_MOST_COLUMNS}", "export fewer channels")
    padded = [row + [""] * (width - len(row)) for row in rows if len(row) <= width]
    kinds = column_kinds(padded, width)
    words = {
        i: SampleCell(next(row[i] for row in padded if kind(row[i]) in "XT"), place[0])
        for i, name in enumerate(names)
        if name and kinds[i] in "XT"
    }
    return Dialect(
        text=text,
        pins=pins,
        separator=separator,
        marks=Marks(decimal),
        missing=pins.missing,
        header=tuple(name or str(i) for i, name in enumerate([*names, *[""] * (width - len(names))])),
        first_line=place[0],
        sampled=len(padded),
        offset=place[1],
        width=width,
        kinds=kinds,
        words=words,
        short_rows=range(2, width + 1),
    )
