"""The values of a channel on another clock: the last sample at or before each time, never a later one."""

from __future__ import annotations

import math

import numpy as np

from cdtool.clock.recent_steps import RECENT_STEPS
from cdtool.kernels import READ_ONLY, kernel
from cdtool.recording import BoolArray, FloatArray, Series

# A held value older than this many periods of its channel is missing.
HOLD_PERIODS = 5.0
# So many samples are passed one by one before the next sample is searched for.
ONE_BY_ONE = 8

# The signatures of the values (n, J) of a channel, and of marks of them.
READ_TABLE = "Array(float64, 2, 'C', readonly=True)"
READ_MARKS = "Array(b1, 2, 'C', readonly=True)"


def previous_value(series: Series, clock: FloatArray) -> FloatArray:
    """Return the last sample of a channel at or before each time of a clock.

    Parameters
    ----------
    series : Series
        The channel, values (n, J).
    clock : ndarray of float, shape (m,)
        Times [s], increasing.

    Returns
    -------
    ndarray of float, shape (m, J)
        The values; NaN where there is no sample before, it is missing, or it is too old to stand for the present.

    Raises
    ------
    Nothing
        A clock outside of the channel's time gives NaN.

    Examples
    --------
    >>> import numpy as np
    >>> from cdtool import Series, previous_value
    >>> speed = Series(np.array([0.0, 0.01, 0.02]), np.array([0.1, 0.2, 0.3]), "m/s")
    >>> previous_value(speed, np.array([0.005, 0.02]))[:, 0].tolist()
    [0.1, 0.3]
    """
    if is_on_clock(series, clock):
        return series.values
    values = np.empty((len(clock), series.joint_count))
    missing = np.empty(values.shape, dtype=np.bool_)
    fill_held(series.time, series.values, np.ascontiguousarray(clock), False, values, missing)
    return values


def is_on_clock(series: Series, clock: FloatArray) -> bool:
    """Return whether a channel has exactly the times of `clock` [s]."""
    time = series.time
    if time is clock or len(time) != len(clock):
        return time is clock
    return len(time) == 0 or bool(time[0] == clock[0] and np.array_equal(time, clock))


@kernel(f"int64({READ_ONLY}, float64, int64, int64)")
def search(time: FloatArray, now: float, low: int, high: int) -> int:
    """Return the last index from `low` to below `high` with time <= now, or `low` if every one is later."""
    while high - low > 1:
        middle = (low + high) // 2
        if time[middle] <= now:
            low = middle
        else:
            high = middle
    return low


@kernel(f"float64({READ_ONLY}, int64)")
def shortest_recent_step(time: FloatArray, at: int) -> float:
    """Return the shortest of the last 9 steps up to sample `at`."""
    shortest = math.inf
    for k in range(max(at - RECENT_STEPS + 1, 1), at + 1):
        shortest = min(shortest, time[k] - time[k - 1])
    return shortest


@kernel(f"b1({READ_ONLY}, int64, float64, float64)")
def _within_median(time: FloatArray, at: int, factor: float, age: float) -> bool:
    """Return whether age <= factor * (median of the last 9 steps up to sample `at`, which is not the first).

    It is if 5 of the 9 steps are long enough. Steps before the first are assumed to equal it.
    """
    long_enough = 0
    for k in range(at - RECENT_STEPS + 1, at + 1):
        end = max(k, 1)
        long_enough += 1 if age <= factor * (time[end] - time[end - 1]) else 0
    return long_enough > RECENT_STEPS // 2


@kernel(f"void({READ_ONLY}, {READ_TABLE}, {READ_ONLY}, b1, float64[:, ::1], b1[:, ::1])")
def fill_held(
    time: FloatArray, values: FloatArray, clock: FloatArray, hold: bool, held: FloatArray, missing: BoolArray
) -> None:
    """Fill `held` (m, J) with the `values` (n, J) of samples at `time` (n,), and where one is `missing` or too old.

    What is missing is NaN, or with `hold` the last value, 0 before the first. A sample is too old after 5 times the
    median of its last 9 steps. The median is at least the `shortest` step, so that it is rarely needed.
    """
    at = -1
    shortest = math.inf
    for k in range(len(clock)):
        now = clock[k]
        if at >= 0 and now < time[at]:
            at, shortest = search(time, now, -1, at), -math.inf
        passed = 0
        while at + 1 < len(time) and time[at + 1] <= now:
            at += 1
            passed += 1
            if at > 0:
                shortest = min(shortest, time[at] - time[at - 1])
            if passed == ONE_BY_ONE:
                at, shortest = search(time, now, at, len(time)), -math.inf
        fresh = at >= 0
        if at > 0 and now - time[at] > HOLD_PERIODS * shortest:
            fresh = _within_median(time, at, HOLD_PERIODS, now - time[at])
            shortest = shortest_recent_step(time, at)
        for j in range(values.shape[1]):
            value = values[at, j] if fresh else math.nan
            missing[k, j] = not math.isfinite(value)
            held[k, j] = value
            if hold and missing[k, j]:
                held[k, j] = held[k - 1, j] if k > 0 else 0.0
