"""How a text table is written: found from its first lines by evidence, or pinned by `[csv]` of the machine file."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from cdtool.channels import TablePins
from cdtool.errors import RecordingError
from cdtool.formats.csv.blank_lines import are_missing, without_blank_end
from cdtool.formats.csv.cells import MISSING, SEPARATORS, kind, split_line
from cdtool.formats.csv.doubtful_commas import refuse_commas_that_may_be_decimal, refuse_one_column_of_decimals
from cdtool.formats.csv.doubtful_points import settled_marks
from cdtool.formats.csv.encoding import find_text
from cdtool.formats.csv.footer import find_footer
from cdtool.formats.csv.head import Head, HeadFinder, refuse_table_above
from cdtool.formats.csv.head_words import column_kinds
from cdtool.formats.csv.lines import Line, comment_mark, is_ruler, refuse_long_line, sample_lines, shown_lines
from cdtool.formats.csv.marks import Marks, Seen, find_marks
from cdtool.formats.csv.row_kernel import count_lines
from cdtool.formats.csv.separator import find_separator
from cdtool.formats.csv.shown_pins import shown_pins
from cdtool.formats.csv.stamps import Stamped, find_layout
from cdtool.formats.csv.text import Text
from cdtool.recording import Finding

_SHOWN_ENCODINGS = {"cp1252": "Windows-1252", "latin-1": "Latin-1"}
_LOOKED = 200


@dataclass(frozen=True)
class Dialect:
    """The rows begin in line `first_line` (from 1), at byte `offset` of the stream; each is `width` cells wide.

    `kinds` has one letter a cell: N numbers, T stamps, X words, M nothing in the sample. `trailing`: each row ends
    with a separator, so that its last cell is none. `stamped` and `words` are of the columns T and X, by their number.
    `commented`: the sample has comments that are no rows; `sampled` counts its rows; `preamble`: lines above them.
    `blank_is_missing`: a blank line is a row whose only cell is empty.
    """

    text: Text
    pins: TablePins
    separator: str
    marks: Marks
    comment: str
    commented: bool
    missing: tuple[str, ...]
    header: tuple[str, ...] | None
    header_line: int
    units: tuple[str, ...]
    units_line: int
    header_text: tuple[str, ...]
    from_comment: bool
    preamble: tuple[int, ...]
    first_line: int
    sampled: int
    offset: int
    width: int
    kinds: str
    trailing: bool
    blank_is_missing: bool
    stamped: dict[int, Stamped]
    words: dict[int, Seen]
    findings: tuple[Finding, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """The columns' names; without a header their numbers from 0."""
        return self.header or tuple(str(i) for i in range(self.width - self.trailing))

    @property
    def details(self) -> dict[str, str]:
        """The dialect in words."""
        shown = {
            "separator": SEPARATORS.get(self.separator, self.separator) if self.width > 1 else "none (one column)",
            "header": f"line {self.header_line}" if self.header else "none: columns by number",
            "decimal mark": "comma" if self.marks.decimal == "," else "point",
            "encoding": self.text.encoding,
        }
        if self.units_line:
            shown["units"] = f"line {self.units_line}"
        if self.marks.thousands:
            shown["thousands"] = repr(self.marks.thousands)
        if self.text.line_end == b"\r":
            shown["line ends"] = "CR"
        return shown

    @property
    def as_pins(self) -> str:
        """The dialect as `[csv]` of a machine file, to be pasted."""
        return shown_pins(self)


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
    if marks.note:
        findings.append(Finding(marks.note, severity="warning"))
    text = without_blank_end(dialect.text) if dialect.blank_is_missing else dialect.text
    return replace(dialect, text=text, marks=marks, findings=(*dialect.findings, *findings))


def _dialect(path: Path, text: Text, stream: bytes, pins: TablePins) -> Dialect:
    refuse_long_line(text, stream)
    every = sample_lines(text, stream)
    lines = [line for line in every if not line.blank and line.number > pins.skip_lines]
    skipped = [line.number for line in every if not line.blank and line.number <= pins.skip_lines]
    findings = [Finding(f"{shown_lines(skipped)} skipped, as [csv] says", severity="note")] if skipped else []
    told = next((line for line in lines if line.separator), None)
    lines = [line for line in lines if line is not told]
    mark = comment_mark(lines, pins.comment)
    comments = [line for line in lines if line.is_comment(mark)]
    lines = [line for line in lines if not line.is_comment(mark)]
    if not lines:
        raise RecordingError(f"{path}: holds no row of numbers", "a header line and rows of numbers are needed")
    cut = find_separator(
        path,
        [x for x in lines if not is_ruler(x.text)] or lines,
        pins.separator or (told.separator or "" if told else ""),
        pins.decimal,
    )
    separator = cut.separator
    rows = [(line, split_line(line.text, separator)) for line in lines]
    wide = [(line, cells) for line, cells in rows if len(cells) == cut.width]
    lower = wide[len(wide) // 3 :] if len(wide) >= 6 else wide[1:] or wide
    kinds = column_kinds([cells for _, cells in spread(lower)], cut.width)
    head = HeadFinder(path, separator, cut.width, kinds, pins).find(lines, comments)
    data = [(line, cells) for line, cells in wide if line.number >= head.first.number]
    kinds = column_kinds([cells for _, cells in spread(data)], cut.width)
    marks = _marks(path, data, kinds, separator, pins)
    if head.names is None and not pins.separator and not told:
        named = any(len(line.text.strip(mark).split()) == 1 for line in comments if line.number < head.first.number)
        refuse_commas_that_may_be_decimal(path, data, kinds, separator, named)
    if cut.width == 2 and separator == "," and not pins.separator:
        refuse_one_column_of_decimals(path, rows, head, data)
    if pins.header is None:  # a pinned header says which table is meant: what stands above is a loss
        refuse_table_above(path, head, cut.width)
    findings += _findings(text, head, told)
    trailing = _trailing(head, kinds, data)
    below = [x for x in comments if x.number > head.first.number]
    full = {x.number for x in below if len(split_line(x.text, separator)) == cut.width}
    layout = pins.time_format if "%" in pins.time_format else ""
    columns: dict[int, list[str]] = {
        i: [cells[i] for _, cells in data if cells[i] not in pins.missing]
        for i, letter in enumerate(kinds)
        if letter in "TX"
    }
    stamped = {i: found for i, cells in columns.items() if (found := _stamped(cells, layout)).layouts}
    days = [i for i, found in stamped.items() if found.layouts[0].dated]
    stamped |= {i: stamped[i].beside_days() for day in days for i in (day - 1, day + 1) if i in stamped}
    words = {i: _first_words(data, i) for i, letter in enumerate(kinds) if letter in "TX"}
    names = head.names[: cut.width - trailing] if head.names is not None else None
    return Dialect(
        text=text,
        pins=pins,
        separator=separator,
        marks=marks,
        comment=mark,
        commented=pins.comment is not None or any(line.number not in full for line in comments),
        missing=pins.missing,
        header=tuple(_unique(names)) if names is not None else None,
        header_line=head.header_line,
        units=head.units,
        units_line=head.units_line,
        header_text=tuple(line.text for line in lines if line.number in (head.header_line, head.units_line)),
        from_comment=head.from_comment,
        preamble=head.preamble,
        first_line=head.first.number,
        sampled=len(data),
        offset=head.first.start,
        width=cut.width,
        kinds=kinds,
        trailing=trailing,
        blank_is_missing=are_missing(every, head.first.number, cut.width),
        stamped=stamped,
        words=words,
        findings=tuple(findings),
    )


def spread(rows: Sequence[Any]) -> Sequence[Any]:
    """At most some hundred rows, over all of the sample."""
    return rows[:: max(1, len(rows) // (2 * _LOOKED))]


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


def _findings(text: Text, head: Head, told: Line | None) -> list[Finding]:
    found = []
    shown = _SHOWN_ENCODINGS.get(text.encoding)
    if shown:
        found.append(Finding(f"not valid UTF-8, read as {shown}", severity="note"))
    if told:
        found.append(Finding(f"line {told.number} ({told.text.strip()[:12]}) names the separator", severity="note"))
    if head.numbers:
        lost = f"{shown_lines(head.numbers)} above the rows skipped though {_holds(head.numbers)} numbers"
        found.append(Finding(f"{lost}; skip_lines in [csv] says that they are no rows", severity="loss"))
    if words := [line for line in head.preamble if line not in head.numbers]:
        found.append(Finding(f"{shown_lines(words)} above the rows skipped: no names, no numbers", severity="note"))
    if head.from_comment:
        found.append(Finding(f"the names are those of the comment in line {head.header_line}", severity="note"))
    return found


def _holds(lines: Sequence[int]) -> str:
    return "it holds" if len(lines) == 1 else "they hold"


def _unique(cells: Sequence[str]) -> list[str]:
    # A name that is there twice can be asked for by its number only: each bears it.
    counts = Counter(cells)
    return [str(i) if not cell else f"{cell}#{i}" if counts[cell] > 1 else cell for i, cell in enumerate(cells)]
