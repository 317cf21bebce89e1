"""The columns of one table as float64: numbers as they stand, stamps as seconds; and what was lost or skipped."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from cdtool.channels import ChannelMap
from cdtool.errors import RecordingError
from cdtool.findings import Finding
from cdtool.findings.tables import AmbiguousTimes, LastLineCut, LastLineDropped, LastLineKept, NulBytesAtEnd
from cdtool.formats.csv.cells import kind, split_line
from cdtool.formats.csv.dialect import Dialect
from cdtool.formats.csv.exact_clock import exact_differences
from cdtool.formats.csv.excel_days import DAY_S, since_1970, two_readings
from cdtool.formats.csv.last_line import RECENT, is_whole
from cdtool.formats.csv.odd_lines import OddLines, not_numeric
from cdtool.formats.csv.row_arrays import Rows
from cdtool.formats.csv.rows import RowReader
from cdtool.formats.csv.stamp_columns import StampColumns
from cdtool.formats.csv.stamps import NS
from cdtool.large_integers import rounded_integers, rounding_finding
from cdtool.recording import FloatArray


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


def read_table(
    path: Path, dialect: Dialect, keys: Collection[str], clock: str | None, wanted: ChannelMap | None
) -> Table:
    """The columns `keys`; `clock` is the one that the machine file calls the time. Raises RecordingError."""
    survey = wanted is None
    asked = Asked.of(path, dialect, keys, clock, survey)
    reader = RowReader(path, dialect, asked.numeric, asked.stamps)
    odd = OddLines(path, dialect, survey, reader.targets, left_out=asked.left_out)
    rows = reader.read(odd)
    findings = end_findings(dialect, asked, odd, reader.ended, rows)
    values = {
        dialect.names[column]: rows.numbers[k] for k, column in enumerate(asked.numeric) if column not in odd.left_out
    }
    stamped = StampColumns(dialect, asked.stamps, asked.dates)
    values |= stamped.seconds(rows)
    findings += stamped.findings()
    table = Table(values, findings, (stamped.origin or 0) / NS, set(stamped.names), not len(rows.not_rows))
    if survey and not table.values:
        raise no_numbers(path, findings)
    if clock is not None and wanted is not None:
        _set_clock(path, table, clock, wanted)
        _set_exact(dialect, rows, table, clock, wanted.time.factor)
    table.findings += _rounded(table.values)
    table.values = {key: table.values[key] for key in dialect.names if key in table.values}
    return table


def no_numbers(path: Path, findings: Sequence[Finding]) -> RecordingError:
    """A survey found nothing."""
    return RecordingError(f"{path}: no column holds numbers only", str(findings[0]) if findings else "")


def end_findings(
    dialect: Dialect, asked: Asked, odd: OddLines, ended: bool, rows: Rows, before: int = 0
) -> list[Finding]:
    """What was skipped, and what became of the end; `rows` are the last ones, behind `before` others, and may lose one.

    `ended`: the last line has its line end.
    """
    findings = odd.findings(rows.line(rows.count - 1))
    if not ended and not odd.cut_line and not odd.ends_skipped:
        findings += _judge_last_line(dialect, rows, asked, before)
    if odd.cut_line or dialect.text.padding:
        line = odd.cut_line or rows.line(rows.count)
        findings.insert(0, Finding(LastLineCut(line), severity="loss"))
    if dialect.text.padding:
        findings.append(Finding(NulBytesAtEnd(dialect.text.padding), severity="loss"))
    return findings


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


def _rounded(values: Mapping[str, FloatArray]) -> list[Finding]:
    return [found for key, column in values.items() for found in rounding_finding(key, rounded_integers(column))]


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
