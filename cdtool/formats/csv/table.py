"""Read the columns of a text table as float64 (time stamps as seconds), with findings on losses and skipped lines.

A table is read at once, or block by block if it need not fit into memory.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Collection, Generator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from cdtool.channels import ChannelMap
from cdtool.columns import Categories, Piece
from cdtool.errors import RecordingError
from cdtool.findings import Finding
from cdtool.formats.column_names import column_key
from cdtool.formats.csv.cells import kind, split_line
from cdtool.formats.csv.dialect import Dialect
from cdtool.formats.csv.irregular_lines import IrregularLines, not_numeric
from cdtool.formats.csv.number_clock import DAY_S, exact_differences, since_1970, two_readings
from cdtool.formats.csv.row_arrays import Rows
from cdtool.formats.csv.rows import RowReader
from cdtool.formats.csv.several_clocks import Clocks, clock_findings
from cdtool.formats.csv.stamps import MISSING_STAMP, NS, Integers, Layout, seconds_since, unwrap
from cdtool.large_integers import rounded_integers, rounding_finding
from cdtool.recording import FloatArray

RECENT = 20
# A total is of so many rows, and as exact as the written numbers are.
_FEWEST_SUMMED, _SAME_SUM = 3, 1e-6
_SHAPE = re.compile(r"[+-]?(?P<whole>[0-9]*)(?:[.,](?P<decimals>[0-9]*))?(?:[eE][+-]?(?P<power>[0-9]*))?")


class StampColumns:
    """Dates and times of day as seconds since the first stamp with a date (`origin` [ns]), midnight or the full hour.

    Rows may be passed piece by piece, in the file's order.
    """

    def __init__(self, dialect: Dialect, read: Sequence[int], dates: Mapping[int, int]) -> None:
        self._dialect, self._read, self._dates = dialect, read, dates
        self._columns = [column for column in read if column not in dates.values()]
        self.origin: int | None = None
        self._passed = dict.fromkeys(self._columns, 0)  # midnights, or full hours
        self._last: dict[int, Integers] = {}

    @property
    def names(self) -> list[str]:
        """Return the names of the resulting columns."""
        return [self._dialect.names[column] for column in self._columns]

    def seconds(self, rows: Rows) -> dict[str, FloatArray]:
        """Return the columns of the next rows."""
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
            # Preceded by the last stamp of the piece before, because midnight may be between two pieces.
            times = np.concatenate((self._last.get(column, stamps[known][:1]), stamps[known]))
            self._last[column] = times[-1:].copy()
            period, _ = self._layout(column).wraps
            passed = unwrap(times, period)
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
        """Return a note on each column: its layout, and the origin of its seconds."""
        findings = []
        for column in self._columns:
            layout = self._layout(column)
            wraps = layout.wraps[1]
            fact = {
                "pattern": layout.pattern,
                "since": f"{np.datetime64(self._start(column), 'ns')}" if self._dated(column) else wraps,
                "days_column": self._dialect.names[self._dates[column]] if column in self._dates else "",
                "wraps": wraps,
                "wrapped": self._passed[column],
            }
            findings.append(Finding("written_times", self._dialect.names[column], fact))
        return findings


@dataclass
class TextTable:
    """The columns of a text table with findings.

    `stamped` are the columns of dates or times of day; `origin` [s] was subtracted from the columns with a date.
    `unbroken`: every line after the first row is a row. `words` are the texts of columns of categories.
    """

    values: dict[str, FloatArray]
    findings: list[Finding]
    origin: float = 0.0
    stamped: set[str] = field(default_factory=set)
    unbroken: bool = True
    words: dict[str, dict[float, str]] = field(default_factory=dict)


@dataclass(frozen=True)
class RequestedColumns:
    """The columns of a table that are read, by number: `numeric`, `stamps`, and the columns of days of some stamps.

    `left_out` are the columns that a survey leaves out, with the finding.
    """

    numeric: tuple[int, ...]
    stamps: tuple[int, ...]
    dates: Mapping[int, int]
    left_out: dict[int, Finding]

    @classmethod
    def of(
        cls, path: Path, dialect: Dialect, keys: Collection[str], clock: str | None, survey: bool
    ) -> RequestedColumns:
        """Return the columns with these names; raises RecordingError if their stamps can be read in two ways."""
        columns = [i for i, name in enumerate(dialect.names) if name in keys]
        numeric, stamps, left_out = _sort_columns(path, dialect, columns, clock, survey)
        dates = {column: date for column in stamps if (date := _date_beside(path, dialect, column)) is not None}
        return cls(tuple(numeric), tuple(sorted({*stamps, *dates.values()})), dates, left_out)


class _TableReader:
    """Reader of one table: the requested columns, their readers, and the irregular lines so far."""

    def __init__(
        self,
        path: Path,
        dialect: Dialect,
        keys: Collection[str],
        clock: str | None = None,
        survey: bool = True,
        worded: Collection[str] = (),
    ) -> None:
        self.path, self.dialect, self.survey = path, dialect, survey
        self.requested = RequestedColumns.of(path, dialect, keys, clock, survey)
        self.reader = RowReader(path, dialect, self.requested.numeric, self.requested.stamps)
        self.irregular = IrregularLines(path, dialect, survey, self.reader.targets, left_out=self.requested.left_out)
        self.irregular.categories = {dialect.names.index(key): Categories() for key in worded}
        self.stamped = StampColumns(dialect, self.requested.stamps, self.requested.dates)

    def columns(self, rows: Rows) -> dict[str, FloatArray]:
        """Return the columns of the next rows by name, including columns that are left out later."""
        numbers = {self.dialect.names[column]: rows.numbers[k] for k, column in enumerate(self.requested.numeric)}
        return numbers | self.stamped.seconds(rows)

    def end(self, rows: Rows, before: int = 0) -> list[Finding]:
        """Return the findings on skipped lines and on the end of the file.

        `rows` are the last rows, after `before` other rows; the last one may be removed from them.
        """
        findings = end_of_rows(self.reader, self.irregular, rows, self.requested, before)
        clock = len(self.requested.numeric) > 0 and self.requested.numeric[0] == 0
        if self.survey and not before and is_total(rows.numbers[int(clock) :]):
            findings.append(Finding("total_row", "", {"line": rows.line(rows.count - 1)}))
        return findings

    def table(self, columns: Mapping[str, FloatArray], findings: list[Finding], unbroken: bool) -> TextTable:
        """Return the table without the columns that are left out; raises RecordingError if no column remains."""
        left_out = {self.dialect.names[column] for column in self.irregular.left_out} - set(self.stamped.names)
        remaining = {key: columns[key] for key in self.dialect.names if key in columns and key not in left_out}
        findings += self.stamped.findings()
        if self.survey and not remaining:
            raise RecordingError(f"{self.path}: no column has only numbers", str(findings[0]) if findings else "")
        words = {self.dialect.names[column]: each.words for column, each in self.irregular.categories.items()}
        return TextTable(remaining, findings, (self.stamped.origin or 0) / NS, set(self.stamped.names), unbroken, words)


def read_table(
    path: Path, dialect: Dialect, keys: Collection[str], clock: str | None = None, wanted: ChannelMap | None = None
) -> TextTable:
    """Return the columns `keys`; `clock` is the machine file's time column. Raises RecordingError."""
    named = wanted.worded if wanted is not None else ()
    worded = {key for name in named if (key := column_key(name, dialect.names))}
    reading = _TableReader(path, dialect, keys, clock, survey=wanted is None, worded=worded)
    rows = reading.reader.read(reading.irregular)
    findings = reading.end(rows)
    table = reading.table(reading.columns(rows), findings, not len(rows.not_rows))
    if clock is not None and wanted is not None:
        _set_clock(path, table, clock, wanted)
        _set_exact(dialect, table, clock, wanted.time.factor)
    for key, column in table.values.items():
        table.findings += rounding_finding(key, rounded_integers(column))
    return table


def table_pieces(
    path: Path, dialect: Dialect, clocks: Clocks, keys: Collection[str]
) -> Generator[Piece, None, TextTable]:
    """Yield those of the columns `keys` that have numbers; return the table, with its `clocks`, without its rows.

    The last row is removed from the last block if the file's end is incomplete. Raises RecordingError.
    """
    reading = _TableReader(path, dialect, keys)
    last, before, unbroken = reading.reader.allocate(0), 0, True
    first: dict[str, FloatArray] = {}
    rounded: Counter[str] = Counter()

    def piece(rows: Rows) -> Piece:
        columns = reading.columns(rows)
        numbers = columns.keys() - set(reading.stamped.names)
        rounded.update({key: rounded_integers(columns[key]) for key in numbers})
        if not first:  # the first block is sufficient to compare the clocks
            first.update({key: columns[key] for i in clocks.columns if (key := dialect.names[i]) in numbers})
        return Piece("", None, columns, rows.count)

    for rows in reading.reader.pieces(reading.irregular):
        unbroken = unbroken and not len(rows.not_rows)
        if rows.count:
            before += last.count
            if last.count:
                yield piece(last)
            last = rows
    findings = reading.end(last, before)
    end = piece(last)
    yield end
    table = reading.table({key: np.empty(0) for key in end.values}, findings, unbroken and not len(last.not_rows))
    table.findings += clock_findings(dialect, clocks, first)
    for key in table.values:
        table.findings += rounding_finding(key, rounded[key])
    return table


def _sort_columns(
    path: Path, dialect: Dialect, columns: Sequence[int], clock: str | None, survey: bool
) -> tuple[list[int], list[int], dict[int, Finding]]:
    """Return columns of numbers, columns of stamps, and columns that a survey leaves out, with the finding."""
    numeric, stamps, left_out = [], [], {}
    for column in columns:
        name, stamped = dialect.names[column], dialect.stamped.get(column)
        if stamped is None or not (survey or name == clock):
            if survey and column in dialect.words:
                words = dialect.words[column]
                left_out[column] = not_numeric(name, words.line, words.text)
            else:
                numeric.append(column)
        elif stamped.layout is None:
            timed = stamped.layouts[0].timed or _clock_beside(dialect, column) is not None
            if not survey or timed:
                raise RecordingError(
                    f"{path}: column '{name}': {stamped.readings}", "pin time_format in [csv] of the machine file"
                )
            left_out[column] = Finding("ambiguous_times", "", {"column": name, "readings": stamped.readings})
        else:
            stamps.append(column)
    return numeric, stamps, left_out


def _clock_beside(dialect: Dialect, column: int) -> int | None:
    """Return the column of times of day next to a column of days; None if there is no such column."""
    for other in (column + 1, column - 1):
        stamped = dialect.stamped.get(other)
        if stamped is not None and stamped.layouts[0].timed and not stamped.layouts[0].dated:
            return other
    return None


def _date_beside(path: Path, dialect: Dialect, column: int) -> int | None:
    """Return the column of days next to a column of times of day; None if there is no such column.

    Raises RecordingError if the days can be read in two ways.
    """
    layout = dialect.stamped[column].layouts[0]
    if layout.dated or not layout.timed:
        return None
    for other in (column - 1, column + 1):
        stamped = dialect.stamped.get(other)
        if stamped is None or not stamped.layouts[0].dated or stamped.layouts[0].timed:
            continue
        if stamped.layout is None:
            raise RecordingError(
                f"{path}: column '{dialect.names[other]}': {stamped.readings}",
                "pin time_format in [csv] of the machine file",
            )
        return other
    return None


def _set_clock(path: Path, table: TextTable, clock: str, wanted: ChannelMap) -> None:
    """Check the machine file's unit against the clock's column, and convert days of Excel to seconds."""
    if clock in table.stamped:
        if wanted.time.factor != 1.0:
            raise RecordingError(
                f"{path}: column '{clock}' has dates or times of day, which are read in s",
                'write unit = "s" in [channels] time',
            )
        return
    values = table.values[clock]
    finite = values[np.isfinite(values)]
    if not len(finite):
        return
    if wanted.pins.time_format == "excel":
        table.origin = since_1970(float(finite[0]))
        table.values[clock] = (values - finite[0]) * DAY_S
        return
    readings = "" if wanted.pins.time_format else two_readings(values, wanted.time.factor)
    if readings:
        raise RecordingError(
            f"{path}: column '{clock}' {readings}",
            'pin time_format = "excel" or "number" in [csv] of the machine file',
        )


def _set_exact(dialect: Dialect, table: TextTable, clock: str, factor: float) -> None:
    """Read the clock again if its stamps have more digits than float64 can represent."""
    if clock in table.stamped or table.origin:
        return
    exact = exact_differences(dialect, dialect.names.index(clock), table.values[clock], factor)
    if exact is not None:
        table.values[clock], table.origin = exact


def end_of_rows(
    reader: RowReader, irregular: IrregularLines, rows: Rows, requested: RequestedColumns, before: int
) -> list[Finding]:
    """Return the findings on skipped lines and on the end of the file, whose last row may be removed from `rows`."""
    text = reader.dialect.text
    findings = irregular.findings(rows.line(rows.count - 1))
    if not reader.ended and not irregular.cut_line and not irregular.ends_skipped:
        findings += _check_last_line(reader.dialect, rows, requested, before)
    if irregular.cut_line or text.padding:
        line = irregular.cut_line or rows.line(rows.count)
        findings.insert(0, Finding("last_line_cut", "", {"line": line}))
    if text.padding:
        findings.append(Finding("nul_bytes_at_end", "", {"count": text.padding}))
    return findings


def _check_last_line(dialect: Dialect, rows: Rows, requested: RequestedColumns, before: int) -> list[Finding]:
    """Check a regular last line without line end: keep the row, keep it with a warning, or remove it with a loss."""
    last = dialect.width - 1
    if rows.count < 1 or dialect.trailing or last not in (*requested.numeric, *requested.stamps):
        return []
    *others, unfinished = dialect.text.tail()
    if not unfinished.strip():
        return []
    above = []
    for raw in reversed(others[1:] if len(others) > 1 else others):
        cells = split_line(dialect.text.decode(raw), dialect.separator)
        if len(cells) == dialect.width and kind(cells[-1]) != "X":
            above.append(cells[-1])
        if len(above) == RECENT:
            break
    text = dialect.text.decode(unfinished).rstrip()
    cell = '"' if text.endswith('"') else split_line(text, dialect.separator)[-1]
    complete, certain = is_complete(cell, above[: before + rows.count - 1])
    line = rows.line(rows.count - 1)
    if complete and (certain or not dialect.text.padding):
        if certain:
            return []
        return [Finding("last_line_kept", "", {"line": line, "cell": cell})]
    rows.count -= 1
    rows.numbers, rows.stamps = rows.numbers[:, :-1], rows.stamps[:, :-1]
    rows.not_rows = np.append(rows.not_rows, line)
    if dialect.text.padding:
        return []
    return [Finding("last_line_dropped", "", {"line": line, "cell": cell})]


def is_total(columns: FloatArray) -> bool:
    """Return whether the last numbers of columns (k, n) are the sums of those above, more than each of them."""
    found = False
    for column in columns:
        above, last = column[:-1], float(column[-1]) if column.size > _FEWEST_SUMMED else np.nan
        if not np.isfinite(last):
            continue
        largest = max(np.fmax.reduce(above), -np.fmin.reduce(above))
        if not largest < abs(last) or not math.isclose(np.nansum(above), last, rel_tol=_SAME_SUM):
            return False
        found = True
    return found


@dataclass(frozen=True)
class _Shape:
    """The numbers of digits before the decimal mark, after it (-1: no mark) and in the exponent (-1: no exponent)."""

    whole: int
    decimals: int
    power: int

    @classmethod
    def of(cls, cell: str) -> _Shape | None:
        match = _SHAPE.fullmatch(cell)
        if match is None:
            return None
        decimals, power = match["decimals"], match["power"]
        return cls(len(match["whole"]), -1 if decimals is None else len(decimals), -1 if power is None else len(power))


def is_complete(cell: str, above: Sequence[str]) -> tuple[bool, bool]:
    """Return whether the last cell of an unfinished line is complete, and whether that is certain.

    `above` are the cells above it in the same column. A number that is cut off has fewer digits. It is therefore
    certainly complete if it has as many decimals as all cells above. If the number of decimals varies, it is assumed to
    be complete if it has at least as many as the shortest cell above; otherwise it is incomplete.
    """
    if not above:
        return True, False
    if cell == '"':  # the closing quote is not cut off
        return True, True
    last, shapes = _Shape.of(cell), [_Shape.of(other) for other in above]
    known = [shape for shape in shapes if shape is not None]
    if last is None:  # words, a stamp, or empty: compared by length
        lengths = {len(other) for other in above}
        return bool(lengths) and len(cell) >= min(lengths), len(lengths) == 1 and len(cell) in lengths
    if not known:
        return False, False
    powers = {shape.power for shape in known}
    if len(powers) == 1 and last.power not in powers:
        return False, False
    if last.power >= 0:
        fewest = min((shape.power for shape in known if shape.power >= 0), default=2)
        return last.power >= fewest, powers == {last.power}
    decimals = {shape.decimals for shape in known if shape.power < 0}
    if decimals == {-1} or not decimals:
        digits = {shape.whole for shape in known}
        return last.whole >= min(digits), digits == {last.whole}
    certain = len(decimals) == 1 and last.decimals in decimals and last.decimals > 0
    return certain or last.decimals >= max(1, min(decimals)), certain
