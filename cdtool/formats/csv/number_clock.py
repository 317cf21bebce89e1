"""Clocks of numbers: days as counted by Excel, and stamps with more digits than float64 can represent.

45231.5417 days since 1899-12-30 are 2023-11-01 13:00. Stamps such as 1700000000123456789 ns or 1700000000.123456789 s
count from 1970. They are read a second time, as whole nanoseconds, and the first stamp is subtracted before anything is
rounded: float64 represents the stamps with a resolution of 0.24 us only, but their differences exactly.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from cdtool.clock.stamps import EPOCH, count_leading_strays
from cdtool.formats.csv.blank_lines import fill_blank_lines
from cdtool.formats.csv.dialect import Dialect
from cdtool.formats.csv.row_arrays import Rows
from cdtool.formats.csv.row_kernel import Integers
from cdtool.formats.csv.stamps import NS
from cdtool.formats.csv.text import Bytes
from cdtool.plain_text import digits
from cdtool.recording import BoolArray, FloatArray

# Days since 1899-12-30, as counted by Excel, of 1970-01-01, and of the start of the years 2000 and 2100.
_DAY_1970, _FIRST_DAY, _LAST_DAY = 25569.0, 36526.0, 73051.0
DAY_S = 86400.0
# A clock in days steps by less than 10 s [days]; a clock that steps by less than this in seconds samples above 20 kHz.
_DAYS_STEP, _SECONDS_STEP = 10.0 / DAY_S, 5e-5
# A unit's factor to s -> its decimals down to 1 ns.
_DECIMALS = {1.0: 9, 1e-3: 6, 1e-6: 3, 1e-9: 0}
# Above _FIRST [s] float64 cannot represent nanoseconds; up to _LAST [s] 64-bit integers can.
_FIRST, _LAST = 2.0**53 / NS, 2.0**63 / NS
# Bytes of the longest stamp: digits, a point, a sign.
_WIDEST = 24
# Any integer with so many digits fits into 64 bits.
_MOST_DIGITS = 18
# Bytes that may follow a number: blank, tab, line ends, separators.
_AFTER_CELL = np.frombuffer(b" \t\r\n,;|:", dtype=np.uint8)


def two_readings(stamps: FloatArray, factor: float) -> str:
    """Return both readings of a clock that may be in days or in the unit of `factor` [s]; empty if it is not in days.

    `stamps` (n,) are all stamps of the column; missing ones are ignored. The step is the mean over the middle half:
    stamps with four decimals repeat, and the first or last stamp may be an outlier. A clock above 20 kHz whose stamps
    are in the range of the days from 2000 to 2100 cannot be distinguished from a clock in days.
    """
    known = stamps[np.isfinite(stamps)]
    if len(known) < 2 or known.max() <= _FIRST_DAY or not _FIRST_DAY < np.median(known) < _LAST_DAY:
        return ""
    quarter = len(known) // 4
    step = float(known[-1 - quarter] - known[quarter]) / (len(known) - 1 - 2 * quarter)
    if not 0.0 < step < min(_DAYS_STEP, _SECONDS_STEP / factor):
        return ""
    start = np.datetime64(round(since_1970(float(known[0]))), "s")
    return (
        f"starts at {known[0]:.9g} in steps of {step:.3g}: days of Excel ({str(start).replace('T', ' ')}, "
        f"{digits(1.0 / (step * DAY_S), 3)} Hz), or {known[0] * factor:.9g} s at {digits(1.0 / (step * factor), 3)} Hz?"
    )


def since_1970(days: float) -> float:
    """Return the seconds since 1970 of a day as counted by Excel."""
    return (days - _DAY_1970) * DAY_S


def exact_differences(
    dialect: Dialect, rows: Rows, column: int, stamps: FloatArray, factor: float
) -> tuple[FloatArray, float] | None:
    """Return the stamps (n,) minus the first one, in the column's unit, and the first stamp [s].

    The result is None if float64 can represent the stamps. `factor` is the factor from the unit to s. Outliers are not
    used as the first stamp. Stamps that are not plain digits (in quotes, with an exponent) are rounded to float64;
    missing stamps are NaN.
    """
    decimals = _DECIMALS.get(factor)
    if decimals is None or np.fmax.reduce(stamps, initial=-np.inf) * factor <= _FIRST:  # the usual case
        return None
    known = np.isfinite(stamps)
    if not known.any():
        return None
    first_row = count_leading_strays(stamps[known], EPOCH / factor)
    if not _is_large(stamps[known] * factor, first_row):
        return None
    scale = 10**decimals
    whole = np.rint(stamps[known])
    exact = np.zeros(len(stamps), dtype=np.int64)
    exact[known] = whole.astype(np.int64) * scale + np.rint((stamps[known] - whole) * scale).astype(np.int64)
    for first, ticks, read in _cells(dialect, rows, column, decimals):
        part = slice(first, first + len(ticks))
        # A number that differs from the stamp is from another cell: the line has a separator in quotes before it.
        same = read & known[part]
        same[same] = np.abs(ticks[same] / scale - stamps[part][same]) <= 4.0 * np.spacing(stamps[part][same])
        exact[part][same] = ticks[same]
    start = int(exact[known][first_row])
    differences = np.full(len(stamps), np.nan)
    differences[known] = (exact[known] - start) / scale
    return differences, start / NS


def _is_large(seconds: FloatArray, first: int) -> bool:
    return bool(seconds[first] > _FIRST and np.all(np.abs(seconds) < _LAST))


def _cells(dialect: Dialect, rows: Rows, column: int, decimals: int) -> Iterator[tuple[int, Integers, BoolArray]]:
    """Yield per block the number of its first row, the cells in 1 / 10^decimals, and which cells are plain digits."""
    line_end = dialect.text.line_end
    line, row = dialect.first_line, 0
    for block, size in dialect.text.blocks(dialect.offset):
        if dialect.blank_is_missing:
            block, size, _ = fill_blank_lines(block, size, line_end)
        data = np.frombuffer(block, dtype=np.uint8)
        ends = np.flatnonzero(data[: size + 1] == line_end[0])  # the byte after the block replaces a missing line end
        ends = ends[: np.searchsorted(ends, size - 1) + 1]
        starts = np.concatenate(([0], ends[:-1] + 1))
        is_row = ~np.isin(line + np.arange(len(starts)), rows.not_rows)
        is_row[np.cumsum(is_row) > rows.count - row] = False
        begin = _begin(data[:size], starts[is_row], dialect.separator, column)
        yield row, *_ticks(data, begin, ord(dialect.marks.decimal), decimals)
        line, row = line + len(starts), row + len(begin)


def read_whole_numbers(data: Bytes, dialect: Dialect, column: int, blank: Integers) -> tuple[Integers, BoolArray]:
    """Return the integers (n,) of a column in complete lines without the `blank` ones, and which cells are integers.

    They are exact. A cell with more than 18 digits is none of them: it may not fit into 64 bits.
    """
    ends = np.flatnonzero(data == dialect.text.line_end[0])
    starts = np.delete(np.concatenate(([0], ends[:-1] + 1)), blank)
    begin = _begin(data, starts, dialect.separator, column)
    numbers, is_read = _ticks(data, begin, -1, 0)
    after = data[np.minimum(begin + _MOST_DIGITS, len(data) - 1)]
    return numbers, is_read & ((after < ord("0")) | (after > ord("9")))


def _begin(data: Bytes, starts: Integers, separator: str, column: int) -> Integers:
    """Return the bytes where the cells of a column start in the lines at `starts`; the data's end if one is missing."""
    if separator == " ":
        blank = (data == 32) | (data == 9) | (data == 10) | (data == 13)
        places = np.flatnonzero(~blank & np.concatenate(([True], blank[:-1])))
        number = np.searchsorted(places, starts) + column
    elif column == 0:
        return starts
    else:
        places = np.flatnonzero(data == ord(separator)) + 1
        number = np.searchsorted(places, starts, side="right") + column - 1
    return np.append(places, len(data))[np.minimum(number, len(places))]


def _ticks(data: Bytes, begin: Integers, mark: int, decimals: int) -> tuple[Integers, BoolArray]:
    """Return the cells as multiples of 1 / 10^decimals, and which are only digits and at most one decimal mark."""
    ticks = np.zeros(len(begin), dtype=np.int64)
    places = np.full(len(begin), -1)  # digits after the decimal mark; -1 before the mark
    begun, ended, read = (np.zeros(len(begin), dtype=bool) for _ in range(3))
    last = len(data) - 1
    for i in range(_WIDEST):
        letter = data[np.minimum(begin + i, last)]
        digit = (letter >= 48) & (letter <= 57) & ~ended
        counts = digit & (places < decimals)
        ticks[counts] = 10 * ticks[counts] + letter[counts] - 48
        places += digit & (places >= 0)
        point = (letter == mark) & (places < 0) & begun & ~ended
        places[point] = 0
        begun |= digit
        stop = begun & ~digit & ~point & ~ended
        read |= stop & np.isin(letter, _AFTER_CELL)
        ended |= stop | (~begun & (letter != 32))
    ticks *= 10 ** (decimals - np.clip(places, 0, decimals))
    return ticks, read
