"""Clocks of MATLAB's datenum: days since the year 0, as `now` and `datenum` return them."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from cdtool.base.arrays import FloatArray
from cdtool.formats.columns import as_float64
from cdtool.formats.epoch_clock import SHORTEST_STEP
from cdtool.recordings.units import DAY_S

# The datenum of 1970-01-01, and of the start of the years 2000 and 2100.
DAY_1970, _FIRST, _LAST = 719_529, 730_486.0, 767_011.0


def is_datenum(stamps: npt.NDArray[Any]) -> bool:
    """Return whether stamps (n,) are days since the year 0, from 2000 to 2100, in the steps of a log.

    A clock in seconds above 20 kHz that starts 8.5 days after its zero cannot be distinguished from one in days.
    """
    known = as_float64(stamps)
    known = known[np.isfinite(known)]
    if len(known) < 2 or known.min() < _FIRST or known.max() > _LAST:
        return False
    steps = np.diff(known)
    steps = steps[steps > 0.0]
    return bool(len(steps) and np.median(steps) < SHORTEST_STEP)


def since_first(stamps: npt.NDArray[Any]) -> tuple[FloatArray, float]:
    """Return days as seconds since the first stamp, and the first stamp [s] since 1970."""
    days = as_float64(stamps)
    first = float(days[np.isfinite(days)][0])
    return (days - first) * DAY_S, round((first - DAY_1970) * DAY_S, 3)
