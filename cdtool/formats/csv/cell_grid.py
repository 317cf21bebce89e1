"""A sample of a text table cut into cells: which of its lines are names and rows, where they part, where rows begin."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cdtool.channels import TablePins
from cdtool.errors import RecordingError
from cdtool.formats.csv.cells import split_line
from cdtool.formats.csv.head import Head, HeadFinder
from cdtool.formats.csv.head_words import column_kinds
from cdtool.formats.csv.lines import Line, comment_mark, is_ruler, sample_lines
from cdtool.formats.csv.separator import find_separator
from cdtool.formats.csv.text import Text

_LOOKED = 200


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
