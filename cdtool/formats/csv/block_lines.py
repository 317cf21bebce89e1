"""Find the lines of a block that are rows with all their cells, by the places of separators, quotes and line ends."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cdtool.formats.csv.dialect import Dialect
from cdtool.formats.csv.stamps import Integers
from cdtool.recording import BoolArray

Bytes = npt.NDArray[np.uint8]
_LF, _CR, _QUOTE, _BLANK, _TAB = b'\n\r" \t'
_SWAP_ENDS = bytes.maketrans(b"\n\r", b"\r\n")


@dataclass(frozen=True)
class BlockLines:
    """The lines of a block: line `i` is `content[starts[i] : starts[i + 1]]`, with its line feed.

    `regular` lines have all their cells, and `blank` lines nothing; other lines are comments, damaged, or of another
    width. `widest` is the largest number of cells of a regular line.
    """

    content: bytes
    starts: Integers
    regular: BoolArray
    blank: BoolArray
    widest: int

    @classmethod
    def of(cls, block: bytes, dialect: Dialect) -> BlockLines:
        """Return the lines of a block; its last line may be without a line end."""
        content = block if block.endswith(dialect.text.line_end) else block + dialect.text.line_end
        unfinished = not block.endswith((b"\n", b"\r"))
        if dialect.text.line_end == b"\r":
            content = content.translate(_SWAP_ENDS)
        data = np.frombuffer(content, dtype=np.uint8)
        if b'"' in content or dialect.separator == " ":
            starts, cells, regular = _count_carefully(data, dialect.separator)
        else:
            starts, cells = _count(data, ord(dialect.separator))
            regular = np.ones(len(cells), dtype=bool)
        usual = cells == dialect.width
        if dialect.short_rows:
            early = cells == dialect.short_width if dialect.short_width else (cells > 1) & (cells < dialect.width)
            early[-1] &= not unfinished  # it may be cut off
            usual |= early
        regular &= usual
        if b"\r" in content and content.count(b"\r") != content.count(b"\r\n"):
            returns = np.flatnonzero(data == _CR)
            _clear(regular, starts, returns[data[returns + 1] != _LF])
        if b"\0" in content:
            _clear(regular, starts, np.flatnonzero(data == 0))
        blank = _blank_lines(data, starts, dialect.separator)
        regular &= ~blank
        if dialect.trailing and dialect.width > 1:
            _clear_filled_ends(regular, data, starts, dialect.separator)
        if dialect.comment:
            _clear_comments(regular, content, starts, dialect)
        return cls(content, starts, regular, blank, int(cells[regular].max(initial=0)))

    def line(self, number: int) -> bytes:
        """Return a line without its line feed."""
        return self.content[self.starts[number] : self.starts[number + 1] - 1]

    def joined(self, chosen: BoolArray) -> bytes:
        """Return the chosen lines."""
        if chosen.all():
            return self.content
        data = np.frombuffer(self.content, dtype=np.uint8)
        return data[np.repeat(chosen, np.diff(self.starts))].tobytes()


def _count(data: Bytes, separator: int) -> tuple[Integers, Integers]:
    """Return where lines start, with the end of the last one, and how many cells each has."""
    is_end = data == separator
    is_end |= data == _LF
    places = np.flatnonzero(is_end)
    ends = np.flatnonzero(data[places] == _LF)
    return np.concatenate(([0], places[ends] + 1)), np.diff(ends, prepend=-1)


def _count_carefully(data: Bytes, separator: str) -> tuple[Integers, Integers, BoolArray]:
    """Return `_count` for lines with quotes or blanks between cells, and whether their quotes can be understood.

    A quote that is understood is at a border of a cell, or one of two in a row.
    """
    starts = np.concatenate(([0], np.flatnonzero(data == _LF) + 1))
    lengths = np.diff(starts)
    quotes = np.cumsum(data == _QUOTE)
    before = np.concatenate(([0], quotes[starts[1:] - 1]))
    inside = (quotes - np.repeat(before[:-1], lengths)) % 2 == 1
    is_mark = (data == _BLANK) | (data == _TAB) if separator == " " else data == ord(separator)
    is_border = (is_mark & ~inside) | (data == _LF) | (data == _CR)
    begins = np.concatenate(([True], is_border[:-1])) & ~is_border
    counted = begins if separator == " " else is_mark & ~inside
    cells = np.add.reduceat(counted, starts[:-1], dtype=np.int64) + (separator != " ")
    understood = np.diff(before) % 2 == 0
    at = np.flatnonzero(data == _QUOTE)
    opens = inside[at]
    first = np.where((data[at - 1] == _BLANK) & (at > 0), at - 1, at)  # one blank may be before the opening quote
    border = is_border | (data == _QUOTE)
    fits = np.where(opens, (first == 0) | border[first - 1], border[np.minimum(at + 1, len(data) - 1)])
    _clear(understood, starts, at[~fits])
    return starts, cells, understood


def _clear(regular: BoolArray, starts: Integers, places: Integers) -> None:
    """Mark the lines that contain these bytes as not regular."""
    regular[np.searchsorted(starts, places, side="right") - 1] = False


def _blank_lines(data: Bytes, starts: Integers, separator: str) -> BoolArray:
    """Return which lines have only blanks, and tabs unless these separate cells."""
    nothing = (_LF, _CR, _BLANK) if separator == "\t" else (_LF, _CR, _BLANK, _TAB)
    empty = np.zeros(256, dtype=bool)
    empty[[*nothing]] = True
    possible = empty[data[starts[:-1]]]
    if possible.any():
        possible &= ~np.logical_or.reduceat(~empty[data], starts[:-1])
    return possible


def _clear_filled_ends(regular: BoolArray, data: Bytes, starts: Integers, separator: str) -> None:
    """Mark lines as not regular that do not end with a separator, though the others do."""
    ends = starts[1:] - 1
    last = ends - 1 - (data[ends - 1] == _CR)
    regular &= data[last] == ord(separator)


def _clear_comments(regular: BoolArray, content: bytes, starts: Integers, dialect: Dialect) -> None:
    """Mark lines as not regular that start with the comment mark, perhaps after blanks."""
    mark = dialect.comment.encode(dialect.text.stream_encoding, "replace")
    if mark not in content:
        return
    data = np.frombuffer(content, dtype=np.uint8)
    unmarked = np.ones(len(regular), dtype=bool)
    _clear(unmarked, starts, np.flatnonzero(data == mark[0]))
    lines = np.flatnonzero(~unmarked)
    first = data[starts[lines]]
    regular[lines[first == mark[0]]] = False
    for line in lines[(first == _BLANK) | (first == _TAB)].tolist():
        regular[line] &= not content[starts[line] : starts[line + 1]].lstrip(b" \t").startswith(mark)
