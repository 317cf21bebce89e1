"""Shorten the sample of a table to the lines that determine its dialect.

Most tables have a head, and then rows of one shape: a number or nothing in each cell, one separator, one decimal mark.
The head and some rows determine their dialect: the first rows, and one row with a number for each column that also has
empty cells. Any other sample is not shortened.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from cdtool.channels import TablePins
from cdtool.formats.csv.dialect import Dialect
from cdtool.formats.csv.text import SAMPLE_BYTES, Text

# Samples with fewer rows, or with more lines above the rows, are not shortened.
_FEWEST_ROWS, _MOST_ABOVE = 100, 40
# The shortened sample has at least this many rows, and twice as many as lines above: its lower two thirds, from which
# the separator is found, then contain rows only, as in the whole sample.
_FIRST_ROWS = 6
# A column of numbers has them in at least this share of the rows.
_FILLED = 0.5
# The bytes of numbers; a sign is at the start of a number or of its exponent.
_PLAIN = b"0123456789.+-eEnaNA\r\n"
# A number whose mark cannot separate thousands.
_DECIMAL = re.compile(rb"[+-]?(?:0[.,][0-9]+|[0-9]+[.,](?:[0-9]{1,2}|[0-9]{4,})|[0-9]{4,}[.,][0-9]+)(?![0-9.,])")


@dataclass(frozen=True)
class ShorterSample:
    """A `stream` with fewer rows but the same dialect: `left_out` of the rows, which start in line `first` (from 1)."""

    stream: bytes
    first: int
    left_out: int
    separator: str
    width: int
    has_empty_cells: bool

    def whole(self, dialect: Dialect) -> Dialect | None:
        """Return the dialect of the whole sample, given that of `stream`; None if the two may differ."""
        if (dialect.separator, dialect.width) != (self.separator, self.width) or dialect.first_line > self.first:
            return None
        if not {*dialect.kinds} <= {*"NM"} or (self.has_empty_cells and dialect.first_line < self.first):
            return None
        if dialect.marks.doubt is not None or (dialect.header is None and dialect.separator == ","):
            return None
        return replace(dialect, sampled=dialect.sampled + self.left_out)


def shorter_sample(text: Text, stream: bytes, pins: TablePins) -> ShorterSample | None:
    """Return the shortened sample; None if its rows are not alike or are few."""
    pinned_line = max(pins.skip_lines, int(pins.header or 0), int(pins.units or 0))
    if text.line_end != b"\n" or pinned_line > _MOST_ABOVE or _begins_rows(pins.comment or ""):
        return None
    if text.size > SAMPLE_BYTES or stream.endswith(b"\n"):
        stream = stream[: stream.rfind(b"\n") + 1]
    else:
        stream += b"\n"
    separator = _separator(stream)
    if separator is None:
        return None
    data = np.frombuffer(stream, dtype=np.uint8)
    begin, cells = _alike(stream, data, separator)
    above = stream.count(b"\n", 0, begin)
    count = _FIRST_ROWS + 2 * above
    if len(cells) < max(_FEWEST_ROWS, count) or above > _MOST_ABOVE:
        return None
    lengths = np.diff(cells.ravel(), prepend=begin - 1).reshape(cells.shape) - 1
    lengths[:, -1] -= data[cells[:, -1] - 1] == ord("\r")
    filled = lengths > 0
    share = filled.mean(axis=0)
    ends = cells[:, -1] + 1
    if ((share > 0.0) & (share < _FILLED)).any():
        return None
    if not _is_clear(stream[begin : ends[count - 1]], stream[begin:], separator):
        return None
    last = {len(cells) - 1 - int(np.argmax(filled[::-1, column])) for column in np.flatnonzero(share < 1.0)}
    more = sorted(row for row in last if row >= count)
    return ShorterSample(
        stream=stream[: ends[count - 1]] + b"".join(stream[ends[row - 1] : ends[row]] for row in more),
        first=above + 1,
        left_out=len(cells) - count - len(more),
        separator=separator.decode(),
        width=cells.shape[1],
        has_empty_cells=not filled.all(),
    )


def _begins_rows(comment: str) -> bool:
    """Return whether rows of numbers may start with a pinned comment mark."""
    return bool(comment) and comment[0] in "+-.,;|\t nN0123456789"


def _separator(stream: bytes) -> bytes | None:
    """Return the separator in a line in the middle; None if the line has no separator, or several."""
    middle = stream.rfind(b"\n", 0, len(stream) // 2) + 1
    line = stream[middle : stream.find(b"\n", middle)]
    strong = [letter for letter in (b"\t", b";", b"|") if letter in line]
    if len(strong) > 1:
        return None
    return strong[0] if strong else b"," if b"," in line else None


def _alike(stream: bytes, data: npt.NDArray[np.uint8], separator: bytes) -> tuple[int, npt.NDArray[np.intp]]:
    """Return the first byte of the last lines that have only numbers, in equally many cells, and the cells' ends."""
    others = {*stream.translate(None, _PLAIN + separator + b",")}
    begin = stream.find(b"\n", max(map(stream.rfind, others), default=-1)) + 1 if others else 0
    before_sign = data[np.flatnonzero(data[begin:] == ord("-")) + begin - 1]  # before the first byte is the line end
    if bytes(before_sign).translate(None, b"\neE" + separator):
        begin = len(stream)
    places = np.flatnonzero((data[begin:] == ord(separator)) | (data[begin:] == ord("\n"))) + begin
    ends = np.flatnonzero(data[places] == ord("\n"))
    widths = np.diff(ends, prepend=-1)
    odd = np.flatnonzero(widths != widths[-1:])[-1:]
    if len(odd):
        begin, places = int(places[ends[odd[0]]]) + 1, places[ends[odd[0]] + 1 :]
    return begin, places.reshape(-1, widths[-1] if len(widths) else 1)


def _is_clear(first: bytes, rows: bytes, separator: bytes) -> bool:
    """Return whether the rows have one decimal mark or none, and the first of them show that it is one."""
    marks = [mark for mark in (b".", b",") if mark in rows and mark != separator]
    return not marks or (len(marks) == 1 and any(map(_DECIMAL.match, first.replace(separator, b"\n").split())))
