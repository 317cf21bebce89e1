"""Shorten the sample of a table to the lines that determine its dialect.

Most tables have a head, and then rows of one shape: a number or nothing in each cell, and one separator. The head and
some rows determine the dialect: the first rows, the first row with each kind of decimal mark (1.5, 1,5, 1.234), and
one row with a number for each column that also has empty cells. Any other sample is not shortened.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from cdtool.channels import TablePins
from cdtool.formats.csv.alike_rows_kernel import (
    COMMA,
    COMMA_OR_THOUSANDS,
    FIRST_BYTE,
    FIRST_LINE,
    FIRST_ROW,
    LAST_BYTE,
    NUMBERS,
    POINT,
    POINT_OR_THOUSANDS,
    ROW_BYTE,
    ROWS,
    WIDTH,
    find_alike_rows,
)
from cdtool.formats.csv.dialect import Dialect
from cdtool.formats.csv.row_kernel import Integers
from cdtool.formats.csv.text import AFTER, SAMPLE_BYTES, Text

# Samples with fewer rows, or with more lines above the rows, are not shortened.
_FEWEST_ROWS, _MOST_ABOVE = 100, 40
_MOST_COLUMNS = 512
# The shortened sample has at least this many rows, and twice as many as lines above: its lower two thirds, from which
# the separator is found, then contain rows only, as in the whole sample.
_FIRST_ROWS = 12
# As in find_dialect: decimal points are searched for in the first rows only, commas in all rows.
_SEARCHED_ROWS = 200
# As in find_dialect: the kind of a column is determined from about this many rows, evenly spread.
_SPREAD_ROWS = 400


@dataclass(frozen=True)
class ShorterSample:
    """A `stream` with fewer rows but the same dialect.

    The whole sample has `rows` alike rows from line `first` (from 1); `left_out` of them are not in `stream`. `above`
    are the bytes of the lines above them. Samples with equal `above` and equal `shape` have the same dialect.
    """

    stream: bytes
    first: int
    rows: int
    left_out: int
    above: bytes
    shape: tuple[object, ...]
    separator: str
    width: int
    has_empty_cells: bool

    def whole(self, dialect: Dialect) -> Dialect | None:
        """Return the dialect of the whole sample, given that of `stream`; None if the two may differ."""
        if (dialect.separator, dialect.width) != (self.separator, self.width) or dialect.first_line > self.first:
            return None
        if self.has_empty_cells and dialect.first_line < self.first:
            return None
        if dialect.marks.doubt is not None or (dialect.header is None and dialect.separator == ","):
            return None
        return replace(dialect, sampled=dialect.sampled + self.left_out)


def shorter_sample(text: Text, stream: bytes, pins: TablePins) -> ShorterSample | None:
    """Return the shortened sample; None if its rows are not alike or are few."""
    pinned_line = max(pins.skip_lines, int(pins.header or 0), int(pins.units or 0))
    if text.recoded or text.line_end != b"\n" or pinned_line > _MOST_ABOVE or _begins_rows(pins.comment or ""):
        return None
    end = stream.rfind(b"\n") + 1 if text.size > SAMPLE_BYTES or stream.endswith(b"\n") else len(stream)
    separator = _separator(stream, end)
    if separator is None:
        return None
    found, marks = np.zeros(4, dtype=np.int64), np.full((4, 2), -1, dtype=np.int64)
    columns = np.zeros((_MOST_COLUMNS, 5), dtype=np.int64)
    starts = np.zeros(2 * _MOST_ABOVE + _FIRST_ROWS + 1, dtype=np.int64)
    data = np.frombuffer(b"".join((memoryview(stream)[:end], b"\n" * AFTER)), dtype=np.uint8)
    stop = end if stream[end - 1 : end] == b"\n" else end + 1
    alike = find_alike_rows(data, stop, separator[0], _MOST_ABOVE, len(starts), found, marks, columns, starts)
    rows, width, first, begin = found[[ROWS, WIDTH, FIRST_LINE, FIRST_BYTE]].tolist()
    if not alike or rows < _FEWEST_ROWS or width < 2:
        return None
    columns = columns[:width]
    kinds = _kinds(columns, rows)
    seen = _searched_marks(marks)
    if kinds is None or seen is None:
        return None
    count = _FIRST_ROWS + 2 * first
    more = {int(marks[mark, ROW_BYTE]) for mark in seen if marks[mark, FIRST_ROW] >= count}
    more |= {int(each[LAST_BYTE]) for each in columns if 0 < each[NUMBERS] < rows} - set(starts[:count].tolist())
    lines = [stream[at : stream.find(b"\n", at, end) + 1 or end] for at in sorted(more)]
    return ShorterSample(
        stream=stream[: int(starts[count])] + b"".join(lines),
        first=first + 1,
        rows=rows,
        left_out=rows - count - len(lines),
        above=stream[:begin],
        shape=(separator, kinds, tuple(seen)),
        separator=separator.decode(),
        width=width,
        has_empty_cells=bool((columns[:, NUMBERS] < rows).any()),
    )


def _begins_rows(comment: str) -> bool:
    """Return whether rows of numbers may start with a pinned comment mark."""
    return bool(comment) and comment[0] in "+-.,;|\t nN0123456789"


def _separator(stream: bytes, end: int) -> bytes | None:
    """Return the separator in a line in the middle of the sample; None if the line has no separator or several."""
    middle = stream.rfind(b"\n", 0, end // 2) + 1
    line = stream[middle : stream.find(b"\n", middle, end)]
    strong = [letter for letter in (b"\t", b";", b"|") if letter in line]
    if len(strong) > 1:
        return None
    return strong[0] if strong else b"," if b"," in line else None


def _kinds(columns: Integers, rows: int) -> str | None:
    """Return one letter per column: N numbers, M nothing; None if the spread rows may miss the numbers of a column."""
    apart = rows // _SPREAD_ROWS + 2  # the largest distance between two of the spread rows
    letters = []
    for count, _, longest, last, _ in columns.tolist():
        if 0 < count < rows and (longest < apart or last - longest < (rows + _MOST_ABOVE) / 3):
            return None
        letters.append("N" if count else "M")
    return "".join(letters)


def _searched_marks(marks: Integers) -> list[int] | None:
    """Return the kinds of decimal marks in the searched rows; None if these depend on the lines above."""
    first = marks[:, FIRST_ROW]
    points, commas = first[[POINT, POINT_OR_THOUSANDS]], first[[COMMA, COMMA_OR_THOUSANDS]]
    if points.max() >= 0 and commas.max() >= 0:
        return None
    if ((points >= _SEARCHED_ROWS - _MOST_ABOVE) & (points < _SEARCHED_ROWS)).any():
        return None
    kinds = (POINT, COMMA, POINT_OR_THOUSANDS, COMMA_OR_THOUSANDS)
    return [kind for kind in kinds if first[kind] >= 0 and (first[kind] < _SEARCHED_ROWS or commas.max() >= 0)]
