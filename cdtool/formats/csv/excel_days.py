"""A clock of numbers that may count in days since 1899-12-30, as Excel does: 45231.5417 is 2023-11-01 13:00."""

from __future__ import annotations

import numpy as np

from cdtool.plain_text import digits
from cdtool.recording import FloatArray

# Days since 1899-12-30, as Excel counts them, of 1970; and of the years 2000 to 2100.
_DAY_1970, _FIRST, _LAST = 25569.0, 36526.0, 73051.0
DAY_S = 86400.0
# A log steps by less than this in days (10 s); and by less than this in seconds it samples above 20 kHz.
_DAYS_STEP, _SECONDS_STEP = 10.0 / DAY_S, 5e-5


def two_readings(stamps: FloatArray, factor: float) -> str:
    """Both readings of a clock that may be in days or in the unit of `factor` [s]; empty where only that one is likely.

    `stamps` (n,) are all of the column; those that are missing are passed over. The step is the mean of the middle
    half: stamps with four decimals repeat, and one at an edge may be wild. A clock above 20 kHz that has run for so
    long that it looks like a date of 2000 to 2100 cannot be distinguished from one in days.
    """
    known = stamps[np.isfinite(stamps)]
    if len(known) < 2 or not _FIRST < np.median(known) < _LAST:
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
