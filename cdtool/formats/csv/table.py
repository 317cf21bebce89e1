"""Read the columns of a text table as float64 (time stamps as seconds), with findings on losses and skipped lines.

A table is read at once, or block by block if it need not fit into memory.

Clocks of numbers: days as counted by Excel, and stamps with more digits than float64 can represent.

45231.5417 days since 1899-12-30 are 2023-11-01 13:00. Stamps such as 1700000000123456789 ns or 1700000000.123456789 s
count from 1970. They are read a second time, as whole nanoseconds, and the first stamp is subtracted before anything is
rounded: float64 represents the stamps with a resolution of 0.24 us only, but their differences exactly.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import RecordingError
from cdtool.base.findings import Finding
from cdtool.base.plain_text import digits
from cdtool.formats.channels.channel_map import ChannelMap
from cdtool.formats.column_names import column_key
from cdtool.formats.columns import Categories, Column, Piece
from cdtool.formats.csv.cell_values import RequestedColumns, not_numeric
from cdtool.formats.csv.rows import RowReader, Rows, plain_rows
from cdtool.formats.csv.stamps import MISSING_STAMP, NS, Integers, StampLayout, seconds_since, unwrap
from cdtool.formats.csv.text import BLOCK_BYTES
from cdtool.formats.csv_dialect.dialect import Dialect, unit_from_header
from cdtool.formats.epoch_clock import EXCEL_2000, EXCEL_2100, SHORTEST_STEP
from cdtool.formats.large_integers import rounded_integers, rounding_finding
from cdtool.formats.pieces import Pieces, join_pieces
from cdtool.formats.source import Source
from cdtool.recordings.clock.stamps import THREE_YEARS, count_leading_strays
from cdtool.recordings.units import DAY_S

# Days since 1899-12-30, as counted by Excel, of 1970-01-01.
_DAY_1970 = 25569.0
# A unit's factor to s -> its decimals down to 1 ns.
_DECIMALS = {1.0: 9, 1e-3: 6, 1e-6: 3, 1e-9: 0}
# Above _FIRST [s] float64 cannot represent nanoseconds; up to _LAST [s] 64-bit integers can.
_FIRST, _LAST = 2.0**53 / NS, 2.0**63 / NS


def two_readings(stamps: FloatArray, factor: float) -> str:
    """Return both readings of a clock that may be in days or in the unit of `factor` [s]; empty if it is not in days.

    `stamps` (n,) are all stamps of the column; missing ones are ignored. The step is the mean over the middle half:
    stamps with four decimals repeat, and the first or last stamp may be an outlier. A clock above 20 kHz whose stamps
    are in the range of the days from 2000 to 2100 cannot be distinguished from a clock in days.
    """
    known = stamps[np.isfinite(stamps)]
    if len(known) < 2 or known.max() <= EXCEL_2000 or not EXCEL_2000 < np.median(known) < EXCEL_2100:
        return ""
    quarter = len(known) // 4
    step = float(known[-1 - quarter] - known[quarter]) / (len(known) - 1 - 2 * quarter)
    if not 0.0 < step < min(10.0 / DAY_S, SHORTEST_STEP / factor):  # a clock in days steps by less than 10 s
        return ""
    start = np.datetime64(round(since_1970(float(known[0]))), "s")
    return (
        f"starts at {known[0]:.9g} in steps of {step:.3g}: days of Excel ({str(start).replace('T', ' ')}, "
        f"{digits(1.0 / (step * DAY_S), 3)} Hz), or {known[0] * factor:.9g} s at {digits(1.0 / (step * factor), 3)} Hz?"
    )


def since_1970(days: float) -> float:
    """Return the seconds since 1970 of a day as counted by Excel."""
    return (days - _DAY_1970) * DAY_S


def exact_differences(
    dialect: Dialect, column: int, stamps: FloatArray, factor: float
) -> tuple[FloatArray, float] | None:
    """Return the stamps (n,) minus the first one, in the column's unit, and the first stamp [s].

    The result is None if float64 can represent the stamps. `factor` is the factor from the unit to s. Outliers are not
    used as the first stamp. Stamps that are not plain digits (in quotes, with an exponent) are rounded to float64;
    missing stamps are NaN.
    """
    decimals = _DECIMALS.get(factor)
    if decimals is None or np.fmax.reduce(stamps, initial=-np.inf) * factor <= _FIRST:  # the usual case
        return None
    known = np.isfinite(stamps)
    finite, scale = stamps[known], 10**decimals
    first_row = count_leading_strays(finite, THREE_YEARS / factor)
    if not (finite[first_row:] * factor > _FIRST)[:1].any() or np.abs(finite).max() * factor >= _LAST:
        return None
    whole = np.rint(finite)
    rounded = whole.astype(np.int64) * scale + np.rint((finite - whole) * scale).astype(np.int64)
    reader = RowReader(dialect, RequestedColumns((), whole=(column,), decimals=decimals), survey=True)
    ticks = np.concatenate([rows.whole[column] for rows in reader.pieces()])[: len(stamps)][known]
    exact = np.where(ticks == MISSING_STAMP, rounded, ticks)
    differences = np.full(len(stamps), np.nan)
    differences[known] = (exact - exact[first_row]) / scale
    return differences, int(exact[first_row]) / NS


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

    def _layout(self, column: int) -> StampLayout:
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


def read_table(
    dialect: Dialect, keys: Collection[str], clock: str | None = None, wanted: ChannelMap | None = None
) -> Source:
    """Return the columns `keys`; `clock` is the machine file's time column. Raises RecordingError."""
    table = None if wanted is None or wanted.worded else _plain_table(dialect, keys)
    table = table or join_pieces(table_pieces(dialect, keys, clock, wanted), sort=False)
    return table if clock is None or wanted is None else _with_clock(dialect, table, clock, wanted)


def _plain_table(dialect: Dialect, keys: Collection[str]) -> Source | None:
    """Return a small table that has only numbers in plain rows, read at once; None if it may have anything else."""
    text, names = dialect.text, dialect.names
    if dialect.stamped or text.padding or text.content is None or not 0 < len(text.content) <= BLOCK_BYTES:
        return None
    columns = [i for i, name in enumerate(names) if name in keys]
    rows = text.content[text.mark + dialect.offset : text.size]
    plain = plain_rows(dialect, columns, (), rows, ended=True) if rows.endswith(b"\n") and columns else None
    if plain is None:
        return None
    values = {names[column]: plain[1][column] for column in columns}
    rounded = [note for key in values for note in rounding_finding(key, rounded_integers(values[key]))]
    return _source(dialect, values, plain[0], rounded)


def table_pieces(
    dialect: Dialect, keys: Collection[str], clock: str | None = None, wanted: ChannelMap | None = None
) -> Pieces:
    """Yield those of the columns `keys` that have numbers, block by block.

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
    for rows in reader.pieces():
        numbers = {names[column]: values for column, values in rows.numbers.items()}
        rounded.update({key: rounded_integers(values) for key, values in numbers.items()})
        yield Piece("", None, numbers | stamped.seconds(rows), rows.count)
    findings = [*reader.findings, *stamped.findings()]
    remaining = [name for name in names if name in {*(names[i] for i in reader.values.numeric), *stamped.names}]
    if wanted is None and not remaining:
        raise RecordingError("no column has only numbers", str(findings[0]) if findings else "")
    findings += [note for key in remaining for note in rounding_finding(key, rounded[key])]
    table = _source(dialect, dict.fromkeys(remaining, np.empty(0)), reader.lines.rows, findings)
    known = {**table.columns}
    known |= {key: replace(known[key], unit="s") for key in stamped.names}
    known |= {names[i]: replace(known[names[i]], words=each.words) for i, each in categories.items()}
    first = table.first_row if reader.lines.only_rows else 0
    origin = (stamped.origin or 0) / NS or table.origin
    return replace(table, columns=known, first_row=first, origin=origin)


def _source(dialect: Dialect, values: Mapping[str, FloatArray], rows: int, findings: Sequence[Finding]) -> Source:
    """Return columns of numbers, of which every line below the head is a row."""
    fact = {"rows": rows, "stated": dialect.stated_rows}
    lost = [Finding("fewer_rows", "", fact)] if rows < dialect.stated_rows else []
    return Source(
        path=dialect.text.path,
        format="csv",
        columns={key: Column(key, column, unit=unit_from_header(dialect, key)) for key, column in values.items()},
        origin=dialect.origin,
        findings=(*dialect.findings, *lost, *findings),
        details=dialect.details,
        names=dialect.names,
        first_row=dialect.first_line,
        dialect=dialect.as_pins,
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


def _with_clock(dialect: Dialect, table: Source, clock: str, wanted: ChannelMap) -> Source:
    """Check the machine file's unit against the clock's column, and convert days of Excel to seconds.

    It is read again if its stamps have more digits than float64 can represent.
    """
    number, values = dialect.names.index(clock), table.columns[clock].values
    if number in dialect.stamped:
        if wanted.time.factor != 1.0:
            raise RecordingError(
                f"column '{clock}' has dates or times of day, which are read in s",
                'write unit = "s" in [channels] time',
            )
        return table
    finite = values[np.isfinite(values)]
    if not len(finite):
        return table
    if wanted.pins.time_format == "excel":
        return _with_times(table, clock, (values - finite[0]) * DAY_S, since_1970(float(finite[0])))
    readings = "" if wanted.pins.time_format else two_readings(values, wanted.time.factor)
    if readings:
        raise RecordingError(
            f"column '{clock}' {readings}", 'pin time_format = "excel" or "number" in [csv] of the machine file'
        )
    exact = exact_differences(dialect, number, values, wanted.time.factor)
    if exact is None:
        return table
    findings = tuple(note for note in table.findings if (note.kind, note.channel) != ("rounded_integers", clock))
    return _with_times(replace(table, findings=findings), clock, *exact)


def _with_times(table: Source, clock: str, times: FloatArray, origin: float) -> Source:
    columns = {**table.columns, clock: replace(table.columns[clock], values=times)}
    return replace(table, columns=columns, origin=origin or table.origin)
