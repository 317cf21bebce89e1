"""Missing samples of a load cell: what is a hole in the force, and what only the rhythm of its clock.

Conventions: times in s. A step between two samples is a hole if it is longer than 5 ms and than the clock makes it with
one sample lost: 2.5 periods, or with jitter one period and 1.1 times the step that one in 20 exceeds. 5 ms is the
interval of a force meter of 200 Hz, the slowest that door standards allow (EN 12445): samples that are closer together
hide nothing from it.
"""

from __future__ import annotations

import numpy as np

from cdtool.recording import FloatArray

CLOSE_ENOUGH = 5e-3
# A step longer than so many periods is no jitter of a regular clock: the force in it is not simply what is beside it.
PERIODS = 1.5
_ONE_LOST, _USUAL, _MORE = 2.5, 0.95, 1.1
_BATCH = 5.0


def longest_step(time: FloatArray) -> float:
    """Return the longest step between samples of a load cell that is not a hole.

    Parameters
    ----------
    time : ndarray of float, shape (n,)
        Times of the samples [s].

    Returns
    -------
    float
        The step [s].

    Examples
    --------
    >>> longest_step(np.arange(1000) * 1e-3), round(longest_step(np.arange(100) * 1e-2), 6)
    (0.005, 0.025)
    """
    if len(time) < 2:
        return CLOSE_ENOUGH
    steps = np.diff(time)
    period = float(np.median(steps))
    return max(CLOSE_ENOUGH, _ONE_LOST * period, period + _MORE * float(np.quantile(steps, _USUAL)))


def batch_length(time: FloatArray) -> float:
    """Return how far a stamp may be behind its sample if samples are stamped in batches [s]; else 0.

    In batches the step that one in 20 exceeds is many times the usual one.
    """
    if len(time) < 2:
        return 0.0
    steps = np.diff(time)
    long = float(np.quantile(steps, _USUAL))
    return long if long > _BATCH * float(np.median(steps)) else 0.0


def time_to_shoulder(time: FloatArray, force: FloatArray, period: float) -> float:
    """Return how long after its first sample a contact's force stops rising as it did at first [s].

    `force` (n,) [N] is relative to the rest level, positive if it presses, from the onset. It stops where over 5 ms, or
    three periods, it rises by less than a quarter of its steepest rise so far. A touch of the same two bodies takes at
    least about twice as long, however fast they meet: stiffness and mass are the same.
    """
    span = max(CLOSE_ENOUGH, 3.0 * period)
    after = np.searchsorted(time, time + span)
    known = after < len(time)
    rise = (force[after[known]] - force[known]) / (time[after[known]] - time[known])
    flat = np.flatnonzero(rise < 0.25 * np.maximum.accumulate(rise)) if len(rise) else np.empty(0)
    return float(time[int(flat[0])] - time[0]) if len(flat) else 0.0
