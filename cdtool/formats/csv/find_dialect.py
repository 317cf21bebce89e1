"""Find how a text table is written: from its first lines by evidence, or pinned by `[csv]` of the machine file."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from cdtool.channels import TablePins
from cdtool.findings import Finding
from cdtool.findings.tables import (
    DoubtfulPoint,
    NamedSeparator,
    NamesFromComment,
    NumbersAboveRows,
    OtherEncoding,
    PinnedLinesSkipped,
    WordsAboveRows,
)
from cdtool.formats.csv.blank_lines import are_missing, without_blank_end
from cdtool.formats.csv.cell_grid import CellGrid, SampleLines, cut_rows, sort_lines
from cdtool.formats.csv.cells import MISSING, kind, split_line
from cdtool.formats.csv.dialect import Dialect
from cdtool.formats.csv.doubtful_commas import refuse_commas_that_may_be_decimal, refuse_one_column_of_decimals
from cdtool.formats.csv.doubtful_points import settled_marks
from cdtool.formats.csv.encoding import find_text
from cdtool.formats.csv.footer import find_footer
from cdtool.formats.csv.head import Head, refuse_table_above
from cdtool.formats.csv.lines import Line, refuse_long_line
from cdtool.formats.csv.marks import Marks, Seen, find_marks
from cdtool.formats.csv.row_kernel import count_lines
from cdtool.formats.csv.stamps import Stamped, find_layout
from cdtool.formats.csv.text import Text

_SHOWN_ENCODINGS = {"cp1252": "Windows-1252", "latin-1": "Latin-1"}
_LOOKED = 200


def find_dialect(path: Path, sample: bytes, pins: TablePins) -> Dialect:
    """The dialect of a text file by its first bytes; raises RecordingError for no table, or one of two readings.

    Its text ends where the rows do: a footer with figures is none of it, and is told.
    """
    text, stream = find_text(path, sample, pins.encoding)
    dialect = _dialect(path, text, stream, pins)
    footer = find_footer(dialect)
    findings: list[Finding] = []
    if footer is not None:
        dialect = _dialect(path, *footer.without(text, stream), pins)
        findings.append(footer.finding(dialect.first_line + dialect.text.count_lines(dialect.offset, count_lines)))
    marks = dialect.marks if dialect.marks.sure else settled_marks(dialect)
    if marks.doubt:
        findings.append(Finding(DoubtfulPoint(marks.doubt.text, marks.doubt.line)))
    text = without_blank_end(dialect.text) if dialect.blank_is_missing else dialect.text
    return replace(dialect, text=text, marks=marks, findings=(*dialect.findings, *findings))


def _dialect(path: Path, text: Text, stream: bytes, pins: TablePins) -> Dialect:
    refuse_long_line(text, stream)
    lines = sort_lines(path, text, stream, pins)
    grid = cut_rows(path, lines, pins)
    head = grid.head
    marks = _marks(path, grid.data, grid.kinds, grid.separator, pins)
    _refuse_other_readings(path, lines, grid, pins)
    trailing = _trailing(head, grid.kinds, grid.data)
    names = head.names[: grid.width - trailing] if head.names is not None else None
    return Dialect(
        text=text,
        pins=pins,
        separator=grid.separator,
        marks=marks,
        comment=lines.mark,
        commented=pins.comment is not None or _has_comments(lines, grid),
        missing=pins.missing,
        header=tuple(_unique(names)) if names is not None else None,
        header_line=head.header_line,
        units=head.units,
        units_line=head.units_line,
        header_text=tuple(line.text for line in lines.table if line.number in (head.header_line, head.units_line)),
        from_comment=head.from_comment,
        preamble=head.preamble,
        first_line=head.first.number,
        sampled=len(grid.data),
        offset=head.first.start,
        width=grid.width,
        kinds=grid.kinds,
        trailing=trailing,
        blank_is_missing=are_missing(lines.every, head.first.number, grid.width),
        stamped=_stamped_columns(grid, pins),
        words={i: _first_words(grid.data, i) for i in grid.not_numbers},
        findings=tuple(_findings(text, lines, head)),
    )


def _refuse_other_readings(path: Path, lines: SampleLines, grid: CellGrid, pins: TablePins) -> None:
    """Raise RecordingError where the lines may be another table: its commas decimal marks, or a table above it."""
    head = grid.head
    if head.names is None and not pins.separator and not lines.separator:
        above = [line for line in lines.comments if line.number < head.first.number]
        named = any(len(line.text.strip(lines.mark).split()) == 1 for line in above)
        refuse_commas_that_may_be_decimal(path, grid.data, grid.kinds, grid.separator, named)
    if grid.width == 2 and grid.separator == "," and not pins.separator:
        refuse_one_column_of_decimals(path, grid.rows, head, grid.data)
    if pins.header is None:  # a pinned header says which table is meant: what stands above is a loss
        refuse_table_above(path, head, grid.width)


def _has_comments(lines: SampleLines, grid: CellGrid) -> bool:
    """Whether the sample has comments that are no rows made comments: above the rows, or of another width."""
    first = grid.head.first.number
    return any(
        line.number <= first or len(split_line(line.text, grid.separator)) != grid.width for line in lines.comments
    )


def _stamped_columns(grid: CellGrid, pins: TablePins) -> dict[int, Stamped]:
    """The columns of dates and times by their number; a time beside a day belongs to it."""
    layout = pins.time_format if "%" in pins.time_format else ""
    stamped: dict[int, Stamped] = {}
    for i in grid.not_numbers:
        found = _stamped([cells[i] for _, cells in grid.data if cells[i] not in pins.missing], layout)
        if found.layouts:
            stamped[i] = found
    days = [i for i, found in stamped.items() if found.layouts[0].dated]
    return stamped | {i: stamped[i].beside_days() for day in days for i in (day - 1, day + 1) if i in stamped}


def _stamped(cells: list[str], layout: str) -> Stamped:
    """A pinned layout counts for the columns that it fits; the others are looked at as ever."""
    pinned = find_layout(cells, layout) if layout else Stamped(())
    return pinned if pinned.layouts else find_layout(cells)


def _first_words(data: Sequence[tuple[Line, list[str]]], column: int) -> Seen:
    """The first cell of a column that is neither a number nor missing."""
    cells = [(cells[column], line.number) for line, cells in data if cells[column] not in MISSING]
    return Seen(*next((item for item in cells if kind(item[0]) in "TX"), cells[0]))


def _marks(path: Path, data: Sequence[tuple[Line, list[str]]], kinds: str, separator: str, pins: TablePins) -> Marks:
    if pins.decimal and pins.thousands is not None:
        return Marks(pins.decimal, pins.thousands)
    # A line without any of these letters shows a decimal point or none: some of them are enough.
    telling = re.compile(rf"[{'' if separator == ',' else ','}\"'\u00a0\u202f]|[0-9] [0-9]{{3}}|\.[0-9]{{3}}\.")
    looked = [item for i, item in enumerate(data) if i < _LOOKED or telling.search(item[0].text)]
    cells = [
        (cell, line.number)
        for line, row in looked
        for i, cell in enumerate(row)
        if kinds[i] == "N" and cell and (cell[0].isdigit() or cell[0] in "+-.,\u2212")
    ]
    return find_marks(path, cells, separator, pins.decimal, pins.thousands)


def _trailing(head: Head, kinds: str, data: Sequence[tuple[Line, list[str]]]) -> bool:
    """True if the last cell of every row is empty and has no name: each row ends with a separator."""
    if len(kinds) < 2 or kinds[-1] != "M" or any(cells[-1] for _, cells in data):
        return False
    return head.names is None or not head.names[-1]


def _findings(text: Text, lines: SampleLines, head: Head) -> list[Finding]:
    found = []
    if lines.skipped:
        found.append(Finding(PinnedLinesSkipped(tuple(lines.skipped)), severity="note"))
    shown = _SHOWN_ENCODINGS.get(text.encoding)
    if shown:
        found.append(Finding(OtherEncoding(shown), severity="note"))
    if lines.separator:
        line = lines.separator
        found.append(Finding(NamedSeparator(line.number, line.text.strip()[:12]), severity="note"))
    if head.numbers:
        found.append(Finding(NumbersAboveRows(tuple(head.numbers)), severity="loss"))
    if words := [line for line in head.preamble if line not in head.numbers]:
        found.append(Finding(WordsAboveRows(tuple(words)), severity="note"))
    if head.from_comment:
        found.append(Finding(NamesFromComment(head.header_line), severity="note"))
    return found


def _unique(cells: Sequence[str]) -> list[str]:
    # A name that is there twice can be asked for by its number only: each bears it.
    counts = Counter(cells)
    return [str(i) if not cell else f"{cell}#{i}" if counts[cell] > 1 else cell for i, cell in enumerate(cells)]
