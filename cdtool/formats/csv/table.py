"""The columns of one table as float64: numbers as they stand, stamps as seconds; and what was lost or skipped.

A table is read as a whole, or block by block where it need not fit into memory.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Generator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from cdtool.channels import ChannelMap
from cdtool.columns import Piece
from cdtool.errors import RecordingError
from cdtool.findings import Finding
from cdtool.findings.clocks import WrittenTimes
from cdtool.findings.tables import AmbiguousTimes, LastLineCut, LastLineDropped, LastLineKept, NulBytesAtEnd
from cdtool.formats.csv.cells import kind, split_line
from cdtool.formats.csv.dialect import Dialect
from cdtool.formats.csv.irregular_lines import OddLines, not_numeric
from cdtool.formats.csv.number_clock import DAY_S, exact_differences, since_1970, two_readings
from cdtool.formats.csv.row_arrays import Rows
from cdtool.formats.csv.row_kernel import MISSING_STAMP, Integers
from cdtool.formats.csv.rows import RowReader
from cdtool.formats.csv.several_clocks import Clocks, clock_findings
from cdtool.formats.csv.stamps import NS, Layout, seconds_since, unwrapped
from cdtool.large_integers import rounded_integers, rounding_finding
from cdtool.recording import FloatArray

RECENT = 20
_SHAPE = re.compile(r"[+-]?(?P<whole>[0-9]*)(?:[.,](?P<decimals>[0-9]*))?(?:[eE][+-]?(?P<power>[0-9]*))?")


class StampColumns:
    """Dates and times of day as seconds: since the first that has a date (`origin` [ns]), midnight or the full hour.

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


@dataclass
class Table:
    """`stamped` are the columns that were dates or times of day; `origin` [s] is taken off those with a date.

    `unbroken`: every line from the first row on is a row.
    """

    values: dict[str, FloatArray]
    findings: list[Finding]
    origin: float = 0.0
    stamped: set[str] = field(default_factory=set)
    unbroken: bool = True


@dataclass(frozen=True)
class Asked:
    """The columns of a table that are read, by number: of numbers, of stamps, the days beside some of these.

    `left_out` are those that a survey does not read, and why.
    """

    numeric: tuple[int, ...]
    stamps: tuple[int, ...]
    dates: Mapping[int, int]
    left_out: dict[int, Finding]

    @classmethod
    def of(cls, path: Path, dialect: Dialect, keys: Collection[str], clock: str | None, survey: bool) -> Asked:
        """By their names; raises RecordingError where a stamp can be read in two ways."""
        columns = [i for i, name in enumerate(dialect.names) if name in keys]
        numeric, stamps, left_out = _sorted_out(path, dialect, columns, clock, survey)
        dates = {column: date for column in stamps if (date := _date_beside(path, dialect, column)) is not None}
        return cls(tuple(numeric), tuple(sorted({*stamps, *dates.values()})), dates, left_out)


class _Reading:
    """A table on its way: what is read of it, how, and what has been found so far."""

    def __init__(
        self, path: Path, dialect: Dialect, keys: Collection[str], clock: str | None = None, survey: bool = True
    ) -> None:
        self.path, self.dialect, self.survey = path, dialect, survey
        self.asked = Asked.of(path, dialect, keys, clock, survey)
        self.reader = RowReader(path, dialect, self.asked.numeric, self.asked.stamps)
        self.odd = OddLines(path, dialect, survey, self.reader.targets, left_out=self.asked.left_out)
        self.stamped = StampColumns(dialect, self.asked.stamps, self.asked.dates)

    def columns(self, rows: Rows) -> dict[str, FloatArray]:
        """Return the columns of the next rows by name, of those, too, that are left out in the end."""
        numbers = {self.dialect.names[column]: rows.numbers[k] for k, column in enumerate(self.asked.numeric)}
        return numbers | self.stamped.seconds(rows)

    def end(self, rows: Rows, before: int = 0) -> list[Finding]:
        """Return the findings about skipped lines, and about the end of the file.

        `rows` are the last ones, behind `before` others; the last of them may be dropped.
        """
        odd, text = self.odd, self.dialect.text
        findings = odd.findings(rows.line(rows.count - 1))
        if not self.reader.ended and not odd.cut_line and not odd.ends_skipped:
            findings += _judge_last_line(self.dialect, rows, self.asked, before)
        if odd.cut_line or text.padding:
            line = odd.cut_line or rows.line(rows.count)
            findings.insert(0, Finding(LastLineCut(line), severity="loss"))
        if text.padding:
            findings.append(Finding(NulBytesAtEnd(text.padding), severity="loss"))
        return findings

    def table(self, columns: Mapping[str, FloatArray], findings: list[Finding], unbroken: bool) -> Table:
        """Return the table of these columns, without those that are left out; raises RecordingError where none is."""
        left_out = {self.dialect.names[column] for column in self.odd.left_out} - set(self.stamped.names)
        kept = {key: columns[key] for key in self.dialect.names if key in columns and key not in left_out}
        findings += self.stamped.findings()
        if self.survey and not kept:
            raise RecordingError(f"{self.path}: no column holds numbers only", str(findings[0]) if findings else "")
        return Table(kept, findings, (self.stamped.origin or 0) / NS, set(self.stamped.names), unbroken)


def read_table(
    path: Path, dialect: Dialect, keys: Collection[str], clock: str | None = None, wanted: ChannelMap | None = None
) -> Table:
    """Return the columns `keys`; `clock` is the one that the machine file calls the time. Raises RecordingError."""
    reading = _Reading(path, dialect, keys, clock, survey=wanted is None)
    rows = reading.reader.read(reading.odd)
    findings = reading.end(rows)
    table = reading.table(reading.columns(rows), findings, not len(rows.not_rows))
    if clock is not None and wanted is not None:
        _set_clock(path, table, clock, wanted)
        _set_exact(dialect, rows, table, clock, wanted.time.factor)
    for key, column in table.values.items():
        table.findings += rounding_finding(key, rounded_integers(column))
    return table


def table_pieces(path: Path, dialect: Dialect, keys: Collection[str]) -> Generator[Piece, None, Table]:
    """Yield the columns `keys`, as far as they hold numbers; return the table without its rows.

    The last block that holds rows may lose its last one, once the file's end is known. Raises RecordingError.
    """
    reading = _Reading(path, dialect, keys)
    clocks = Clocks.by_names(dialect)
    last, before, unbroken = reading.reader.room(0), 0, True
    first: dict[str, FloatArray] = {}
    rounded: Counter[str] = Counter()

    def piece(rows: Rows) -> Piece:
        columns = reading.columns(rows)
        numbers = columns.keys() - set(reading.stamped.names)
        rounded.update({key: rounded_integers(columns[key]) for key in numbers})
        if not first:  # as much of the clocks as shows whether they are several
            first.update({key: columns[key] for i in clocks.columns if (key := dialect.names[i]) in numbers})
        return Piece("", None, columns, rows.count)

    for rows in reading.reader.pieces(reading.odd):
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


def _sorted_out(
    path: Path, dialect: Dialect, columns: Sequence[int], clock: str | None, survey: bool
) -> tuple[list[int], list[int], dict[int, Finding]]:
    """Columns of numbers, columns of stamps, and those that a survey leaves out."""
    numeric, stamps, left_out = [], [], {}
    for column in columns:
        name, found = dialect.names[column], dialect.stamped.get(column)
        if found is None or not (survey or name == clock):
            if survey and column in dialect.words:
                words = dialect.words[column]
                left_out[column] = not_numeric(name, words.line, words.text)
            else:
                numeric.append(column)
        elif found.layout is None:
            timed = found.layouts[0].timed or _clock_beside(dialect, column) is not None
            if not survey or timed:
                raise RecordingError(
                    f"{path}: column '{name}': {found.readings}", "pin time_format in [csv] of the machine file"
                )
            left_out[column] = Finding(AmbiguousTimes(name, found.readings))
        else:
            stamps.append(column)
    return numeric, stamps, left_out


def _clock_beside(dialect: Dialect, column: int) -> int | None:
    """The column of times of day next to one of days."""
    for other in (column + 1, column - 1):
        found = dialect.stamped.get(other)
        if found is not None and found.layouts[0].timed and not found.layouts[0].dated:
            return other
    return None


def _date_beside(path: Path, dialect: Dialect, column: int) -> int | None:
    """The column of days next to one of times of day; raises RecordingError if its days may be read in two ways."""
    layout = dialect.stamped[column].layouts[0]
    if layout.dated or not layout.timed:
        return None
    for other in (column - 1, column + 1):
        found = dialect.stamped.get(other)
        if found is None or not found.layouts[0].dated or found.layouts[0].timed:
            continue
        if found.layout is None:
            raise RecordingError(
                f"{path}: column '{dialect.names[other]}': {found.readings}",
                "pin time_format in [csv] of the machine file",
            )
        return other
    return None


def _set_clock(path: Path, table: Table, clock: str, wanted: ChannelMap) -> None:
    """Hold the machine file's unit against what the clock's column is."""
    if clock in table.stamped:
        if wanted.time.factor != 1.0:
            raise RecordingError(
                f"{path}: column '{clock}' holds dates or times of day, which are read in s",
                'say unit = "s" in [channels] time',
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


def _set_exact(dialect: Dialect, rows: Rows, table: Table, clock: str, factor: float) -> None:
    """Read the clock again where its stamps have more digits than float64."""
    if clock in table.stamped or table.origin:
        return
    exact = exact_differences(dialect, rows, dialect.names.index(clock), table.values[clock], factor)
    if exact is not None:
        table.values[clock], table.origin = exact


def _judge_last_line(dialect: Dialect, rows: Rows, asked: Asked, before: int) -> list[Finding]:
    """A plain last line without its end: keep it, keep it and say so, or drop it."""
    last = dialect.width - 1
    if rows.count < 1 or dialect.trailing or last not in (*asked.numeric, *asked.stamps):
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
    whole, certain = is_whole(cell, above[: before + rows.count - 1])
    line = rows.line(rows.count - 1)
    if whole and (certain or not dialect.text.padding):
        if certain:
            return []
        return [Finding(LastLineKept(line, cell))]
    rows.count -= 1
    rows.numbers, rows.stamps = rows.numbers[:, :-1], rows.stamps[:, :-1]
    rows.not_rows = np.append(rows.not_rows, line)
    if dialect.text.padding:
        return []
    return [Finding(LastLineDropped(line, cell), severity="loss")]


@dataclass(frozen=True)
class _Shape:
    """Digits before and after the decimal mark (-1: no mark), and of the exponent (-1: none)."""

    whole: int
    decimals: int
    power: int

    @classmethod
    def of(cls, cell: str) -> _Shape | None:
        found = _SHAPE.fullmatch(cell)
        if found is None:
            return None
        decimals, power = found["decimals"], found["power"]
        return cls(len(found["whole"]), -1 if decimals is None else len(decimals), -1 if power is None else len(power))


def is_whole(cell: str, above: Sequence[str]) -> tuple[bool, bool]:
    """Is the last cell of an unfinished line whole, and is that certain? `above` are cells of its column.

    A cut leaves fewer digits. So the last number is believed if it has as many decimals as all those above it; where
    their number varies, if it has no fewer than any of them, and that is said; else the line is dropped.
    """
    if not above:
        return True, False
    if cell == '"':  # the quote that closes it is there
        return True, True
    last, shapes = _Shape.of(cell), [_Shape.of(other) for other in above]
    known = [shape for shape in shapes if shape is not None]
    if last is None:  # words, a stamp, nothing: as long as those above
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
