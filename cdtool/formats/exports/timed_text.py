"""Text logs whose head states the clock of each channel, as LabVIEW and TwinCAT Scope write them.

A channel has a sample in each row in which its clock has a time. Rows may end before their last cell, and cells may be
blank: a channel has no sample there.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
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
from cdtool.formats.csv.cells import SEPARATORS, kind, number
from cdtool.formats.csv.rows import RowReader
from cdtool.formats.csv.text import Text
from cdtool.formats.csv_dialect.dialect import Dialect
from cdtool.formats.csv_dialect.head_words import column_kinds
from cdtool.formats.csv_dialect.marks import Marks, SampleCell
from cdtool.formats.large_integers import rounded_integers, rounding_finding
from cdtool.formats.source import Source

# No recording has more columns; each row may be completed with as many empty cells.
_MOST_COLUMNS = 1 << 14
# A clock's step may differ from the stated period by this share of it.
_SAME_PERIOD = 0.01


@dataclass(frozen=True)
class ClockGroup:
    """Columns that share a clock. `columns`: their names, with the number of the column in the table.

    `times` returns the times [s] of all rows from the cells (n,) of the column `clock`, or without one from the numbers
    of the rows; NaN is no time. `ticks`: these cells are integers with more digits than float64 can represent,
    negative without one. `sparse`: a row without any value of the group is no sample. `held`: a row that repeats
    the one before is no sample either. `period` [s] is the period that the head states (0: none).
    """

    columns: Mapping[str, int]
    clock: int | None
    times: Callable[[npt.NDArray[Any]], FloatArray]
    ticks: bool = False
    sparse: bool = False
    held: bool = False
    period: float = 0.0

    def samples(
        self, cells: Mapping[int, npt.NDArray[Any]], rows: int, findings: list[Finding]
    ) -> dict[str, tuple[FloatArray, FloatArray]]:
        """Return times and values of the columns of which there are `cells`; the findings on them are added."""
        values = {key: cells[column] for key, column in self.columns.items() if column in cells}
        with np.errstate(over="ignore", invalid="ignore"):  # of damaged stamps, which are then no times
            time = self.times(np.arange(rows) if self.clock is None else cells[self.clock])
        timed = np.isfinite(time)
        untimed = {key: int(np.count_nonzero(np.isfinite(column[~timed]))) for key, column in values.items()}
        findings += [Finding("values_without_time", key, {"count": count}) for key, count in untimed.items() if count]
        if self.sparse and values:
            timed &= np.logical_or.reduce([np.isfinite(column) for column in values.values()])
        time, values = time[timed], {key: column[timed] for key, column in values.items()}
        if self.held and values:
            new = np.full(len(time), False)
            for column in (time, *values.values()):
                new[1:] |= (column[1:] != column[:-1]) & ~(np.isnan(column[1:]) & np.isnan(column[:-1]))
            new[:1] = True
            if not new.all():
                count = int(np.count_nonzero(~new))
                findings.append(Finding("repeated_rows", next(iter(values)), {"count": count}))
            time, values = time[new], {key: column[new] for key, column in values.items()}
        step = float(np.median(np.diff(time))) if len(time) > 1 else 0.0
        if values and self.period and step and abs(step / self.period - 1.0) > _SAME_PERIOD:
            fact = {"stated": self.period, "step": step}
            findings.append(Finding("stated_period_differs", next(iter(values)), fact))
        for key, column in values.items():
            findings += rounding_finding(key, rounded_integers(column))
        return {key: (time, column) for key, column in values.items()}


@dataclass(frozen=True)
class Segment:
    """Rows below a head: their dialect, the channels by clock, and how many rows the head states (0: none)."""

    dialect: Dialect
    groups: tuple[ClockGroup, ...]
    stated: int = 0

    def read(
        self, keys: Collection[str], survey: bool, findings: list[Finding]
    ) -> tuple[dict[str, tuple[FloatArray, FloatArray]], set[str]]:
        """Return times and values of the channels `keys`, and which of these are left out; findings are added.

        Raises RecordingError if a line cannot be read, the words are those of a clock, or, without `survey`, those of a
        channel.
        """
        dialect = self.dialect
        asked = [replace(each, columns={k: at for k, at in each.columns.items() if k in keys}) for each in self.groups]
        groups = [group for group in asked if group.columns]
        columns = {key: at for group in groups for key, at in group.columns.items()}
        worded = {
            at: not_numeric(key, dialect.words[at].line, dialect.words[at].text)
            for key, at in columns.items()
            if survey and at in dialect.words
        }
        clocks = {group.clock for group in groups if group.clock is not None and not group.ticks}
        numeric = sorted({*columns.values()} - worded.keys() | clocks)
        ticks = sorted({group.clock for group in groups if group.clock is not None and group.ticks})
        reader = RowReader(dialect, RequestedColumns(numeric, left_out=worded, whole=ticks), survey)
        blocks = [*reader.pieces()]
        findings += reader.findings
        read, lost = reader.values.numeric, {*numeric} - {*reader.values.numeric} | worded.keys()
        for column in sorted(lost & clocks):
            raise RecordingError(str(reader.values.left_out[column]), "it is the clock of a channel")
        cells: dict[int, npt.NDArray[Any]] = {
            **{column: np.concatenate([rows.numbers[column] for rows in blocks]) for column in read},
            **{column: np.concatenate([rows.whole[column] for rows in blocks]) for column in ticks},
        }
        count = reader.lines.rows
        samples = {key: both for group in groups for key, both in group.samples(cells, count, findings).items()}
        if count < self.stated:
            cut = {"line": dialect.first_line, "stated": self.stated, "rows": count}
            findings.append(Finding("segment_cut_off", "", cut))
        return samples, {key for key, at in columns.items() if at in lost}


@dataclass(frozen=True)
class TimedText:
    """A log: its segments, the units of its channels, its start since 1970 [s], and what its heads show."""

    segments: tuple[Segment, ...]
    units: Mapping[str, str | None]
    origin: float
    details: Mapping[str, str]
    findings: tuple[Finding, ...]

    def source(self, path: Path, name: str, wanted: ChannelMap | None) -> Source:
        """Return the channels that `wanted` names, or all, as read by the format `name`; raises RecordingError."""
        keys = requested_keys(wanted, tuple(self.units))
        findings, left_out = [*self.findings], set[str]()
        parts: dict[str, list[tuple[FloatArray, FloatArray]]] = {}
        for each in self.segments:
            samples, words = each.read(keys, wanted is None, findings)
            left_out |= words
            for key, both in samples.items():
                parts.setdefault(key, []).append(both)
        columns: dict[str, Column] = {}
        clocks: dict[tuple[int, ...], FloatArray] = {}
        for key in (key for key in self.units if key in parts and key not in left_out):
            times = [time for time, _ in parts[key]]
            clock = clocks.setdefault(tuple(map(id, times)), np.concatenate(times))
            columns[key] = Column(key, np.concatenate([values for _, values in parts[key]]), clock, self.units[key])
        if not columns:
            raise RecordingError("no channel has numbers", "see cdtool info")
        unique = tuple(dict.fromkeys(findings))
        return Source(path, name, columns, self.origin, unique, self.details, tuple(self.units))


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


def number_in_head(cell: str) -> float | None:
    """Return a number of the head, whose decimal mark may not be that of the rows; None for any other cell."""
    value = number(cell, "," if "," in cell else ".") if cell else None
    return value if value is not None and np.isfinite(value) else None


def details_of(text: Text, separator: str, decimal: str) -> dict[str, str]:
    """Return the marks and the encoding of a log as texts to be displayed."""
    return {
        "separator": SEPARATORS.get(separator, repr(separator)),
        "decimal mark": "comma" if decimal == "," else "point",
        "encoding": text.encoding,
    }
