"""Find the rows of one shape at the end of a sample: equally many cells, each a plain number or empty."""

from __future__ import annotations

from cdtool.formats.csv.number_kernel import BYTES, Bytes
from cdtool.formats.csv.row_kernel import Integers
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
    least 3 bytes must follow `stop`. Blank lines between rows are ignored.
    """
    rows = 0
    width = 0
    line = 0
    at = 0
    while at < stop:
        begin = at
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
    found[ROWS], found[WIDTH] = rows, width
    return rows > 0
