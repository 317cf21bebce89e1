"""Which samples of a load cell are missing: what is a hole in the force, and what only its clock's rhythm.

Conventions: times in s. A step between two samples is a hole where it is longer than 5 ms and than 2.5 of the cell's
periods. 5 ms is the interval of a force meter of 200 Hz, the slowest that door standards allow (EN 12445): what lies
closer together hides nothing from it. 2.5 periods are those of a clock whose stamps are off by most of a period, or of
one sample lost.
"""

from __future__ import annotations

import numpy as np

from cdtool.recording import FloatArray

CLOSE_ENOUGH = 5e-3
# A step longer than so many periods is no jitter of a regular clock: the force in it is not simply what is beside it.
PERIODS = 1.5
_AT_MOST = 2.5


def longest_step(period: float) -> float:
    """How far apart samples of a load cell may be without a hole between them [s]; `period` is the cell's [s]."""
    return max(_AT_MOST * period, CLOSE_ENOUGH) if np.isfinite(period) else CLOSE_ENOUGH


def time_to_shoulder(time: FloatArray, force: FloatArray, period: float) -> float:
    """How long after its first sample a contact's force stops rising as it did at first [s].

    `force` (n,) [N] is that over the rest level, positive where it presses, from the onset on. It stops where over
    5 ms, or three periods, it rises by less than a quarter of its steepest rise so far. A touch of the same two bodies
    takes about twice as long at least, however fast they meet: stiffness and mass are the same.
    """
    span = max(CLOSE_ENOUGH, 3.0 * period)
    after = np.searchsorted(time, time + span)
    known = after < len(time)
    rise = (force[after[known]] - force[known]) / (time[after[known]] - time[known])
    flat = np.flatnonzero(rise < 0.25 * np.maximum.accumulate(rise)) if len(rise) else np.empty(0)
    return float(time[int(flat[0])] - time[0]) if len(flat) else 0.0
