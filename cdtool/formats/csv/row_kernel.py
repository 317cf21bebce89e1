"""Lines of a text table -> numbers: one pass over a block of whole lines, the wanted columns only.

Every line is looked at, every cell counted. A line that is not plain (another width, a word where a number belongs, a
comment, a stray quote) gets a row of its own too and is listed; what it is, is decided outside.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from cdtool.formats.csv.number_kernel import BYTES, FLOATS, WORDS, Bytes, Words, quick_number, read_number
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


@kernel(
    f"void({BYTES}, int64, int64[::1], int64[::1], {PROGRAMS}, float64[:, ::1], int64[:, ::1], int64, int64[::1],"
    f" int64[:, ::1], int64[::1], {FLOATS}, {WORDS}, {WORDS})"
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
    high5: Words,
    low5: Words,
) -> None:
    """Read the lines of `data[:stop]`, the last byte of which ends a line, into the rows from `row` on.

    `marks`: line end, separator, decimal, thousands, quote, comment, each a byte or -1; a blank as separator stands for
    any run of blanks. `targets`: see above, one a column. `blank` takes the lines (from 0) that hold nothing, `odd` one
    of (line, row, first byte, last byte) for each line that is not plain. `counts` takes rows, lines, blank, odd ones.
    """
    line_end, separator, decimal, thousands = marks[0], marks[1], marks[2], marks[3]
    quote, comment = marks[4], marks[5]
    width = len(targets)
    tab_is_blank = separator != 9
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
        while (
            data[p] == 32
            or (data[p] == 9 and tab_is_blank)
            or ((data[p] == 13 or data[p] == 10) and data[p] != line_end)
        ):
            p += 1
        if data[p] == line_end:
            blank[blanks] = line
            blanks += 1
            line += 1
            p += 1
            continue
        plain = data[p] != comment
        column = 0
        while plain:
            if quick and targets[column] >= 0:  # nearly every cell: a plain number up to the separator
                value, end = quick_number(data, p, bare_decimal, tens)
                if end >= 0:
                    if data[end] == separator and column < last:
                        numbers[targets[column], row] = value
                        column += 1
                        p = end + 1
                        continue
                    if data[end] == line_end and column == last:
                        numbers[targets[column], row] = value
                        column = width
                        p = end
                        break
            while data[p] == 32 or (data[p] == 9 and tab_is_blank):
                p += 1
            target = targets[column]
            quoted = data[p] == quote
            if quoted:
                p += 1
                while data[p] == 32:
                    p += 1
            if target == LEFT:
                if quoted:
                    while data[p] != quote and data[p] != line_end and data[p] != 0:
                        p += 1
                    plain = data[p] == quote
                    p += plain
                else:
                    while data[p] != separator and data[p] != line_end and data[p] not in (0, 10, 13):
                        if by_blanks and data[p] == 9:
                            break
                        p += 1
            else:
                b = data[p]
                if b in (separator, line_end, 10, 13) or (quoted and b == quote):
                    if target >= 0:
                        numbers[target, row] = math.nan
                    elif target <= STAMP:
                        stamps[STAMP - target, row] = MISSING_STAMP
                elif target >= 0:
                    value, end = read_number(
                        data,
                        p,
                        decimal if quoted else bare_decimal,
                        thousands if quoted else bare_thousands,
                        tens,
                        high5,
                        low5,
                    )
                    plain = end >= 0
                    if plain:
                        numbers[target, row] = value
                        p = end
                elif target <= STAMP:
                    stamp, end = read_stamp(data, p, programs[STAMP - target])
                    plain = end >= 0
                    if plain:
                        stamps[STAMP - target, row] = stamp
                        p = end
                else:
                    plain = False
                if quoted and plain:
                    while data[p] == 32:
                        p += 1
                    plain = data[p] == quote
                    p += plain
            if not plain:
                break
            cell_end = p
            while data[p] == 32 or (data[p] == 9 and tab_is_blank):
                p += 1
            column += 1
            b = data[p]
            if b == line_end:
                break
            if b in (10, 13):
                while data[p] != line_end and data[p] in (10, 13):
                    p += 1
                plain = data[p] == line_end
                break
            if by_blanks:
                plain = p > cell_end and column < width
            else:
                plain = b == separator and column < width
                p += plain
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
