"""The values of a channel on another clock: the last sample at or before each time, never a later one."""

from __future__ import annotations

import math

import numpy as np

from cdtool.clock.recent_steps import usual_steps
from cdtool.kernels import READ_ONLY, kernel
from cdtool.recording import FloatArray, Series

# A held value older than this many periods of its channel is missing.
HOLD_PERIODS = 5.0
# So many samples are passed one by one before the next sample is searched for.
_ONE_BY_ONE = 8

# The signatures of the values (n, J) of a channel, and of marks of them.
READ_TABLE = "Array(float64, 2, 'C', readonly=True)"
READ_MARKS = "Array(b1, 2, 'C', readonly=True)"


def previous_value(series: Series, clock: FloatArray) -> FloatArray:
    """Return the last sample at or before each time of `clock` [s] (m, J); NaN if it is missing or too old."""
    if is_on_clock(series, clock):
        return series.values
    held = np.empty((len(clock), series.joint_count))
    _fill_previous(series.time, series.values, usual_steps(series.time), np.ascontiguousarray(clock), held)
    return held


def is_on_clock(series: Series, clock: FloatArray) -> bool:
    """Return whether a channel has exactly the times of `clock` [s]."""
    time = series.time
    if time is clock or len(time) != len(clock):
        return time is clock
    return len(time) == 0 or bool(time[0] == clock[0] and np.array_equal(time, clock))


@kernel(f"int64({READ_ONLY}, float64, int64, int64)")
def _search(time: FloatArray, now: float, low: int, high: int) -> int:
    """Return the last index from `low` to below `high` with time <= now, or `low` if every one is later."""
    while high - low > 1:
        middle = (low + high) // 2
        if time[middle] <= now:
            low = middle
        else:
            high = middle
    return low


@kernel(f"int64({READ_ONLY}, float64, int64)")
def newest_at(time: FloatArray, now: float, at: int) -> int:
    """Return the index of the last sample with time <= now, -1 before the first one; `at`: that of the query before."""
    if at >= 0 and now < time[at]:
        return int(_search(time, now, -1, at))
    for _ in range(_ONE_BY_ONE):
        if at + 1 >= len(time) or time[at + 1] > now:
            return at
        at += 1
    return int(_search(time, now, at, len(time)))


@kernel(f"b1({READ_ONLY}, {READ_ONLY}, float64, int64)")
def is_held(time: FloatArray, usual: FloatArray, now: float, at: int) -> bool:
    """Return whether the sample `at` is held until `now`, by the `usual` step (n,) of its channel."""
    return at >= 0 and not now - time[at] > HOLD_PERIODS * usual[at]


@kernel(f"void({READ_ONLY}, {READ_TABLE}, {READ_ONLY}, {READ_ONLY}, float64[:, ::1])")
def _fill_previous(
    time: FloatArray, values: FloatArray, usual: FloatArray, clock: FloatArray, held: FloatArray
) -> None:
    at = -1
    for k in range(len(clock)):
        at = newest_at(time, clock[k], at)
        if is_held(time, usual, clock[k], at):
            for j in range(values.shape[1]):
                held[k, j] = values[at, j]
        else:
            for j in range(values.shape[1]):
                held[k, j] = math.nan
