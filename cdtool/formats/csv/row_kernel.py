"""Read lines of a text table as numbers: one pass over a block of complete lines, for the requested columns only.

The cells of every line are counted. An irregular line (of another width, with a word in a column of numbers, a comment,
a stray quote) also gets a row and is listed; the caller decides how to read it.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from cdtool.decimal_kernel import POWERS
from cdtool.formats.csv.digits_kernel import BYTES, ZEROS, Bytes, digit_count, first_digits
from cdtool.formats.csv.number_kernel import FLOATS, Words, read_number
from cdtool.formats.csv.stamp_kernel import PROGRAMS, Programs, read_stamp
from cdtool.instructions import equal_bytes, load, trailing_zeros
from cdtool.kernels import kernel
from cdtool.recording import FloatArray

Integers = npt.NDArray[np.int64]
# Destination of a file's column: k >= 0 for row k of the numbers, STAMP - k for row k of the stamps, or one of these.
LEFT, EMPTY, STAMP = -1, -2, -3
MISSING_STAMP = np.int64(-(2**63))
BLANK_SEPARATOR = 32
_U0, _U1, _U64 = map(np.uint64, (0, 1, 64))
_EXACT = 2.0**53


@kernel(f"int64({BYTES}, int64)")
def count_lines(data: Bytes, line_end: int) -> int:
    """Return the number of line ends."""
    count = 0
    for i in range(len(data)):
        count += data[i] == line_end
    return count


@kernel(f"int64({BYTES}, int64, b1)")
def _past_blanks(data: Bytes, at: int, tabs: bool) -> int:
    """Return the first position from `at` that is not a blank, nor a tab if `tabs` is True."""
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
    irregular: Integers,
    counts: Integers,
    tens: FloatArray,
    fives: Words,
) -> None:
    """Read the lines of `data[:stop]`, whose last byte is a line end, into the arrays, starting at row `row`.

    `marks`: line end, separator, decimal, thousands, quote, comment, each a byte or -1; a blank as separator stands for
    any run of blanks. `targets`: the destination of each column, see above. Outputs: `blank` are the blank lines (from
    0), `irregular` has (line, row, first byte, last byte) of each irregular line, and `counts` are the numbers of rows,
    lines, blank lines and irregular lines.
    """
    line_end, separator, decimal, thousands = marks[0], marks[1], marks[2], marks[3]
    quote, comment = marks[4], marks[5]
    other_end = 23 - line_end  # the one of \n and \r that is not the line end
    width = len(targets)
    tabs = separator != 9
    by_blanks = separator == BLANK_SEPARATOR
    # Outside quotes a separator is never a decimal or thousands mark.
    bare_decimal = -1 if decimal == separator else decimal
    bare_thousands = -1 if thousands == separator else thousands
    quick = not by_blanks and thousands < 0
    base = _U0 - _U64  # the byte from which 64 bytes have been searched for ends of cells, and the ends left
    ends = _U0
    p: Any = 0
    line = 0
    blanks = 0
    irregulars = 0
    first_row = row
    while p < stop:
        begin = p
        if quick and data[p] > 32 and data[p] != comment:
            # The usual line, whose cells are found by their ends in 64 bytes at once. What reads numbers is not in a
            # kernel of its own: arrays that are passed are counted as in use, which takes longer.
            start = np.uint64(p)  # unsigned, so that the compiled code does not test for negative indices
            column = 0
            plain = True
            while plain:
                while ends == _U0:
                    base += _U64
                    ends = equal_bytes(data, base, separator) | equal_bytes(data, base, line_end)
                after = base + trailing_zeros(ends)
                ends &= ends - _U1
                target = targets[column]
                column += 1
                final = data[after] == line_end
                last = after - np.uint64(final and data[after - _U1] == other_end)
                if target >= 0:
                    q = start
                    while data[q] == 32:
                        q += _U1
                    negative = np.uint64(data[q] == 45)
                    q += negative
                    word = load(data, q) ^ ZEROS
                    digits = digit_count(word)
                    q += digits
                    value: Any = np.float64(first_digits(word, digits))
                    scale = 1.0
                    if data[q] == bare_decimal:
                        q += _U1
                        word = load(data, q) ^ ZEROS
                        decimals = digit_count(word)
                        digits += decimals
                        q += decimals
                        scale = tens[decimals]
                        value = value * scale + np.float64(first_digits(word, decimals))
                    # Below 2^53 the product and the sum are exact. The sign is a factor, as it cannot be predicted.
                    if q == last and digits != _U0 and value < _EXACT:
                        value = value / scale * np.float64(1 - 2 * np.int64(negative))
                    elif start == last:
                        value = math.nan
                    else:
                        value, other = read_number(data, np.int64(start), bare_decimal, -1, tens, fives)
                        plain = other == np.int64(last)
                    numbers[target, row] = value
                elif target == LEFT:
                    for i in range(start, last):
                        plain = plain and data[i] != quote and data[i] != 0 and data[i] != other_end
                elif target == EMPTY or start == last:
                    plain = start == last
                    if target <= STAMP:
                        stamps[STAMP - target, row] = MISSING_STAMP
                else:
                    stamp, other = read_stamp(data, np.int64(start), programs[STAMP - target])
                    plain = other == np.int64(last)
                    stamps[STAMP - target, row] = stamp
                start = after + _U1
                if final or column == width:
                    break
            if plain and final and column == width:
                p = np.int64(start)
                row += 1
                line += 1
                continue
        p = _past_blanks(data, p, tabs)
        while data[p] == other_end:
            p = _past_blanks(data, p + 1, tabs)
        if data[p] == line_end:
            blank[blanks] = line
            blanks += 1
            line += 1
            p += 1
            base = np.uint64(p) - _U64
            ends = _U0
            continue
        plain = data[p] != comment
        column = 0
        while plain:
            target = targets[column]
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
            irregular[irregulars, 0] = line
            irregular[irregulars, 1] = row
            irregular[irregulars, 2] = begin
            irregular[irregulars, 3] = p
            irregulars += 1
        row += 1
        line += 1
        p += 1
        base = np.uint64(p) - _U64
        ends = _U0
    counts[0] = row - first_row
    counts[1] = line
    counts[2] = blanks
    counts[3] = irregulars
