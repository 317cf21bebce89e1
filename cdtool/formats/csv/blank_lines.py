"""Blank lines of a table of one column are its empty cells, each a missing sample: the rows after it keep their times.

Where every other line is blank it is the spacing of the rows, and none of them is a sample; nor are those at the end.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from cdtool.formats.csv.lines import Line
from cdtool.formats.csv.row_kernel import Integers
from cdtool.formats.csv.text import AFTER, UNIT_BYTES, Text

_EMPTY_CELL, _BLANK = b'""', b" \t\r\n"


def are_missing(lines: Sequence[Line], first: int, width: int) -> bool:
    """True if blank lines are samples: of one column, and few among the sample's `lines` from number `first` on."""
    if width != 1:
        return False
    rows = [line.number for line in lines if not line.blank and line.number >= first]
    blank = [line.number for line in lines if line.blank and first < line.number < rows[-1]]
    return not blank or 2 * len(blank) < rows[-1] - first


def without_blank_end(text: Text) -> Text:
    """The text up to the end of its last line that is not blank."""
    while True:
        end = text.line_end.join(text.tail())
        blank = end[len(end.rstrip(_BLANK)) :]
        more = len(blank) - (blank.find(text.line_end) + 1)
        if not more or not blank.strip(b" \t"):
            return text
        text = replace(text, size=text.size - more * UNIT_BYTES.get(text.encoding, 1))


def filled(block: bytearray, size: int, line_end: bytes) -> tuple[bytearray, int, Integers]:
    """A block of `size` bytes with an empty cell in each blank line, its new size, and these lines (from 0)."""
    begins = (line_end + bytes((letter,)) for letter in _BLANK)
    if block[0] not in _BLANK and all(block.find(begin, 0, size) < 0 for begin in begins):  # nearly always, and soon
        return block, size, np.empty(0, dtype=np.int64)
    data = np.frombuffer(block, dtype=np.uint8, count=size)
    ends = np.flatnonzero(data == line_end[0])
    if not len(ends):
        return block, size, np.empty(0, dtype=np.int64)
    data = data[: ends[-1] + 1]
    starts = np.concatenate(([0], ends[:-1] + 1))
    shown = np.logical_and.reduce([data != letter for letter in _BLANK])
    lines = np.flatnonzero(np.add.reduceat(shown, starts, dtype=np.int64) == 0)
    if not len(lines):
        return block, size, lines
    cuts = [0, *starts[lines].tolist(), size]
    made = _EMPTY_CELL.join(bytes(memoryview(block)[start:end]) for start, end in pairwise(cuts))
    return bytearray(made + line_end * AFTER), len(made), lines
