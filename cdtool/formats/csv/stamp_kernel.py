"""Read a date, a time of day or both from bytes as nanoseconds, by a program of fields and letters (see stamps.py)."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from cdtool.formats.csv.digits_kernel import BYTES, Bytes
from cdtool.formats.csv.number_kernel import NOT_A_NUMBER, letters
from cdtool.kernels import kernel

Programs = npt.NDArray[np.int64]
PROGRAMS = "Array(int64, 2, 'C', readonly=True)"
PROGRAM = "Array(int64, 1, 'C', readonly=True)"
# Steps of a program: a letter (above 0) that must follow, the end (0), or a field (below 0).
YEAR, SHORT_YEAR, MONTH, DAY, HOUR, MINUTE, SECOND = -1, -2, -3, -4, -5, -6, -7
POINT_FRACTION, FRACTION, ZONE, MONTH_NAME, HALF_DAY, DATE_GAP = -8, -9, -10, -11, -12, -13
STEPS = 32
_NS = 1_000_000_000
_MONTHS = tuple(
    int.from_bytes(name)
    for name in (b"jan", b"feb", b"mar", b"apr", b"may", b"jun", b"jul", b"aug", b"sep", b"oct", b"nov", b"dec")
)
_MONTH_DAYS = (31, 29, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31)


@kernel(f"UniTuple(int64, 2)({BYTES}, int64, int64, int64)")
def _digits(data: Bytes, at: int, fewest: int, most: int) -> tuple[int, int]:
    """Return a number of `fewest` to `most` digits and its end, or -1."""
    value: Any = 0
    p = at
    while p - at < most and 48 <= data[p] <= 57:
        value = 10 * value + np.int64(data[p]) - 48
        p += 1
    return (value, p) if p - at >= fewest else (0, -1)


@kernel(f"UniTuple(int64, 2)({BYTES}, int64)")
def _fraction(data: Bytes, at: int) -> tuple[int, int]:
    """Return a fraction of a second as nanoseconds (more digits are dropped) and its end, or -1."""
    value: Any = 0
    p = at
    while 48 <= data[p] <= 57:
        if p - at < 9:
            value = 10 * value + np.int64(data[p]) - 48
        p += 1
    for _ in range(9 - (p - at)):
        value *= 10
    return value, p if p > at else -1


@kernel(f"UniTuple(int64, 2)({BYTES}, int64)")
def _zone(data: Bytes, at: int) -> tuple[int, int]:
    """Return the offset [s] east of UTC (Z, +hh, +hhmm, +hh:mm) and its end, or -1."""
    p = at
    if data[p] == 32:
        p += 1
    if data[p] | 32 == 122:
        return 0, p + 1
    if data[p] == 85 and data[p + 1] == 84 and data[p + 2] == 67:
        return 0, p + 3
    if data[p] != 43 and data[p] != 45:
        return 0, -1
    west = data[p] == 45
    hours, p = _digits(data, p + 1, 2, 2)
    if p < 0:
        return 0, -1
    minutes = 0
    if data[p] == 58 or 48 <= data[p] <= 57:
        minutes, p = _digits(data, p + 1 if data[p] == 58 else p, 2, 2)
    seconds = 3600 * hours + 60 * minutes
    return (-seconds if west else seconds), p


@kernel("int64(int64, int64, int64)")
def _days(year: int, month: int, day: int) -> int:
    """Return the days since 1970-01-01 in the Gregorian calendar (years start in March)."""
    shifted = year - (month <= 2)
    era = shifted // 400
    of_era = shifted - 400 * era
    of_year = (153 * ((month + 9) % 12) + 2) // 5 + day - 1
    return era * 146097 + of_era * 365 + of_era // 4 - of_era // 100 + of_year - 719468


@kernel(f"UniTuple(int64, 2)({BYTES}, int64, {PROGRAM})")
def read_stamp(data: Bytes, at: int, program: npt.NDArray[np.int64]) -> tuple[int, int]:
    """Return the nanoseconds since 1970-01-01 (for a time of day since midnight) and the end, or NOT_A_NUMBER."""
    year, month, day, hour, minute, second, nano, east, half = 1970, 1, 1, 0, 0, 0, 0, 0, -1
    p = at
    for step in program:
        if step == 0:
            break
        if step > 0:
            p = p + 1 if data[p] == step else -1
        elif step == YEAR:
            year, p = _digits(data, p, 4, 4)
        elif step == SHORT_YEAR:
            year, p = _digits(data, p, 2, 2)
            year += 2000 if year < 69 else 1900
        elif step == MONTH:
            month, p = _digits(data, p, 1, 2)
        elif step == DAY:
            day, p = _digits(data, p, 1, 2)
        elif step == HOUR:
            hour, p = _digits(data, p, 1, 2)
        elif step == MINUTE:
            minute, p = _digits(data, p, 2, 2)
        elif step == SECOND:
            second, p = _digits(data, p, 2, 2)
        elif step == POINT_FRACTION:
            if data[p] == 46 or data[p] == 44:
                nano, p = _fraction(data, p + 1)
        elif step == FRACTION:
            nano, p = _fraction(data, p)
        elif step == ZONE:
            east, p = _zone(data, p)
        elif step == MONTH_NAME:
            name = letters(data, p, 3)
            month = 0
            for i, known in enumerate(_MONTHS):
                if name == known:
                    month = i + 1
            p += 3
        elif step == HALF_DAY:
            p = p + 1 if data[p] == 32 else p
            letter = np.int64(data[p]) | 32
            half = 0 if letter == 97 else 12 if letter == 112 else -2
            p = p + 2 if np.int64(data[p + 1]) | 32 == 109 else -1
        elif step == DATE_GAP:
            q = p
            while data[q] == 32:
                q += 1
            p = q if q > p else p + 1 if data[p] | 32 == 116 else -1
        if p < 0:
            return 0, NOT_A_NUMBER
    if month < 1 or month > 12 or day < 1 or hour > 23 or minute > 59 or second > 59 or half == -2:
        return 0, NOT_A_NUMBER
    leap = year % 4 == 0 and (year % 100 != 0 or year % 400 == 0)
    if day > _MONTH_DAYS[month - 1] or (month == 2 and day == 29 and not leap):
        return 0, NOT_A_NUMBER
    if half >= 0:
        if hour < 1 or hour > 12:
            return 0, NOT_A_NUMBER
        hour = hour % 12 + half
    if year < 1680 or year > 2260:
        return 0, NOT_A_NUMBER  # out of the range of nanoseconds in 64 bits
    seconds = _days(year, month, day) * 86400 + hour * 3600 + minute * 60 + second - east
    return seconds * _NS + nano, p
