"""Blank lines in a table of one column are empty cells: each is a missing sample, so that later rows have their times.

If every other line is blank, the blank lines only separate the rows and are not samples; nor are those at the end.
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


def are_missing_samples(lines: Sequence[Line], first: int, width: int) -> bool:
    """Return whether blank lines are missing samples of the table whose rows start in line number `first`.

    They are if the table has one column and fewer than half of the `lines` of its rows are blank.
    """
    if width != 1:
        return False
    rows = [line.number for line in lines if not line.blank and line.number >= first]
    blank = [line.number for line in lines if line.blank and first < line.number < rows[-1]]
    return not blank or 2 * len(blank) < rows[-1] - first


def strip_blank_end(text: Text) -> Text:
    """Return the text up to the end of its last line that is not blank."""
    while True:
        end = text.line_end.join(text.tail())
        blank = end[len(end.rstrip(_BLANK)) :]
        more = len(blank) - (blank.find(text.line_end) + 1)
        if not more or not blank.strip(b" \t"):
            return text
        text = replace(text, size=text.size - more * UNIT_BYTES.get(text.encoding, 1))


def fill_blank_lines(block: bytearray, size: int, line_end: bytes) -> tuple[bytearray, int, Integers]:
    """Return a block of `size` bytes with an empty cell in each blank line, its new size, and these lines (from 0)."""
    begins = (line_end + bytes((letter,)) for letter in _BLANK)
    # The usual case, in which a quick search finds no blank line:
    if block[0] not in _BLANK and all(block.find(begin, 0, size) < 0 for begin in begins):
        return block, size, np.empty(0, dtype=np.int64)
    data = np.frombuffer(block, dtype=np.uint8, count=size)
    ends = np.flatnonzero(data == line_end[0])
    if not len(ends):
        return block, size, np.empty(0, dtype=np.int64)
    data = data[: ends[-1] + 1]
    starts = np.concatenate(([0], ends[:-1] + 1))
    printed = np.logical_and.reduce([data != letter for letter in _BLANK])
    lines = np.flatnonzero(np.add.reduceat(printed, starts, dtype=np.int64) == 0)
    if not len(lines):
        return block, size, lines
    cuts = [0, *starts[lines].tolist(), size]
    content = _EMPTY_CELL.join(bytes(memoryview(block)[start:end]) for start, end in pairwise(cuts))
    return bytearray(content + line_end * AFTER), len(content), lines
