"""A clock of numbers: one in days, as Excel counts them, and one whose stamps have more digits than float64.

45231.5417 days since 1899-12-30 are 2023-11-01 13:00. Stamps such as 1700000000123456789 ns or 1700000000.123456789 s
count from 1970. They are read a second time, as whole nanoseconds, and the first is taken off before
anything is rounded: float64 holds them to 0.24 us only, their differences exactly.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from cdtool.clock.stamps import EPOCH, count_leading_strays
from cdtool.formats.csv.blank_lines import filled
from cdtool.formats.csv.dialect import Dialect
from cdtool.formats.csv.row_arrays import Rows
from cdtool.formats.csv.row_kernel import Integers
from cdtool.formats.csv.stamps import NS
from cdtool.formats.csv.text import Bytes
from cdtool.plain_text import digits
from cdtool.recording import BoolArray, FloatArray

# Days since 1899-12-30, as Excel counts them, of 1970; and of the years 2000 to 2100.
_DAY_1970, _FIRST_DAY, _LAST_DAY = 25569.0, 36526.0, 73051.0
DAY_S = 86400.0
# A log steps by less than this in days (10 s); and by less than this in seconds it samples above 20 kHz.
_DAYS_STEP, _SECONDS_STEP = 10.0 / DAY_S, 5e-5
# A unit's factor to s -> how many decimals it has down to 1 ns.
_DECIMALS = {1.0: 9, 1e-3: 6, 1e-6: 3, 1e-9: 0}
# From here on [s] float64 does not hold nanoseconds; up to here 64 bits do.
_FIRST, _LAST = 2.0**53 / NS, 2.0**63 / NS
# Bytes of the longest stamp: digits, a point, a sign.
_WIDEST = 24
# What may stand behind a number: blank, tab, line ends, separators.
_AFTER_CELL = np.frombuffer(b" \t\r\n,;|", dtype=np.uint8)


def two_readings(stamps: FloatArray, factor: float) -> str:
    """Both readings of a clock that may be in days or in the unit of `factor` [s]; empty where only that one is likely.

    `stamps` (n,) are all of the column; those that are missing are passed over. The step is the mean of the middle
    half: stamps with four decimals repeat, and one at an edge may be wild. A clock above 20 kHz that has run for so
    long that it looks like a date of 2000 to 2100 cannot be distinguished from one in days.
    """
    known = stamps[np.isfinite(stamps)]
    if len(known) < 2 or not _FIRST_DAY < np.median(known) < _LAST_DAY:
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
    """Seconds since 1970 of a day as Excel counts it."""
    return (days - _DAY_1970) * DAY_S


def exact_differences(
    dialect: Dialect, rows: Rows, column: int, stamps: FloatArray, factor: float
) -> tuple[FloatArray, float] | None:
    """Stamps (n,) less the first of them, in the column's own unit, and that one [s]; None where float64 holds them.

    A wild stamp is not the first. `factor` leads to s. A stamp that is written in another way than as plain digits (in
    quotes, with an exponent) is taken as float64 has it; a missing one is NaN.
    """
    known = np.isfinite(stamps)
    decimals = _DECIMALS.get(factor)
    if decimals is None or not known.any():
        return None
    first_row = count_leading_strays(stamps[known], EPOCH / factor)
    if not _is_large(stamps[known] * factor, first_row):
        return None
    scale = 10**decimals
    whole = np.rint(stamps[known])
    exact = np.zeros(len(stamps), dtype=np.int64)
    exact[known] = whole.astype(np.int64) * scale + np.rint((stamps[known] - whole) * scale).astype(np.int64)
    for first, ticks, read in _cells(dialect, rows, column, decimals):
        place = slice(first, first + len(ticks))
        # What is far from the number that stands there was another cell: a separator in quotes came before it.
        same = read & known[place]
        same[same] = np.abs(ticks[same] / scale - stamps[place][same]) <= 4.0 * np.spacing(stamps[place][same])
        exact[place][same] = ticks[same]
    start = int(exact[known][first_row])
    differences = np.full(len(stamps), np.nan)
    differences[known] = (exact[known] - start) / scale
    return differences, start / NS


def _is_large(seconds: FloatArray, first: int) -> bool:
    return bool(seconds[first] > _FIRST and np.all(np.abs(seconds) < _LAST))


def _cells(dialect: Dialect, rows: Rows, column: int, decimals: int) -> Iterator[tuple[int, Integers, BoolArray]]:
    """Block by block the number of its first row, its cells in 1 / 10^decimals, and which of them are plain digits."""
    line_end = dialect.text.line_end
    line, row = dialect.first_line, 0
    for block, size in dialect.text.blocks(dialect.offset):
        if dialect.blank_is_missing:
            block, size, _ = filled(block, size, line_end)
        data = np.frombuffer(block, dtype=np.uint8)
        ends = np.flatnonzero(data[: size + 1] == line_end[0])  # one behind it stands in for the one that lacks
        ends = ends[: np.searchsorted(ends, size - 1) + 1]
        starts = np.concatenate(([0], ends[:-1] + 1))
        kept = ~np.isin(line + np.arange(len(starts)), rows.not_rows)
        kept[np.cumsum(kept) > rows.count - row] = False
        begin = _begin(data[:size], starts[kept], dialect.separator, column)
        yield row, *_ticks(data, begin, ord(dialect.marks.decimal), decimals)
        line, row = line + len(starts), row + len(begin)


def _begin(data: Bytes, starts: Integers, separator: str, column: int) -> Integers:
    """Where the cells of a column begin in the lines that begin at `starts`; one that has none gets the data's end."""
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
    """Digits with at most one decimal mark as whole numbers of 1 / 10^decimals; which cells hold nothing else."""
    ticks = np.zeros(len(begin), dtype=np.int64)
    places = np.full(len(begin), -1)  # digits behind the mark; -1: it has not come
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
