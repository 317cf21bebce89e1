"""Detect the dialect of a text table from its first lines, with the pins of `[csv]` in the machine file.

The sample is split into lines and cells, to find the separator, the lines of names and the first row.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import takewhile
from pathlib import Path
from typing import Any

from cdtool.base.errors import RecordingError
from cdtool.base.findings import Finding, lines_of
from cdtool.formats.channels.channel_map import TablePins
from cdtool.formats.csv.alike_rows import shorter_sample
from cdtool.formats.csv.cells import MISSING, NULLS, SEPARATORS, kind, number, split_line
from cdtool.formats.csv.encoding import open_table
from cdtool.formats.csv.lines import Line, SplitLine, comment_mark, is_ruler, refuse_long_line, sample_lines
from cdtool.formats.csv.stamps import StampLayouts, find_layout
from cdtool.formats.csv.text import Text
from cdtool.formats.csv_dialect.ambiguous_marks import refuse_commas_that_may_be_decimal, resolve_marks
from cdtool.formats.csv_dialect.dialect import MOST_CELLS, Dialect
from cdtool.formats.csv_dialect.foreign_heads import MEASUREMENT, MEASUREMENT_END, MEASUREMENT_HINT, measurement_head
from cdtool.formats.csv_dialect.head import Head, HeadFinder, refuse_table_above
from cdtool.formats.csv_dialect.head_words import column_kinds
from cdtool.formats.csv_dialect.marks import Marks, SampleCell, find_marks
from cdtool.formats.groups import PREFIX
from cdtool.formats.source import stated_origin

# Lines at the beginning and at the end of a sample in which separators are counted.
_SCORED = 150
_STRONG = "\t;|"
_SHOWN_ENCODINGS = {
    "cp1252": "Windows-1252",
    "latin-1": "Latin-1",
    "cp932": "Shift-JIS",
    "gb18030": "GB18030",
}
# Rows whose numbers are looked at for the decimal mark; marks that decide are looked for in all.
_LOOKED = 200
_WRITTEN = f"# {PREFIX}"
_ORIGIN = f"{_WRITTEN}origin_s: "
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
        # A strong separator that occurs equally often in most lines is preferred, even with fewer numbers.
        and split.consistent >= 0.9
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
class Sample:
    """The lines of a sample by kind: `table` are names and rows, `comments` are the lines that start with `mark`.

    `named` is a line that only names the separator (sep=;); `skipped` are the lines that the machine file skips.
    `data` are the rows of `width` cells below the `head`; those that end early, after `short_rows` cells, are completed
    here.
    """

    every: Sequence[Line]
    table: Sequence[SplitLine]
    comments: Sequence[Line]
    mark: str
    named: Line | None
    skipped: Sequence[int]
    separator: str
    width: int
    data: Sequence[SplitLine]
    head: Head
    kinds: str
    short_rows: range

    @property
    def not_numbers(self) -> list[int]:
        """Return the columns of time stamps and words."""
        return [i for i, letter in enumerate(self.kinds) if letter in "TX"]


def read_sample_lines(text: Text, stream: bytes, pins: TablePins) -> Sample:
    """Find separator, width and head; raises RecordingError if there is no table, or one that is ambiguous."""
    every = sample_lines(text, stream)
    filled = [line for line in every if not line.blank]
    lines = [line for line in filled if line.number > pins.skip_lines]
    named = next((line for line in lines if line.separator), None)
    lines = [line for line in lines if line is not named]
    mark = comment_mark(lines, pins.comment)
    comments = [line for line in lines if line.is_comment(mark)]
    lines = [line for line in lines if not line.is_comment(mark)]
    if not lines:
        raise RecordingError("contains no row of numbers", "a header line and rows of numbers are needed")
    without_rulers = [line for line in lines if not is_ruler(line.text)] or lines
    stated = named.separator or "" if named else ""
    split = find_separator(without_rulers, pins.separator or stated, pins.decimal)
    table = [SplitLine.of(line, split.separator) for line in lines]
    # Between blanks, an empty cell cannot be seen: rows may be without any of their cells.
    width = _full_width(table, split.width) if split.separator != " " else split.width
    if width > split.width:
        table = [_completed(row, split.separator, width) for row in table]
    wide = [row for row in table if len(row.cells) == width]
    lower = wide[len(wide) // 3 :] if len(wide) >= 6 else wide[1:] or wide
    kinds = column_kinds([row.cells for row in _sample_evenly(lower)], width)
    head = HeadFinder(split.separator, width, kinds, pins).find(table, comments)
    end = next((row.number for row in reversed(wide) if kind(row.cells[0]) != "X" or kinds[0] not in "NT"), 0)
    data = [row for row in wide if head.first_line <= row.number <= end]  # without a footer
    return Sample(
        every=every,
        table=table,
        comments=comments,
        mark=mark,
        named=named,
        skipped=[line.number for line in filled if line.number <= pins.skip_lines],
        separator=split.separator,
        width=width,
        data=data,
        head=head,
        kinds=column_kinds([row.cells for row in _sample_evenly(data)], width),
        short_rows=range(split.width, split.width + (width > split.width)),
    )


def _full_width(rows: Sequence[SplitLine], width: int) -> int:
    """Return the number of columns: more than most lines have if the names and the first row have more.

    Then all other rows end early: their last columns, statistics for example, have a value in the first row only.
    """
    # Rows end early if six lines, with the names and the first row, show it.
    if len(rows) < 6 or {len(row.cells) for row in rows[2:]} != {width}:
        return width
    names, first = rows[0], rows[1]
    wider = len(names.cells)
    if not wider == len(first.cells) > width or not any(names.cells[width:]) or wider * len(rows) > MOST_CELLS:
        return width
    # LabVIEW writes a comment into the first row only.
    kinds = first.kinds[:width] if names.cells[-1] == "Comment" else first.kinds
    return wider if {*names.kinds} <= {*"XM"} and {*kinds} <= {*"NTM"} else width


def _completed(row: SplitLine, separator: str, width: int) -> SplitLine:
    """Return a line that ends early with empty cells."""
    missing = width - len(row.cells)
    text = row.text.rstrip("\r\n") + separator * missing if missing > 0 else row.text
    return replace(row, text=text, cells=[*row.cells, *[""] * missing])


def _sample_evenly(rows: Sequence[Any]) -> Sequence[Any]:
    """Return at most some hundred rows, evenly distributed over the sample."""
    return rows[:: max(1, len(rows) // (2 * _LOOKED))]


def find_dialect(path: Path, pins: TablePins) -> Dialect:
    """Return the dialect of a text file from its first bytes.

    Raises RecordingError if the file is not a table, or is ambiguous.
    """
    text, stream = open_table(path, pins.encoding)
    measurement = stream.startswith(MEASUREMENT) and not pins.skip_lines
    dialect = _measurement(text, stream, pins) if measurement else _dialect(text, stream, pins)
    return dialect if dialect.marks.sure else replace(dialect, marks=resolve_marks(dialect))


def _measurement(text: Text, stream: bytes, pins: TablePins) -> Dialect:
    """Return the dialect of a measurement file of LabVIEW, whose head states names, units and the count of rows."""
    line, separator, keys = measurement_head(text.decode(stream).split(text.line_end.decode()))
    # One end is that of the file's own head.
    if (segments := sum(block.count(MEASUREMENT_END) for block in text.blocks(0)) - 1) > 1:
        raise RecordingError(f"LabVIEW: it has {segments} segments", MEASUREMENT_HINT)
    stated = replace(pins, skip_lines=line - 1, separator=pins.separator or separator)
    dialect = _dialect(text, stream, replace(stated, header=line if pins.header is None else pins.header))
    findings = tuple(each for each in dialect.findings if each.kind != "pinned_lines_skipped")
    rows = number(next(filter(None, keys.get("Samples", ())), ""), ".") or 0.0
    units = ("", *keys.get("Y_Unit_Label", ()))
    return replace(dialect, pins=pins, units=units, stated_rows=rows, findings=findings)


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
    sample = read_sample_lines(text, stream, pins)
    head = sample.head
    marks = _marks(sample, pins)
    _refuse_other_readings(sample, pins)
    trailing = _trailing(sample)
    if head.header is not None:
        head = replace(head, header=tuple(_unique(head.header[: sample.width - trailing])))
    return Dialect(
        **vars(head),
        text=text,
        pins=pins,
        separator=sample.separator,
        marks=marks,
        comment=sample.mark,
        commented=pins.comment is not None or _has_comments(sample),
        missing=(*pins.missing, *NULLS),
        header_text=tuple(row.text for row in sample.table if row.number in (head.header_line, head.units_line)),
        sampled=len(sample.data),
        width=sample.width,
        kinds=sample.kinds,
        trailing=trailing,
        blank_is_missing=_are_missing_samples(sample.every, head.first_line, sample.width),
        stamped=_stamped_columns(sample, pins),
        short_rows=sample.short_rows,
        words={i: _first_words(sample.data, i) for i in sample.not_numbers},
        origin=_written_origin(sample.every),
        findings=tuple(_findings(text, sample)),
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


def _refuse_other_readings(sample: Sample, pins: TablePins) -> None:
    """Raise RecordingError if the commas may be decimal marks, or if there are several tables, above or in the rows."""
    if sample.head.header is None and sample.separator == "," and not pins.separator and not sample.named:
        refuse_commas_that_may_be_decimal(sample.data, sample.kinds)
    if {"VarName", "VarValue"} <= {*(sample.head.header or ())}:
        raise RecordingError(
            f"line {sample.head.header_line}: Siemens writes the values of all tags into one column, VarValue",
            "give each tag a column; in pandas: pivot(index='Time_ms', columns='VarName', values='VarValue')",
        )
    if pins.header is None:  # a pinned header selects the table, and rows above it are reported as a loss
        refuse_table_above(sample.head, sample.width)


def _written_origin(lines: Sequence[Line]) -> float:
    """Return the origin [s] that the head of a file of cdtool states, in its comments before any other line."""
    head = takewhile(lambda line: line.text.startswith(_WRITTEN), lines)
    return stated_origin(next((line.text.removeprefix(_ORIGIN) for line in head if line.text.startswith(_ORIGIN)), "0"))


def _has_comments(sample: Sample) -> bool:
    """Return whether the sample has comments other than commented rows: above the rows, or of another width."""
    return any(
        line.number <= sample.head.first_line or len(split_line(line.text, sample.separator)) != sample.width
        for line in sample.comments
    )


def _stamped_columns(sample: Sample, pins: TablePins) -> dict[int, StampLayouts]:
    """Return the columns of dates and times by number; a time next to a column of days is a time of day."""
    layout = pins.time_format if "%" in pins.time_format else ""
    stamped: dict[int, StampLayouts] = {}
    for i in sample.not_numbers:
        cells = [row.cells[i] for row in sample.data if row.cells[i] not in (*pins.missing, *NULLS)]
        layouts = _find_layouts(cells, layout)
        if layouts.layouts:
            stamped[i] = layouts
    days = [i for i, layouts in stamped.items() if layouts.layouts[0].dated]
    return stamped | {i: stamped[i].next_to_days() for day in days for i in (day - 1, day + 1) if i in stamped}


def _find_layouts(cells: list[str], layout: str) -> StampLayouts:
    """Return the pinned layout if it matches the cells, otherwise the detected ones."""
    pinned = find_layout(cells, layout) if layout else StampLayouts(())
    return pinned if pinned.layouts else find_layout(cells)


def _first_words(data: Sequence[SplitLine], column: int) -> SampleCell:
    """Return the first cell of a column that is neither a number nor missing."""
    cells = [SampleCell(row.cells[column], row.number) for row in data if row.cells[column] not in MISSING]
    return next((cell for cell in cells if kind(cell.text) in "TX"), cells[0])


def _marks(sample: Sample, pins: TablePins) -> Marks:
    if pins.decimal and pins.thousands is not None:
        return Marks(pins.decimal, pins.thousands)
    # Lines without any of these marks have decimal points or whole numbers: a limited number of them is sufficient.
    comma = "" if sample.separator == "," else ","
    mark = re.compile(rf"[{comma}\"'\u00a0\u202f]|[0-9] [0-9]{{3}}|\.[0-9]{{3}}\.")
    rows = [row for i, row in enumerate(sample.data) if i < _LOOKED or mark.search(row.text)]
    cells = [
        (cell, row.number)
        for row in rows
        for i, cell in enumerate(row.cells)
        if sample.kinds[i] == "N" and cell and (cell[0].isdigit() or cell[0] in "+-.,\u2212")
    ]
    return find_marks(cells, sample.separator, pins.decimal, pins.thousands)


def _trailing(sample: Sample) -> bool:
    """Return whether each row ends with a separator: the last cell of every row is empty and has no name."""
    if sample.width < 2 or sample.kinds[-1] != "M" or any(row.cells[-1] for row in sample.data):
        return False
    return sample.head.header is None or not sample.head.header[-1]


def _findings(text: Text, sample: Sample) -> Iterator[Finding]:
    head = sample.head
    if sample.skipped:
        yield Finding("pinned_lines_skipped", "", lines_of(sample.skipped))
    if encoding := _SHOWN_ENCODINGS.get(text.encoding):
        yield Finding("other_encoding", "", {"encoding": encoding})
    if line := sample.named:
        yield Finding("named_separator", "", {"line": line.number, "text": line.text.strip()[:12]})
    if head.numbers:
        yield Finding("numbers_above_rows", "", lines_of(head.numbers))
    if words := [number for number in head.preamble if number not in head.numbers]:
        yield Finding("words_above_rows", "", lines_of(words))
    if head.from_comment:
        yield Finding("names_from_comment", "", {"line": head.header_line})


def _unique(cells: Sequence[str]) -> list[str]:
    # A repeated name is ambiguous: the column's number is appended, and the column is requested by that number.
    counts = Counter(cells)
    return [str(i) if not cell else f"{cell}#{i}" if counts[cell] > 1 else cell for i, cell in enumerate(cells)]
