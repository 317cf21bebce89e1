"""Blank lines of a table of one column are its empty cells, each a missing sample: the rows after it keep their times.

Where every other line is blank it is the spacing of the rows, and none of them is a sample; nor are those at the end.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np

from cdtool.formats.csv.lines import Line
from cdtool.formats.csv.row_kernel import Integers
from cdtool.formats.csv.text import AFTER, UNIT_BYTES, Text

_EMPTY_CELL = b'""'


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
        blank = end[len(end.rstrip(b" \t\r\n")) :]
        more = len(blank) - (blank.find(text.line_end) + 1)
        if not more or not blank.strip(b" \t"):
            return text
        text = replace(text, size=text.size - more * UNIT_BYTES.get(text.encoding, 1))


def filled(block: bytearray, size: int, line_end: bytes) -> tuple[bytearray, int, Integers]:
    """A block of `size` bytes with an empty cell in each blank line, its new size, and these lines (from 0)."""
    lines: list[int] = []
    parts: list[bytes] = []
    at = number = 0
    for blank in _blank(line_end).finditer(block, 0, size):
        number += block.count(line_end, at, blank.start())
        lines.append(number)
        parts += [bytes(block[at : blank.start()]), _EMPTY_CELL]
        at = blank.start()
    if not lines:
        return block, size, np.empty(0, dtype=np.int64)
    made = b"".join([*parts, bytes(block[at:size])])
    return bytearray(made + line_end * AFTER), len(made), np.array(lines, dtype=np.int64)


@cache
def _blank(line_end: bytes) -> re.Pattern[bytes]:
    """What a blank line holds, before its line end."""
    others = rb"[ \t\r]*" if line_end == b"\n" else rb"[ \t\n]*"
    return re.compile(rb"(?:^|(?<=" + line_end + rb"))" + others + rb"(?=" + line_end + rb")")
