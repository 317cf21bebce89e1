"""Find how a text table is written: from its first lines by evidence, or pinned by `[csv]` of the machine file.

A sample is cut into cells: which of its lines are names and rows, where they part, where rows begin.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from cdtool.channels import TablePins
from cdtool.errors import RecordingError
from cdtool.findings import Finding
from cdtool.findings.tables import (
    DoubtfulPoint,
    FooterSkipped,
    NamedSeparator,
    NamesFromComment,
    NumbersAboveRows,
    OtherEncoding,
    PinnedLinesSkipped,
    WordsAboveRows,
)
from cdtool.formats.csv.ambiguous_marks import (
    refuse_commas_that_may_be_decimal,
    refuse_one_column_of_decimals,
    settled_marks,
)
from cdtool.formats.csv.blank_lines import are_missing, without_blank_end
from cdtool.formats.csv.cells import MISSING, SEPARATORS, kind, split_line
from cdtool.formats.csv.dialect import Dialect
from cdtool.formats.csv.encoding import find_text
from cdtool.formats.csv.head import Head, HeadFinder, refuse_table_above
from cdtool.formats.csv.head_words import column_kinds
from cdtool.formats.csv.lines import Line, comment_mark, is_ruler, refuse_long_line, sample_lines
from cdtool.formats.csv.marks import Marks, Seen, find_marks
from cdtool.formats.csv.row_kernel import count_lines
from cdtool.formats.csv.stamps import Stamped, find_layout
from cdtool.formats.csv.text import SAMPLE_BYTES, TAIL_BYTES, Text

_SCORED = 150
# A separator that stands in this share of the lines, as often in each, is one whatever else the cells hold.
_CONSISTENT = 0.9
_STRONG = "\t;|"
_SHOWN_ENCODINGS = {"cp1252": "Windows-1252", "latin-1": "Latin-1"}
_LOOKED = 200
_MOST = 12
_LABEL = re.compile(r"[^\W\d_].*|\u2211.*")  # a letter first, or the sign of a sum
_NO_VALUES = ("na", "n/a", "null", "none", "nil", "missing", "err", "error", "invalid", "ovl", "ol", "overflow")


@dataclass(frozen=True)
class Split:
    """What a separator makes of the lines: cells a line, the share of lines so wide, the share of numbers in them."""

    separator: str
    width: int
    consistent: float
    numeric: float


def find_separator(path: Path, lines: Sequence[Line], pinned: str = "", decimal: str = "") -> Split:
    """Return the separator that cuts the lines into equally many cells, most of them numbers.

    Raises RecordingError where a pinned one cuts none of them. Beside a pinned decimal comma it may cut none: the table
    has one column.
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
                f"{path}: line {body[0].number} has one cell by the separator {pinned!r}: {body[0].text[:40]!r}",
                "correct or remove separator in [csv], or the line sep= of the file",
            )
        return split
    splits = [_split(scored, separator) for separator in SEPARATORS]
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


def _split(texts: Sequence[str], separator: str) -> Split:
    rows = [split_line(text, separator) for text in texts]
    if separator == " ":
        rows = [_no_blank_separator(text, row) for text, row in zip(texts, rows, strict=True)]
    widths = Counter(map(len, rows))
    width, count = widths.most_common(1)[0]
    if width < 2 and len(widths) > 1:  # a preamble of single words does not decide
        wider, seen = next(item for item in widths.most_common(2) if item[0] > 1)
        if 2 * seen >= count:
            width, count = wider, seen
    if width < 2:
        return Split(separator, 1, 1.0, 0.0)
    shares = [sum(_is_number(cell, separator) for cell in row) / len(row) for row in rows if len(row) == width]
    missing = [sum(kind(cell) == "M" for cell in row) / len(row) for row in rows if len(row) == width]
    numeric = sum(share / max(1.0 - lost, 1.0 / width) for share, lost in zip(shares, missing, strict=True))
    return Split(separator, width, count / len(rows), numeric / len(shares))


def _no_blank_separator(text: str, row: list[str]) -> list[str]:
    """Blanks beside another separator are only blanks: `0, 1.5` is cut by its comma."""
    if any(cell[-1:] in ",;|" or cell[:1] in ",;|" for cell in row) or "\t" in text.strip():
        return [text]
    return row


def _is_number(cell: str, separator: str) -> bool:
    # `1,500 200,5` is no row of `500 200` between commas, though that may be written so between semicolons.
    found = kind(cell)
    return found == "T" or (found == "N" and not (separator == "," and " " in cell))


@dataclass(frozen=True)
class SampleLines:
    """The lines of a sample by what they are: `table` has names and rows, `mark` begins the `comments`.

    `separator` is a line that only names the separator (sep=;), `skipped` are the numbers of those that the machine
    file says to skip.
    """

    every: Sequence[Line]
    table: Sequence[Line]
    comments: Sequence[Line]
    mark: str
    separator: Line | None
    skipped: Sequence[int]


def sort_lines(path: Path, text: Text, stream: bytes, pins: TablePins) -> SampleLines:
    """Sort the lines of the sample; raises RecordingError where none is left for a table."""
    every = sample_lines(text, stream)
    filled = [line for line in every if not line.blank]
    lines = [line for line in filled if line.number > pins.skip_lines]
    separator = next((line for line in lines if line.separator), None)
    lines = [line for line in lines if line is not separator]
    mark = comment_mark(lines, pins.comment)
    table = [line for line in lines if not line.is_comment(mark)]
    if not table:
        raise RecordingError(f"{path}: holds no row of numbers", "a header line and rows of numbers are needed")
    comments = [line for line in lines if line.is_comment(mark)]
    return SampleLines(
        every, table, comments, mark, separator, [line.number for line in filled if line.number <= pins.skip_lines]
    )


@dataclass(frozen=True)
class CellGrid:
    """The sample's lines cut into cells: `rows` are all of them, `data` those below the `head`, `width` cells wide."""

    separator: str
    width: int
    rows: Sequence[tuple[Line, list[str]]]
    data: Sequence[tuple[Line, list[str]]]
    head: Head
    kinds: str

    @property
    def not_numbers(self) -> list[int]:
        """The columns of stamps and words."""
        return [i for i, letter in enumerate(self.kinds) if letter in "TX"]


def cut_rows(path: Path, lines: SampleLines, pins: TablePins) -> CellGrid:
    """Find separator, width and head; raises RecordingError where there is no table, or one of two readings."""
    named = lines.separator.separator or "" if lines.separator else ""
    straight = [line for line in lines.table if not is_ruler(line.text)] or lines.table
    cut = find_separator(path, straight, pins.separator or named, pins.decimal)
    rows = [(line, split_line(line.text, cut.separator)) for line in lines.table]
    wide = [(line, cells) for line, cells in rows if len(cells) == cut.width]
    lower = wide[len(wide) // 3 :] if len(wide) >= 6 else wide[1:] or wide
    kinds = column_kinds([cells for _, cells in _spread(lower)], cut.width)
    head = HeadFinder(path, cut.separator, cut.width, kinds, pins).find(lines.table, lines.comments)
    data = [(line, cells) for line, cells in wide if line.number >= head.first.number]
    kinds = column_kinds([cells for _, cells in _spread(data)], cut.width)
    return CellGrid(cut.separator, cut.width, rows, data, head, kinds)


def _spread(rows: Sequence[Any]) -> Sequence[Any]:
    """At most some hundred rows, over all of the sample."""
    return rows[:: max(1, len(rows) // (2 * _LOOKED))]


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


@dataclass(frozen=True)
class Footer:
    """`lines` are counted from 0 at the first of them; `shown` is that one, `cut` all of the stream from there on."""

    lines: tuple[int, ...]
    shown: str
    cut: bytes

    def finding(self, first_line: int) -> Finding:
        """What is said of a footer that begins in that line of the file."""
        return Finding(FooterSkipped(tuple(first_line + line for line in self.lines), self.shown))

    def without(self, text: Text, stream: bytes) -> tuple[Text, bytes]:
        """The text, and the sample of its stream, up to the footer."""
        size = len(self.cut.decode().encode(text.encoding) if text.recoded else self.cut)
        return replace(text, size=text.size - size), stream.removesuffix(self.cut)


def find_footer(dialect: Dialect) -> Footer | None:
    """Return the footer of a table whose first column holds numbers or times; None where it has no footer.

    Its lines are no samples though they are as wide: `Sum;7.5`, `Mean;0.3`, `End of file;`. Such a line begins with a
    word where every row begins with a number or a time. A word that comes among the rows too, or again and again, or
    that marks a missing value, does not begin a footer: the column holds words, or a row is damaged.
    """
    if dialect.kinds[0] not in "NT" or dialect.text.padding:  # where the power was lost nobody wrote a sum
        return None
    raw = _last_lines(dialect)
    words: list[tuple[int, list[str]]] = []
    for i in range(len(raw) - 1, -1, -1):  # mostly the last line is a row, and the others are not looked at
        cells = _cells(dialect, raw[i])
        if cells and not _is_words(dialect, cells):
            break
        if cells:
            words.insert(0, (i, cells))
    labels = [cells[0].lower() for _, cells in words if len(cells) == dialect.width]
    if not 0 < len(labels) == len(set(labels)) <= _MOST or not set(labels).isdisjoint(_no_values(dialect)):
        return None
    first = words[0][0]
    above = [cells for line in raw[:first] if len(cells := _cells(dialect, line)) == dialect.width]
    if not above or any(kind(cells[0]) == "X" for cells in above):
        return None
    shown = dialect.text.decode(raw[first]).strip()
    return Footer(tuple(i - first for i, _ in words), shown, dialect.text.line_end.join(raw[first:]))


def _cells(dialect: Dialect, line: bytes) -> list[str]:
    """A line's cells; none of a line that is blank, drawn, a comment or the header again."""
    text = dialect.text.decode(line).strip()
    if not text or is_ruler(text) or (dialect.comment and text.startswith(dialect.comment)):
        return []
    if text in {told.strip() for told in dialect.header_text}:
        return []
    return split_line(text, dialect.separator)


def _is_words(dialect: Dialect, cells: list[str]) -> bool:
    """True for a line that begins with a label, and is as wide as the rows or words only."""
    return len(cells) in (1, dialect.width) and _LABEL.fullmatch(cells[0]) is not None and kind(cells[0]) == "X"


def _no_values(dialect: Dialect) -> set[str]:
    return {*_NO_VALUES, *(text.lower() for text in dialect.missing)}


def _last_lines(dialect: Dialect) -> list[bytes]:
    """The last whole lines of the rows, as the stream has them."""
    text = dialect.text
    most = SAMPLE_BYTES if text.recoded else TAIL_BYTES
    start = text.mark if text.recoded else text.mark + dialect.offset
    whole = text.size - start <= most
    with text.path.open("rb") as file:
        file.seek(start if whole else text.size - most)
        end = file.read(text.size - start if whole else most)
    if text.recoded:
        end = end.decode(text.encoding, errors="replace").encode()
        end = end[dialect.offset :] if whole else end
    return end.split(text.line_end)[not whole :]
