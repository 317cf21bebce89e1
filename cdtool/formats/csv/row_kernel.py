"""Lines of a text table -> numbers: one pass over a block of whole lines, the wanted columns only.

Every line is looked at, every cell counted. A line that is not plain (another width, a word where a number belongs, a
comment, a stray quote) gets a row of its own too and is listed; what it is, is decided outside.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from cdtool.decimal_kernel import POWERS
from cdtool.formats.csv.number_kernel import BYTES, FLOATS, Bytes, Words, quick_number, read_number
from cdtool.formats.csv.stamp_kernel import PROGRAMS, Programs, read_stamp
from cdtool.kernels import kernel
from cdtool.recording import FloatArray

Integers = npt.NDArray[np.int64]
# What a column of the file is for: k >= 0, a row of the numbers; else one of these, or STAMP - k, a row of the stamps.
LEFT, EMPTY, STAMP = -1, -2, -3
MISSING_STAMP = np.int64(-(2**63))
BLANK_SEPARATOR = 32


@kernel(f"int64({BYTES}, int64)")
def count_lines(data: Bytes, line_end: int) -> int:
    """How many line ends there are."""
    count = 0
    for i in range(len(data)):
        count += data[i] == line_end
    return count


@kernel(f"int64({BYTES}, int64, b1)")
def _past_blanks(data: Bytes, at: int, tabs: bool) -> int:
    """The first byte from `at` on that is no blank, nor a tab if `tabs` count as such."""
    p = at
    while data[p] == 32 or (tabs and data[p] == 9):
        p += 1
    return p


@kernel(
    f"void({BYTES}, int64, int64[::1], int64[::1], {PROGRAMS}, float64[:, ::1], int64[:, ::1], int64, int64[::1],"
    f" int64[:, ::1], int64[::1], {FLOATS}, {POWERS})"
)
def read_rows(
    data: Bytes,
    stop: int,
    marks: Integers,
    targets: Integers,
    programs: Programs,
    numbers: FloatArray,
    stamps: Integers,
    row: int,
    blank: Integers,
    odd: Integers,
    counts: Integers,
    tens: FloatArray,
    fives: Words,
) -> None:
    """Read the lines of `data[:stop]`, the last byte of which ends a line, into the rows from `row` on.

    `marks`: line end, separator, decimal, thousands, quote, comment, each a byte or -1; a blank as separator stands for
    any run of blanks. `targets`: see above, one a column. `blank` takes the lines (from 0) that hold nothing, `odd` one
    of (line, row, first byte, last byte) for each line that is not plain. `counts` takes rows, lines, blank, odd ones.
    """
    line_end, separator, decimal, thousands = marks[0], marks[1], marks[2], marks[3]
    quote, comment = marks[4], marks[5]
    other_end = 23 - line_end  # of \n and \r the one that ends no line
    width = len(targets)
    tabs = separator != 9
    by_blanks = separator == BLANK_SEPARATOR
    # Outside quotes a separator is one, whatever else it may stand for.
    bare_decimal = -1 if decimal == separator else decimal
    bare_thousands = -1 if thousands == separator else thousands
    quick = not by_blanks and thousands < 0
    last = width - 1
    p = 0
    line = 0
    blanks = 0
    odds = 0
    first_row = row
    while p < stop:
        begin = p
        p = _past_blanks(data, p, tabs)
        while data[p] == other_end:
            p = _past_blanks(data, p + 1, tabs)
        if data[p] == line_end:
            blank[blanks] = line
            blanks += 1
            line += 1
            p += 1
            continue
        plain = data[p] != comment
        column = 0
        while plain:
            target = targets[column]
            if quick and target >= 0:  # nearly every cell: a plain number up to the separator
                value, end = quick_number(data, p, bare_decimal, tens)
                if end >= 0 and data[end] == (separator if column < last else line_end):
                    numbers[target, row] = value
                    column += 1
                    if column == width:
                        p = end
                        break
                    p = end + 1
                    continue
            p = _past_blanks(data, p, tabs)
            quoted = data[p] == quote
            if quoted:
                p = _past_blanks(data, p + 1, False)
            b = data[p]
            if target == LEFT:
                if quoted:
                    while b != quote and b != line_end and b != 0:
                        p += 1
                        b = data[p]
                    plain = b == quote
                    p += plain
                else:
                    while b != separator and b != line_end and b != other_end and b != 0 and not (by_blanks and b == 9):
                        p += 1
                        b = data[p]
            else:
                empty = b in (separator, line_end, other_end) or (quoted and b == quote)
                end = p
                if target >= 0:
                    value = math.nan
                    if not empty:
                        point = decimal if quoted else bare_decimal
                        value, end = read_number(data, p, point, thousands if quoted else bare_thousands, tens, fives)
                    if end >= 0:
                        numbers[target, row] = value
                elif target <= STAMP:
                    stamp = MISSING_STAMP
                    if not empty:
                        stamp, end = read_stamp(data, p, programs[STAMP - target])
                    if end >= 0:
                        stamps[STAMP - target, row] = stamp
                elif not empty:
                    end = -1
                plain = end >= 0
                if plain:
                    p = end
                    if quoted:
                        p = _past_blanks(data, p, False)
                        plain = data[p] == quote
                        p += plain
            if not plain:
                break
            cell_end = p
            p = _past_blanks(data, p, tabs)
            column += 1
            b = data[p]
            if b == line_end:
                break
            if b == other_end:
                while data[p] == other_end:
                    p += 1
                plain = data[p] == line_end
                break
            plain = column < width and (p > cell_end if by_blanks else b == separator)
            p += plain and not by_blanks
        if not plain or column != width:
            while data[p] != line_end:
                p += 1
            odd[odds, 0] = line
            odd[odds, 1] = row
            odd[odds, 2] = begin
            odd[odds, 3] = p
            odds += 1
        row += 1
        line += 1
        p += 1
    counts[0] = row - first_row
    counts[1] = line
    counts[2] = blanks
    counts[3] = odds
