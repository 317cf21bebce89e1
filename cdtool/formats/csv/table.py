"""Read the columns of a text table as float64 (time stamps as seconds), with findings on losses and skipped lines.

A table is read at once, or block by block if it need not fit into memory.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Collection, Generator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain, islice

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import RecordingError
from cdtool.base.findings import Finding
from cdtool.formats.channels.channel_map import ChannelMap
from cdtool.formats.column_names import column_key
from cdtool.formats.columns import Categories, Piece
from cdtool.formats.csv.cell_values import RequestedColumns, not_numeric
from cdtool.formats.csv.number_clock import DAY_S, exact_differences, since_1970, two_readings
from cdtool.formats.csv.rows import RowReader, Rows, plain_rows
from cdtool.formats.csv.stamps import MISSING_STAMP, NS, Integers, Layout, seconds_since, unwrap
from cdtool.formats.csv.text import BLOCK_BYTES
from cdtool.formats.csv_dialect.dialect import Dialect
from cdtool.formats.large_integers import rounded_integers, rounding_finding
from cdtool.formats.pieces import PieceRun

# A total is of so many rows, and as exact as the written numbers are.
_FEWEST_SUMMED, _SAME_SUM = 3, 1e-6
# The sum of a column, and its largest number.
Sum = tuple[float, float]


class StampColumns:
    """Dates and times of day as seconds since the first stamp with a date (`origin` [ns]), midnight or the full hour.

    Rows may be passed piece by piece, in the file's order.
    """

    def __init__(self, dialect: Dialect, requested: RequestedColumns) -> None:
        self._dialect, self._dates = dialect, requested.dates
        self._columns = [column for column in requested.stamps if column not in requested.dates.values()]
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
        stamps = rows.whole[column].copy()
        known = stamps != MISSING_STAMP
        dated = self._dated(column)
        if column in self._dates:
            days = rows.whole[self._dates[column]]
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


def read_table(
    dialect: Dialect, keys: Collection[str], clock: str | None = None, wanted: ChannelMap | None = None
) -> TextTable:
    """Return the columns `keys`; `clock` is the machine file's time column. Raises RecordingError."""
    table = None if wanted is None or wanted.worded else _plain_table(dialect, keys)
    table = table or _joined_blocks(dialect, keys, clock, wanted)
    if clock is not None and wanted is not None:
        _set_clock(dialect, table, clock, wanted)
    return table


def _plain_table(dialect: Dialect, keys: Collection[str]) -> TextTable | None:
    """Return a small table that has only numbers in plain rows, read at once; None if it may have anything else."""
    text, names = dialect.text, dialect.names
    if dialect.stamped or text.padding or text.content is None or not 0 < len(text.content) <= BLOCK_BYTES:
        return None
    rows, columns = (
        text.content[text.mark + dialect.offset : text.size],
        [i for i, name in enumerate(names) if name in keys],
    )
    plain = plain_rows(dialect, columns, (), rows, ended=True) if rows.endswith(b"\n") and columns else None
    if plain is None:
        return None
    values = {names[column]: plain[1][column] for column in columns}
    return TextTable(values, [note for key in values for note in rounding_finding(key, rounded_integers(values[key]))])


def _joined_blocks(dialect: Dialect, keys: Collection[str], clock: str | None, wanted: ChannelMap | None) -> TextTable:
    """Return the columns of a table that is read block by block."""
    run = PieceRun(table_pieces(dialect, keys, clock, wanted))
    first, *more = islice(pieces := iter(run), 2)
    values, count = first.values, first.rows
    if more:  # in one array per column: half the memory of a list of pieces
        most = dialect.text.count_lines(dialect.offset)
        values, count = {key: np.empty(most) for key in values}, 0
        for piece in chain([first], more, pieces):
            for key, column in piece.values.items():
                values[key][count : count + piece.rows] = column
            count += piece.rows
    table = run.source
    table.values = {key: values[key][:count] for key in table.values}
    return table


def table_pieces(
    dialect: Dialect, keys: Collection[str], clock: str | None = None, wanted: ChannelMap | None = None
) -> Generator[Piece, None, TextTable]:
    """Yield those of the columns `keys` that have numbers, block by block; return the table without its rows.

    `clock` is the time column of the channel map `wanted`; without one the columns are surveyed. The last row is
    removed from the last block if the file's end is incomplete. Raises RecordingError.
    """
    names, worded = dialect.names, () if wanted is None else wanted.worded
    categories = {names.index(key): Categories() for name in worded if (key := column_key(name, names))}
    columns = [i for i, name in enumerate(names) if name in keys]
    requested = _requested(dialect, columns, clock, survey=wanted is None)
    reader = RowReader(dialect, replace(requested, categories=categories), survey=wanted is None)
    stamped = StampColumns(dialect, requested)
    rounded: Counter[str] = Counter()
    above, before = dict[int, Sum](), dict[int, FloatArray]()
    for rows in reader.pieces():
        above |= {i: added(above.get(i), values) for i, values in before.items()}
        before = rows.numbers if wanted is None else {}
        numbers = {names[column]: values for column, values in rows.numbers.items()}
        rounded.update({key: rounded_integers(values) for key, values in numbers.items()})
        yield Piece("", None, numbers | stamped.seconds(rows), rows.count)
    findings = reader.findings
    if wanted is None and is_total(rows, above):
        findings.append(Finding("total_row", "", {"line": rows.last_line}))
    findings += stamped.findings()
    remaining = {*(names[column] for column in reader.values.numeric), *stamped.names}
    if wanted is None and not remaining:
        raise RecordingError("no column has only numbers", str(findings[0]) if findings else "")
    for key in names:
        findings += rounding_finding(key, rounded[key]) if key in remaining else []
    return TextTable(
        {key: np.empty(0) for key in names if key in remaining},
        findings,
        (stamped.origin or 0) / NS,
        {*stamped.names},
        reader.lines.only_rows,
        {names[column]: each.words for column, each in categories.items()},
    )


def _requested(dialect: Dialect, columns: Sequence[int], clock: str | None, survey: bool) -> RequestedColumns:
    """Return these columns by kind, with a finding on those that a survey leaves out.

    Raises RecordingError if their stamps can be read in two ways.
    """
    numeric: list[int] = []
    stamps: list[int] = []
    left_out: dict[int, Finding] = {}
    for column in columns:
        name, stamped = dialect.names[column], dialect.stamped.get(column)
        if stamped is None or not (survey or name == clock):
            if survey and column in dialect.words:
                words = dialect.words[column]
                left_out[column] = not_numeric(name, words.line, words.text)
            else:
                numeric.append(column)
        elif stamped.layout is None:
            timed = stamped.layouts[0].timed or _beside(dialect, column, dated=False) is not None
            if not survey or timed:
                raise _two_readings(dialect, column)
            left_out[column] = Finding("ambiguous_times", "", {"column": name, "readings": stamped.readings})
        else:
            stamps.append(column)
    dates: dict[int, int] = {}
    for column in stamps:
        layout = dialect.stamped[column].layouts[0]
        days = _beside(dialect, column, dated=True) if layout.timed and not layout.dated else None
        if days is not None:
            if dialect.stamped[days].layout is None:
                raise _two_readings(dialect, days)
            dates[column] = days
    return RequestedColumns(numeric, sorted({*stamps, *dates.values()}), dates, left_out)


def _beside(dialect: Dialect, column: int, dated: bool) -> int | None:
    """Return the column of days (`dated`) or of times of day that is next to a column; None for no such column."""
    for other in (column - 1, column + 1):
        stamped = dialect.stamped.get(other)
        if stamped is not None and (stamped.layouts[0].dated, stamped.layouts[0].timed) == (dated, not dated):
            return other
    return None


def _two_readings(dialect: Dialect, column: int) -> RecordingError:
    stamped = dialect.stamped[column]
    return RecordingError(
        f"column '{dialect.names[column]}': {stamped.readings}", "pin time_format in [csv] of the machine file"
    )


def _set_clock(dialect: Dialect, table: TextTable, clock: str, wanted: ChannelMap) -> None:
    """Check the machine file's unit against the clock's column, and convert days of Excel to seconds.

    It is read again if its stamps have more digits than float64 can represent.
    """
    if clock in table.stamped:
        if wanted.time.factor != 1.0:
            raise RecordingError(
                f"column '{clock}' has dates or times of day, which are read in s",
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
            f"column '{clock}' {readings}", 'pin time_format = "excel" or "number" in [csv] of the machine file'
        )
    exact = exact_differences(dialect, dialect.names.index(clock), values, wanted.time.factor)
    if exact is not None:
        table.values[clock], table.origin = exact
        table.findings = [
            found for found in table.findings if (found.kind, found.channel) != ("rounded_integers", clock)
        ]


def added(above: Sum | None, column: FloatArray) -> Sum:
    """Return sum and largest number of a column to the end of its next rows."""
    total, largest = above or (0.0, 0.0)
    column = column[np.isfinite(column)]
    with np.errstate(over="ignore"):
        return total + float(column.sum()), max(largest, float(np.abs(column).max(initial=0.0)))


def is_total(rows: Rows, above: Mapping[int, Sum]) -> bool:
    """Return whether the last numbers of columns are the sums of those above, more than each of them.

    `above` are the sums to the end of the rows before; the first column of a table is its clock.
    """
    found = False
    for i, column in rows.numbers.items():
        last = float(column[-1]) if i and rows.count and rows.first + rows.count > _FEWEST_SUMMED else np.nan
        if not np.isfinite(last):
            continue
        total, largest = added(above.get(i), column[:-1])
        if not largest < abs(last) or not math.isclose(total, last, rel_tol=_SAME_SUM):
            return False
        found = True
    return found
