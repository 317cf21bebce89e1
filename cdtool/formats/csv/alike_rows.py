"""A sample without the rows that add nothing to what the rows before them show about the dialect.

Nearly all tables are a head and then rows of one shape: plain numbers or empty cells, one separator. The dialect of
such a table follows from its head and some of the rows: the first ones, those in which a mark (1.5, 1,5, 1.234) is
first seen, and one with a number for each column that has empty cells. Every other sample is left as it is.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from cdtool.channels import TablePins
from cdtool.formats.csv.alike_rows_kernel import (
    FIRST_BYTE,
    FIRST_LINE,
    FIRST_ROW,
    LAST_BYTE,
    NUMBERS,
    ROW_BYTE,
    ROWS,
    WIDTH,
    find_alike_rows,
)
from cdtool.formats.csv.dialect import Dialect
from cdtool.formats.csv.row_kernel import Integers
from cdtool.formats.csv.text import SAMPLE_BYTES, Text

# Fewer rows are soon looked at one by one, and of more lines above them the head is no plain one.
_FEWEST_ROWS, _MOST_ABOVE = 100, 40
_MOST_COLUMNS = 512
# Of the rows at least so many are shown, and twice as many as there are lines above: the lower two thirds of the sample
# are then rows, as in the whole one.
_SHOWN_ROWS = 12
# Decimal points are looked for in the first rows of a sample only, commas in all of them.
_MARKS_LOOKED = 200
# Cells are looked at in every n-th row, at most about so many rows.
_KINDS_LOOKED = 400


@dataclass(frozen=True)
class ShorterSample:
    """A `stream` of fewer rows that shows the same dialect.

    Of the whole sample the `rows` from line `first` (from 1) on are alike; `left_out` of them are not in `stream`.
    `above` are the bytes of the lines above them, `shape` is all that these rows show: samples with the same lines
    above and the same shape have the same dialect.
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
        """Return the dialect of the whole sample by that of the shorter one; None where that may be another one."""
        if (dialect.separator, dialect.width) != (self.separator, self.width) or dialect.first_line > self.first:
            return None
        if self.has_empty_cells and dialect.first_line < self.first:
            return None
        if dialect.marks.doubt is not None or (dialect.header is None and dialect.separator == ","):
            return None
        return replace(dialect, sampled=dialect.sampled + self.left_out)


def shorter_sample(text: Text, stream: bytes, pins: TablePins) -> ShorterSample | None:
    """Return the sample without the rows that add nothing; None where its rows are not alike, or are few."""
    pinned_line = max(pins.skip_lines, int(pins.header or 0), int(pins.units or 0))
    if text.recoded or text.line_end != b"\n" or pinned_line > _MOST_ABOVE or _begins_rows(pins.comment or ""):
        return None
    end = stream.rfind(b"\n") + 1 if text.size > SAMPLE_BYTES or stream.endswith(b"\n") else len(stream)
    separator = _separator(stream, end)
    if separator is None:
        return None
    found, marks = np.zeros(4, dtype=np.int64), np.full((4, 2), -1, dtype=np.int64)
    columns = np.zeros((_MOST_COLUMNS, 5), dtype=np.int64)
    starts = np.zeros(2 * _MOST_ABOVE + _SHOWN_ROWS + 1, dtype=np.int64)
    data = np.frombuffer(stream[:end] + b"\n\n\n\n", dtype=np.uint8)
    stop = end if stream[end - 1 : end] == b"\n" else end + 1
    alike = find_alike_rows(data, stop, separator[0], _MOST_ABOVE, len(starts), found, marks, columns, starts)
    rows, width, first, begin = found[[ROWS, WIDTH, FIRST_LINE, FIRST_BYTE]].tolist()
    if not alike or rows < _FEWEST_ROWS or width < 2:
        return None
    columns = columns[:width]
    kinds = _kinds(columns, rows)
    seen = _marks_looked_at(marks)
    if kinds is None or seen is None:
        return None
    shown = _SHOWN_ROWS + 2 * first
    more = {int(marks[mark, ROW_BYTE]) for mark in seen if marks[mark, FIRST_ROW] >= shown}
    more |= {int(each[LAST_BYTE]) for each in columns if 0 < each[NUMBERS] < rows} - set(starts[:shown].tolist())
    lines = [stream[at : stream.find(b"\n", at, end) + 1 or end] for at in sorted(more)]
    return ShorterSample(
        stream=stream[: int(starts[shown])] + b"".join(lines),
        first=first + 1,
        rows=rows,
        left_out=rows - shown - len(lines),
        above=stream[:begin],
        shape=(separator, kinds, tuple(seen)),
        separator=separator.decode(),
        width=width,
        has_empty_cells=bool((columns[:, NUMBERS] < rows).any()),
    )


def _begins_rows(comment: str) -> bool:
    """Whether a pinned comment mark may begin a row of numbers."""
    return bool(comment) and comment[0] in "+-.,;|\t nN0123456789"


def _separator(stream: bytes, end: int) -> bytes | None:
    """The separator of a line in the middle of the sample; None where it is not clear."""
    middle = stream.rfind(b"\n", 0, end // 2) + 1
    line = stream[middle : stream.find(b"\n", middle, end)]
    strong = [letter for letter in (b"\t", b";", b"|") if letter in line]
    if len(strong) > 1:
        return None
    return strong[0] if strong else b"," if b"," in line else None


def _kinds(columns: Integers, rows: int) -> str | None:
    """One letter a column, N numbers or M nothing; None where the rows that are looked at may miss its numbers."""
    apart = rows // _KINDS_LOOKED + 2  # at most so many rows from one that is looked at to the next
    letters = []
    for count, _, longest, last, _ in columns.tolist():
        if 0 < count < rows and (longest < apart or last - longest < (rows + _MOST_ABOVE) / 3):
            return None
        letters.append("N" if count else "M")
    return "".join(letters)


def _marks_looked_at(marks: Integers) -> list[int] | None:
    """The kinds of marks in the rows that are looked through for them; None where that depends on the lines above."""
    first = marks[:, FIRST_ROW].tolist()
    points, commas = (first[0], first[2]), (first[1], first[3])
    if max(points) >= 0 and max(commas) >= 0:
        return None
    if any(_MARKS_LOOKED - _MOST_ABOVE <= row < _MARKS_LOOKED for row in points):
        return None
    return [kind for kind, row in enumerate(first) if row >= 0 and (row < _MARKS_LOOKED or kind in (1, 3))]
