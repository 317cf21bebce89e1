"""Find the rows of one shape at the end of a sample: equally many cells, each a plain number or empty."""

from __future__ import annotations

from typing import Any

import numpy as np

from cdtool.formats.csv.digits_kernel import BYTES, ZEROS, Bytes, digit_count
from cdtool.formats.csv.row_kernel import Integers
from cdtool.instructions import equal_bytes, load, trailing_zeros
from cdtool.kernels import kernel

# Fields of `found`: number of rows, cells per row, line (from 0) and byte of the first row.
ROWS, WIDTH, FIRST_LINE, FIRST_BYTE = range(4)
# Kinds of marks: a decimal point or comma; or one that may be a thousands separator instead (1.234). Fields of each:
# the first row (from 0) with such a number; -1 for none; and the byte of that row.
POINT, COMMA, POINT_OR_THOUSANDS, COMMA_OR_THOUSANDS = range(4)
FIRST_ROW, ROW_BYTE = range(2)
# Fields of each column: count of numbers, current run of numbers in successive rows, longest run, row (from 0) at the
# end of its last occurrence, byte of the last row with a number. Runs are counted up to LONG.
NUMBERS, RUN, LONGEST_RUN, RUN_END, LAST_BYTE = range(5)
LONG = 128
_U0, _U1, _U3, _U64 = map(np.uint64, (0, 1, 3, 64))


@kernel("void(int64[:, ::1], int64, int64, int64, int64)")
def _add_full_rows(columns: Integers, width: int, rows: int, count: int, begin: int) -> None:
    """Count the last `count` of `rows` rows, in which all cells are numbers; the last one starts at byte `begin`."""
    if count == 0:
        return
    for column in range(width):
        columns[column, RUN] = min(columns[column, RUN] + count, LONG)
        columns[column, NUMBERS] += count
        columns[column, LAST_BYTE] = begin
        if columns[column, RUN] >= columns[column, LONGEST_RUN]:
            columns[column, LONGEST_RUN], columns[column, RUN_END] = columns[column, RUN], rows - 1


@kernel(f"b1({BYTES}, int64, int64, int64, int64, int64[::1], int64[:, ::1], int64[:, ::1], int64[::1])")
def find_alike_rows(
    data: Bytes,
    stop: int,
    separator: int,
    most_above: int,
    most_starts: int,
    found: Integers,
    marks: Integers,
    columns: Integers,
    starts: Integers,
) -> bool:
    """Find the rows of one shape at the end of `data[:stop]`, whose last byte is a line feed.

    Return False if they begin after line `most_above`, if no row is found, or if a row has more cells than `columns`
    has rows. `marks` is (4, 2), `columns` (k, 5); `starts` receives the first bytes of the first `most_starts` rows. At
    least 64 line feeds must follow `stop`. Blank lines between rows are ignored.
    """
    rows = 0
    width = 0
    line = 0
    at: Any = 0
    seen = 0  # the kinds of marks of the rows so far, a bit for each
    full_rows = 0  # successive rows of plain numbers that are not yet counted in `columns`, and the last one's byte
    last_full = 0
    base = _U0  # the byte from which 64 bytes have been searched for ends of cells, and the ends left
    ends = equal_bytes(data, base, separator) | equal_bytes(data, base, 10)
    while at < stop:
        begin = at
        if rows:
            # The usual row: a number in each cell, and nothing else. The ends of cells are found in 64 bytes at once.
            p = np.uint64(at)
            if p < base or p - base >= _U64:
                base = p
                ends = equal_bytes(data, base, separator) | equal_bytes(data, base, 10)
            ends = ends >> (p - base) << (p - base)
            shown: Any = 0
            column = 0
            full = True
            final = False
            while full and not final:
                while ends == _U0:
                    base += _U64
                    ends = equal_bytes(data, base, separator) | equal_bytes(data, base, 10)
                end = base + trailing_zeros(ends)
                ends &= ends - _U1
                column += 1
                final = data[end] == 10
                last = end - np.uint64(final and data[end - _U1] == 13)
                p += np.uint64((data[p] == 43) | (data[p] == 45))
                leading = data[p]
                upper = digit_count(load(data, p) ^ ZEROS)
                p += upper
                lower = _U0
                point = data[p]
                if point == 46 or (point == 44 and separator != 44):
                    p += _U1
                    lower = digit_count(load(data, p) ^ ZEROS)
                    p += lower
                    grouped = (upper != _U0) & (upper <= _U3) & (leading != 48) & (lower == _U3)
                    shown |= 1 << (2 * np.int64(grouped) + np.int64(point == 44))
                full = p == last and upper + lower != _U0
                p = end + _U1
            if full and column == width:
                if rows < most_starts:
                    starts[rows] = begin
                if shown & ~seen:
                    for kind in range(4):
                        if shown >> kind & 1 and marks[kind, FIRST_ROW] < 0:
                            marks[kind, FIRST_ROW], marks[kind, ROW_BYTE] = rows, begin
                    seen |= shown
                rows += 1
                full_rows += 1
                last_full = begin
                line += 1
                at = np.int64(p)
                continue
            _add_full_rows(columns, width, rows, full_rows, last_full)
            full_rows = 0
        cells = 0
        filled = 0
        plain = True
        shown = 0  # a bit for each kind of mark
        while True:  # the cells of a line
            if separator != 9 and cells:
                while data[at] == 32:
                    at += 1
            first = at
            signed = data[at] == 43 or data[at] == 45
            if signed:
                at += 1
            digit = data[at]
            whole = 0
            while 48 <= data[at] <= 57:
                whole += 1
                at += 1
            mark = 0
            decimals = 0
            if data[at] == 46 or (data[at] == 44 and separator != 44):
                mark = data[at]
                at += 1
                while 48 <= data[at] <= 57:
                    decimals += 1
                    at += 1
            number = whole + decimals > 0
            power = False
            if number and data[at] | 32 == 101:
                at += 1
                if data[at] == 43 or data[at] == 45:
                    at += 1
                power = 48 <= data[at] <= 57
                plain = plain and power
                while 48 <= data[at] <= 57:
                    at += 1
            if not number and mark == 0 and not signed and data[at] | 32 == 110:  # nan, NaN, NAN
                low = data[at + 1] == 97 and data[at + 2] == 110 and data[at] == 110
                mixed = data[at + 1] == 97 and data[at + 2] == 78 and data[at] == 78
                high = data[at + 1] == 65 and data[at + 2] == 78 and data[at] == 78
                number = low or mixed or high
                at += 3 if number else 0
            if number:
                if cells >= len(columns):
                    return False
                if mark:
                    grouped = 1 <= whole <= 3 and digit != 48 and decimals == 3 and not power
                    shown |= 1 << ((2 if grouped else 0) + (1 if mark == 44 else 0))
                filled += 1
                columns[cells, RUN] += 1
            else:
                plain = plain and at == first
                if cells >= len(columns):
                    return False
                columns[cells, RUN] = 0
            cells += 1
            letter = data[at]
            if letter == 13 and data[at + 1] == 10:
                at += 1
                letter = data[at]
            if letter == separator:
                at += 1
                continue
            plain = plain and letter == 10
            break
        while data[at] != 10:
            at += 1
        at += 1
        line += 1
        if plain and filled == 0 and cells == 1:
            if rows and at < stop:  # a blank line: the next row is no neighbour of the last one
                columns[:, RUN] = 0
            continue
        if not plain or filled == 0 or cells != width:
            rows = 0
            seen = 0
            columns[:, :] = 0
            marks[:, :] = -1
            found[FIRST_LINE], found[FIRST_BYTE] = line, at
            width = 0
            if plain and filled:  # the first row of its width: read again, now as such
                width, line, at = cells, line - 1, begin
                found[FIRST_LINE], found[FIRST_BYTE] = line, at
            if line > most_above:
                return False
            continue
        if rows < most_starts:
            starts[rows] = begin
        for kind in range(4):
            if shown >> kind & 1 and marks[kind, FIRST_ROW] < 0:
                marks[kind, FIRST_ROW], marks[kind, ROW_BYTE] = rows, begin
        for column in range(width):
            if columns[column, RUN]:
                columns[column, RUN] = min(columns[column, RUN], LONG)
                columns[column, NUMBERS] += 1
                columns[column, LAST_BYTE] = begin
                if columns[column, RUN] >= columns[column, LONGEST_RUN]:
                    columns[column, LONGEST_RUN], columns[column, RUN_END] = columns[column, RUN], rows
        rows += 1
    _add_full_rows(columns, width, rows, full_rows, last_full)
    found[ROWS], found[WIDTH] = rows, width
    return rows > 0
