"""Rows that end early: where only the first channels still have samples, the cells of the others are not written.

Such lines are completed with separators, so that every row has all cells. Lines without a separator are left as they
are: words, and blank lines.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from cdtool.formats.csv.dialect import Dialect
from cdtool.formats.csv.row_kernel import Integers
from cdtool.formats.csv.text import AFTER, Bytes

# So many cells a block may have once its lines are complete: 16 MiB of float64.
_MOST_CELLS = 1 << 21
# Between blanks an empty cell cannot be written.
_EMPTY = {" ": b" nan"}


def complete_blocks(blocks: Iterable[tuple[bytearray, int]], dialect: Dialect) -> Iterator[tuple[bytearray, int]]:
    """Yield `Text.blocks` with all cells in each line that has at least two; a block may become several.

    With `Dialect.short_width` only lines with exactly so many cells are completed: any other is damaged. A last line
    without a line end is left as it is: it may be cut off.
    """
    cell = _EMPTY.get(dialect.separator, dialect.separator.encode())
    mark, end = ord(dialect.separator), dialect.text.line_end[0]
    most = max(1, _MOST_CELLS // dialect.width)
    for block, size in blocks:
        data = np.frombuffer(block, dtype=np.uint8, count=size)
        ends = np.flatnonzero(data == end)
        marks = np.flatnonzero(data == mark)
        starts = np.concatenate(([0], ends + 1))
        for first in range(0, max(len(ends), 1), most):
            last = min(first + most, len(ends))
            begin, stop = int(starts[first]), size if last == len(ends) else int(starts[last])
            widths = dialect.width, dialect.short_width
            lines = _complete(data[begin:stop], ends[first:last] - begin, marks - begin, widths, cell)
            yield bytearray(lines.tobytes() + bytes((end,)) * AFTER), len(lines)


def _complete(data: Bytes, ends: Integers, marks: Integers, widths: tuple[int, int], cell: bytes) -> Bytes:
    """Return the lines that end at `ends` with all cells: `cell` with its separator for each that is missing.

    `marks` are the separators in the lines; `widths` are the cells of a whole line, and of the short ones (0: any).
    """
    width, short = widths
    counts = np.diff(np.searchsorted(marks, np.concatenate(([0], ends))))
    ends_early = counts == short - 1 if short else counts > 0
    missing = np.where(ends_early, np.maximum(width - 1 - counts, 0), 0)
    if not missing.any():
        return data
    # A carriage return belongs to the line end.
    places = ends - (data[np.maximum(ends - 1, 0)] == ord("\r"))
    letters = np.frombuffer(cell, dtype=np.uint8)
    return np.insert(data, np.repeat(places, missing * len(cell)), np.tile(letters, int(missing.sum())))
