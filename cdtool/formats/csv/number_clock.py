"""Clocks of numbers: days as counted by Excel, and stamps with more digits than float64 can represent.

45231.5417 days since 1899-12-30 are 2023-11-01 13:00. Stamps such as 1700000000123456789 ns or 1700000000.123456789 s
count from 1970. They are read a second time, as whole nanoseconds, and the first stamp is subtracted before anything is
rounded: float64 represents the stamps with a resolution of 0.24 us only, but their differences exactly.
"""

from __future__ import annotations

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.plain_text import digits
from cdtool.formats.csv.cell_values import RequestedColumns
from cdtool.formats.csv.rows import RowReader
from cdtool.formats.csv.stamps import MISSING_STAMP, NS
from cdtool.formats.csv_dialect.dialect import Dialect
from cdtool.recordings.clock.stamps import EPOCH, count_leading_strays

# Days since 1899-12-30, as counted by Excel, of 1970-01-01, and of the start of the years 2000 and 2100.
_DAY_1970, _FIRST_DAY, _LAST_DAY = 25569.0, 36526.0, 73051.0
DAY_S = 86400.0
# A clock in days steps by less than 10 s [days]; a clock that steps by less than this in seconds samples above 20 kHz.
_DAYS_STEP, _SECONDS_STEP = 10.0 / DAY_S, 5e-5
# A unit's factor to s -> its decimals down to 1 ns.
_DECIMALS = {1.0: 9, 1e-3: 6, 1e-6: 3, 1e-9: 0}
# Above _FIRST [s] float64 cannot represent nanoseconds; up to _LAST [s] 64-bit integers can.
_FIRST, _LAST = 2.0**53 / NS, 2.0**63 / NS


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
    dialect: Dialect, column: int, stamps: FloatArray, factor: float
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
    reader = RowReader(dialect, RequestedColumns((), whole=(column,), decimals=decimals), survey=True)
    ticks = np.concatenate([rows.whole[column] for rows in reader.pieces()])[: len(stamps)]
    plain = ticks != MISSING_STAMP
    exact[plain] = ticks[plain]
    start = int(exact[known][first_row])
    differences = np.full(len(stamps), np.nan)
    differences[known] = (exact[known] - start) / scale
    return differences, start / NS


def _is_large(seconds: FloatArray, first: int) -> bool:
    return bool(seconds[first] > _FIRST and np.all(np.abs(seconds) < _LAST))
