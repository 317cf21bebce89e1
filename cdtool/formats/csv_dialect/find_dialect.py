"""Detect the dialect of a text table from its first lines, with the pins of `[csv]` in the machine file.

The sample is split into lines and cells, to find the separator, the lines of names and the first row.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from cdtool.base.errors import RecordingError
from cdtool.base.findings import Finding, lines_of
from cdtool.formats.channels.channel_map import TablePins
from cdtool.formats.csv.alike_rows import shorter_sample
from cdtool.formats.csv.cells import MISSING, NULLS, SEPARATORS, kind, split_line
from cdtool.formats.csv.encoding import open_table
from cdtool.formats.csv.lines import Line, comment_mark, is_ruler, refuse_long_line, sample_lines
from cdtool.formats.csv.stamps import StampLayouts, find_layout
from cdtool.formats.csv.text import Text
from cdtool.formats.csv_dialect.ambiguous_marks import (
    refuse_commas_that_may_be_decimal,
    refuse_one_column_of_decimals,
    resolve_marks,
)
from cdtool.formats.csv_dialect.dialect import MOST_CELLS, Dialect
from cdtool.formats.csv_dialect.head import Head, HeadFinder, refuse_table_above
from cdtool.formats.csv_dialect.head_words import column_kinds
from cdtool.formats.csv_dialect.marks import Marks, SampleCell, find_marks

_SCORED = 150
# A strong separator that occurs equally often in this share of the lines is preferred, even with fewer numbers.
_CONSISTENT = 0.9
_STRONG = "\t;|"
_SHOWN_ENCODINGS = {
    "cp1252": "Windows-1252",
    "latin-1": "Latin-1",
    "cp932": "Shift-JIS",
    "gb18030": "GB18030",
}
_LOOKED = 200
# Rows end early if so many lines, with the names and the first row, show it.
_ENDING_EARLY = 6
_TIME = re.compile(r"(?<![0-9])[0-9]{1,2}:[0-9]{2}:[0-9]{2};[0-9]{3}(?![0-9])")


@dataclass(frozen=True)
class LineSplit:
    """The result of splitting lines at a separator: cells per line, share of such lines, share of numbers in them."""

    separator: str
    width: int
    consistent: float
    numeric: float


def find_separator(lines: Sequence[Line], pinned: str = "", decimal: str = "") -> LineSplit:
    """Return the separator that splits the lines into equal numbers of cells, most of which are numbers.

    Raises RecordingError if a pinned separator splits no line but another one does. With a pinned decimal comma a table
    may have a single column.
    """
    body = lines[len(lines) // 3 :] if len(lines) >= 6 else lines[1:] or lines
    texts = [line.text for line in body]
    scored = texts if len(texts) <= 2 * _SCORED else texts[:_SCORED] + texts[-_SCORED:]
    if pinned:
        split = _split(scored, pinned)
        if split.width < 2 and any(
            _split(scored, other).width > 1 for other in SEPARATORS if other not in (pinned, decimal)
        ):
            raise RecordingError(
                f"line {body[0].number} has one cell with the separator {pinned!r}: {body[0].text[:40]!r}",
                "correct or remove separator in [csv], or the line sep= of the file",
            )
        return split
    in_times = _is_part_of_times(lines)
    used = [mark for mark in SEPARATORS if mark == " " or any(mark in text for text in scored)]
    splits = [_split(scored, separator) for separator in used if not (in_times and separator == ";")]
    possible = [split for split in splits if split.width > 1 and split.numeric > 0.0]
    if not possible:
        return _split(scored, ",")
    best = max(possible, key=lambda split: (round(split.numeric * split.consistent, 2), round(split.consistent, 2)))
    stronger = [
        split
        for split in possible
        if split.separator in _STRONG
        and best.separator not in _STRONG
        and split.consistent >= _CONSISTENT
        and split.numeric > best.numeric / 3.0
    ]
    return stronger[0] if stronger else best


def _is_part_of_times(lines: Sequence[Line]) -> bool:
    """Return whether every semicolon is in a time, `14:05:11;480`, and another mark separates names and rows alike.

    The last line may be cut off.
    """
    texts = [line.text for line in lines[:-1]]
    marked = [text for text in texts if ";" in text]
    if not 0 < len(marked) < len(texts) or any(";" in _TIME.sub("", text) for text in marked):
        return False
    # Lines above the names may have such times too: the lower half are rows.
    rows = marked[len(marked) // 2 :]
    above = [text for text in texts[: texts.index(rows[0])] if ";" not in text]
    alike = [*above[-1:], *rows]
    return any(len({text.count(mark) for text in alike} | {0}) == 2 and mark in alike[0] for mark in ",\t|")


def _split(texts: Sequence[str], separator: str) -> LineSplit:
    rows = [split_line(text, separator) for text in texts]
    if separator == " ":
        rows = [_no_blank_separator(text, row) for text, row in zip(texts, rows, strict=True)]
    widths = Counter(map(len, rows))
    width, count = widths.most_common(1)[0]
    if width < 2 and len(widths) > 1:  # a preamble of single words must not decide
        wider, seen = next(item for item in widths.most_common(2) if item[0] > 1)
        if 2 * seen >= count:
            width, count = wider, seen
    if width < 2:
        return LineSplit(separator, 1, 1.0, 0.0)
    shares = [sum(_is_number(cell, separator) for cell in row) / len(row) for row in rows if len(row) == width]
    missing = [sum(kind(cell) == "M" for cell in row) / len(row) for row in rows if len(row) == width]
    numeric = sum(share / max(1.0 - lost, 1.0 / width) for share, lost in zip(shares, missing, strict=True))
    return LineSplit(separator, width, count / len(rows), numeric / len(shares))


def _no_blank_separator(text: str, row: list[str]) -> list[str]:
    """Return the line as one cell if another separator is next to its blanks: `0, 1.5` is separated by the comma."""
    if any(cell[-1:] in ",;|" or cell[:1] in ",;|" for cell in row) or "\t" in text.strip():
        return [text]
    return row


def _is_number(cell: str, separator: str) -> bool:
    # `1,500 200,5` is not a row with the cell `500 200` between commas; between semicolons that would be a number.
    letter = kind(cell)
    return letter == "T" or (letter == "N" and not (separator == "," and " " in cell))


@dataclass(frozen=True)
class SampleLines:
    """The lines of a sample by kind: `table` are names and rows, `comments` are the lines that start with `mark`.

    `separator` is a line that only names the separator (sep=;); `skipped` are the numbers of the lines that the machine
    file skips.
    """

    every: Sequence[Line]
    table: Sequence[Line]
    comments: Sequence[Line]
    mark: str
    separator: Line | None
    skipped: Sequence[int]


def classify_lines(text: Text, stream: bytes, pins: TablePins) -> SampleLines:
    """Sort the lines of the sample by kind; raises RecordingError if no line of a table is left."""
    every = sample_lines(text, stream)
    filled = [line for line in every if not line.blank]
    lines = [line for line in filled if line.number > pins.skip_lines]
    separator = next((line for line in lines if line.separator), None)
    lines = [line for line in lines if line is not separator]
    mark = comment_mark(lines, pins.comment)
    table = [line for line in lines if not line.is_comment(mark)]
    if not table:
        raise RecordingError("contains no row of numbers", "a header line and rows of numbers are needed")
    comments = [line for line in lines if line.is_comment(mark)]
    return SampleLines(
        every, table, comments, mark, separator, [line.number for line in filled if line.number <= pins.skip_lines]
    )


@dataclass(frozen=True)
class CellGrid:
    """The sample's lines as cells: `rows` are all lines, `data` the lines of `width` cells below the `head`.

    `short`: how many cells rows have that end early; they are completed here. 0: all rows have all cells.
    """

    separator: str
    width: int
    rows: Sequence[tuple[Line, list[str]]]
    data: Sequence[tuple[Line, list[str]]]
    head: Head
    kinds: str
    short: int

    @property
    def not_numbers(self) -> list[int]:
        """Return the columns of time stamps and words."""
        return [i for i, letter in enumerate(self.kinds) if letter in "TX"]


def split_rows(lines: SampleLines, pins: TablePins) -> CellGrid:
    """Find separator, width and head; raises RecordingError if there is no table, or one that is ambiguous."""
    named = lines.separator.separator or "" if lines.separator else ""
    without_rulers = [line for line in lines.table if not is_ruler(line.text)] or lines.table
    split = find_separator(without_rulers, pins.separator or named, pins.decimal)
    rows = [(line, split_line(line.text, split.separator)) for line in lines.table]
    # Between blanks, an empty cell cannot be seen: rows may be without any of their cells.
    width = _full_width(rows, split.width) if split.separator != " " else split.width
    short = split.width if width > split.width else 0
    if short:
        rows = [_completed(line, cells, split.separator, width) for line, cells in rows]
        split = replace(split, width=width)
        lines = replace(lines, table=[line for line, _ in rows])
    wide = [(line, cells) for line, cells in rows if len(cells) == split.width]
    lower = wide[len(wide) // 3 :] if len(wide) >= 6 else wide[1:] or wide
    kinds = column_kinds([cells for _, cells in _sample_evenly(lower)], split.width)
    head = HeadFinder(split.separator, split.width, kinds, pins).find(lines.table, lines.comments)
    end = next((line.number for line, cells in reversed(wide) if kind(cells[0]) != "X" or kinds[0] not in "NT"), 0)
    data = [(line, cells) for line, cells in wide if head.first.number <= line.number <= end]  # without a footer
    kinds = column_kinds([cells for _, cells in _sample_evenly(data)], split.width)
    return CellGrid(split.separator, split.width, rows, data, head, kinds, short)


def _full_width(rows: Sequence[tuple[Line, list[str]]], width: int) -> int:
    """Return the number of columns: more than most lines have if the names and the first row have more.

    Then all other rows end early: their last columns, statistics for example, have a value in the first row only.
    """
    if len(rows) < _ENDING_EARLY or {len(cells) for _, cells in rows[2:]} != {width}:
        return width
    names, first = rows[0][1], rows[1][1]
    if not len(names) == len(first) > width or not any(names[width:]) or len(names) * len(rows) > MOST_CELLS:
        return width
    named = all(kind(cell) in "XM" for cell in names)
    return len(names) if named and all(kind(cell) in "NTM" for cell in first) else width


def _completed(line: Line, cells: list[str], separator: str, width: int) -> tuple[Line, list[str]]:
    """Return a line that ends early with empty cells."""
    missing = width - len(cells)
    text = line.text.rstrip("\r\n") + separator * missing if missing > 0 else line.text
    return replace(line, text=text), [*cells, *[""] * missing]


def _sample_evenly(rows: Sequence[Any]) -> Sequence[Any]:
    """Return at most some hundred rows, evenly distributed over the sample."""
    return rows[:: max(1, len(rows) // (2 * _LOOKED))]


def find_dialect(path: Path, pins: TablePins) -> Dialect:
    """Return the dialect of a text file from its first bytes.

    Raises RecordingError if the file is not a table, or is ambiguous.
    """
    text, stream = open_table(path, pins.encoding)
    dialect = _dialect(text, stream, pins)
    if dialect.marks.sure:
        return dialect
    marks = resolve_marks(dialect)
    doubt = (
        []
        if marks.doubt is None
        else [Finding("doubtful_point", "", {"text": marks.doubt.text, "line": marks.doubt.line})]
    )
    return replace(dialect, marks=marks, findings=(*dialect.findings, *doubt))


def _dialect(text: Text, stream: bytes, pins: TablePins) -> Dialect:
    """Return the dialect, footer and ambiguous marks not considered, from a shortened sample if that is sufficient."""
    refuse_long_line(text, stream)
    if (shorter := shorter_sample(text, stream, pins)) is not None:
        if pins == TablePins() and (dialect := shorter.plain(text)) is not None:
            return dialect
        try:
            if (dialect := shorter.whole(_by_lines(text, shorter.stream, pins))) is not None:
                return dialect
        except RecordingError:  # the number of a line in the message may be wrong: read the whole sample
            pass
    return _by_lines(text, stream, pins)


def _by_lines(text: Text, stream: bytes, pins: TablePins) -> Dialect:
    """Return the dialect from all lines of a sample."""
    lines = classify_lines(text, stream, pins)
    grid = split_rows(lines, pins)
    head = grid.head
    marks = _marks(grid.data, grid.kinds, grid.separator, pins)
    _refuse_other_readings(lines, grid, pins)
    trailing = _trailing(head, grid.kinds, grid.data)
    names = head.names[: grid.width - trailing] if head.names is not None else None
    return Dialect(
        text=text,
        pins=pins,
        separator=grid.separator,
        marks=marks,
        comment=lines.mark,
        commented=pins.comment is not None or _has_comments(lines, grid),
        missing=(*pins.missing, *NULLS),
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
        blank_is_missing=_are_missing_samples(lines.every, head.first.number, grid.width),
        stamped=_stamped_columns(grid, pins),
        short_rows=grid.short > 0,
        short_width=grid.short,
        words={i: _first_words(grid.data, i) for i in grid.not_numbers},
        findings=tuple(_findings(text, lines, head)),
    )


def _are_missing_samples(lines: Sequence[Line], first: int, width: int) -> bool:
    """Return whether blank lines are missing samples of the table whose rows start in line number `first`.

    They are if the table has one column and fewer than half of the `lines` of its rows are blank: each is a missing
    sample, so that later rows have their times. If every other line is blank, the blank lines only separate the rows.
    """
    if width != 1:
        return False
    rows = [line.number for line in lines if not line.blank and line.number >= first]
    blank = [line.number for line in lines if line.blank and first < line.number < rows[-1]]
    return not blank or 2 * len(blank) < rows[-1] - first


def _refuse_other_readings(lines: SampleLines, grid: CellGrid, pins: TablePins) -> None:
    """Raise RecordingError if the commas may be decimal marks, or if another table is above this one."""
    head = grid.head
    if head.names is None and not pins.separator and not lines.separator:
        above = [line for line in lines.comments if line.number < head.first.number]
        named = any(len(line.text.strip(lines.mark).split()) == 1 for line in above)
        refuse_commas_that_may_be_decimal(grid.data, grid.kinds, grid.separator, named)
    if grid.width == 2 and grid.separator == "," and not pins.separator:
        refuse_one_column_of_decimals(grid.rows, head, grid.data)
    if pins.header is None:  # a pinned header selects the table, and rows above it are reported as a loss
        refuse_table_above(head, grid.width)


def _has_comments(lines: SampleLines, grid: CellGrid) -> bool:
    """Return whether the sample has comments other than commented rows: above the rows, or of another width."""
    first = grid.head.first.number
    return any(
        line.number <= first or len(split_line(line.text, grid.separator)) != grid.width for line in lines.comments
    )


def _stamped_columns(grid: CellGrid, pins: TablePins) -> dict[int, StampLayouts]:
    """Return the columns of dates and times by number; a time next to a column of days is a time of day."""
    layout = pins.time_format if "%" in pins.time_format else ""
    stamped: dict[int, StampLayouts] = {}
    for i in grid.not_numbers:
        layouts = _find_layouts([cells[i] for _, cells in grid.data if cells[i] not in (*pins.missing, *NULLS)], layout)
        if layouts.layouts:
            stamped[i] = layouts
    days = [i for i, layouts in stamped.items() if layouts.layouts[0].dated]
    return stamped | {i: stamped[i].next_to_days() for day in days for i in (day - 1, day + 1) if i in stamped}


def _find_layouts(cells: list[str], layout: str) -> StampLayouts:
    """Return the pinned layout if it matches the cells, otherwise the detected ones."""
    pinned = find_layout(cells, layout) if layout else StampLayouts(())
    return pinned if pinned.layouts else find_layout(cells)


def _first_words(data: Sequence[tuple[Line, list[str]]], column: int) -> SampleCell:
    """Return the first cell of a column that is neither a number nor missing."""
    cells = [(cells[column], line.number) for line, cells in data if cells[column] not in MISSING]
    return SampleCell(*next((cell for cell in cells if kind(cell[0]) in "TX"), cells[0]))


def _marks(data: Sequence[tuple[Line, list[str]]], kinds: str, separator: str, pins: TablePins) -> Marks:
    if pins.decimal and pins.thousands is not None:
        return Marks(pins.decimal, pins.thousands)
    # Lines without any of these marks have decimal points or whole numbers: a limited number of them is sufficient.
    mark = re.compile(rf"[{'' if separator == ',' else ','}\"'\u00a0\u202f]|[0-9] [0-9]{{3}}|\.[0-9]{{3}}\.")
    rows = [row for i, row in enumerate(data) if i < _LOOKED or mark.search(row[0].text)]
    cells = [
        (cell, line.number)
        for line, row in rows
        for i, cell in enumerate(row)
        if kinds[i] == "N" and cell and (cell[0].isdigit() or cell[0] in "+-.,\u2212")
    ]
    return find_marks(cells, separator, pins.decimal, pins.thousands)


def _trailing(head: Head, kinds: str, data: Sequence[tuple[Line, list[str]]]) -> bool:
    """Return whether each row ends with a separator: the last cell of every row is empty and has no name."""
    if len(kinds) < 2 or kinds[-1] != "M" or any(cells[-1] for _, cells in data):
        return False
    return head.names is None or not head.names[-1]


def _findings(text: Text, lines: SampleLines, head: Head) -> list[Finding]:
    findings = []
    if lines.skipped:
        findings.append(Finding("pinned_lines_skipped", "", lines_of(lines.skipped)))
    encoding = _SHOWN_ENCODINGS.get(text.encoding)
    if encoding:
        findings.append(Finding("other_encoding", "", {"encoding": encoding}))
    if lines.separator:
        line = lines.separator
        findings.append(Finding("named_separator", "", {"line": line.number, "text": line.text.strip()[:12]}))
    if head.numbers:
        findings.append(Finding("numbers_above_rows", "", lines_of(head.numbers)))
    if words := [line for line in head.preamble if line not in head.numbers]:
        findings.append(Finding("words_above_rows", "", lines_of(words)))
    if head.from_comment:
        findings.append(Finding("names_from_comment", "", {"line": head.header_line}))
    return findings


def _unique(cells: Sequence[str]) -> list[str]:
    # A repeated name is ambiguous: the column's number is appended, and the column is requested by that number.
    counts = Counter(cells)
    return [str(i) if not cell else f"{cell}#{i}" if counts[cell] > 1 else cell for i, cell in enumerate(cells)]
