"""A sample of a text table cut into cells: which of its lines are names and rows, where they part, where rows begin."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cdtool.channels import TablePins
from cdtool.errors import RecordingError
from cdtool.formats.csv.cells import SEPARATORS, kind, split_line
from cdtool.formats.csv.head import Head, HeadFinder
from cdtool.formats.csv.head_words import column_kinds
from cdtool.formats.csv.lines import Line, comment_mark, is_ruler, sample_lines
from cdtool.formats.csv.text import Text

_SCORED = 150
# A separator that stands in this share of the lines, as often in each, is one whatever else the cells hold.
_CONSISTENT = 0.9
_STRONG = "\t;|"
_LOOKED = 200


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
