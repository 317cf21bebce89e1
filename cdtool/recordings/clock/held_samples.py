"""The values of a channel on another clock: the last sample at or before each time, never a later one."""

from __future__ import annotations

import numpy as np

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.recordings.clock.recent_steps import usual_steps
from cdtool.recordings.recording import Series

# A held value older than this many periods of its channel is missing.
HOLD_PERIODS = 5.0


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
        Where the channel has no value at a time, the result is NaN.

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
    if not len(series):
        return np.full((len(clock), series.joint_count), np.nan)
    at = np.searchsorted(series.time, clock, side="right") - 1
    old = clock - series.time[at] > HOLD_PERIODS * usual_steps(series.time)[at]
    values = series.values[at]
    values[(at < 0) | old] = np.nan
    return values


def hold_last(values: FloatArray, missing: BoolArray) -> FloatArray:
    """Hold the last present value where one is missing.

    Parameters
    ----------
    values : ndarray of float, shape (n, J)
        Values, in any unit.
    missing : ndarray of bool, shape (n, J)
        Where a value is missing.

    Returns
    -------
    ndarray of float, shape (n, J)
        The values; 0 before the first present one. Without a missing value it is `values` itself, not a copy.

    Examples
    --------
    >>> import numpy as np
    >>> values = np.array([[np.nan], [2.0], [np.nan], [3.0]])
    >>> hold_last(values, np.isnan(values))[:, 0].tolist()
    [0.0, 2.0, 2.0, 3.0]
    """
    if not missing.any():
        return values
    last = np.maximum.accumulate(np.where(missing, 0, np.arange(len(values))[:, np.newaxis]), axis=0)
    started = np.logical_or.accumulate(~missing, axis=0)
    return np.where(started, np.take_along_axis(values, last, axis=0), 0.0)


def is_on_clock(series: Series, clock: FloatArray) -> bool:
    """Return whether a channel has exactly the times of `clock` [s]."""
    time = series.time
    if time is clock or len(time) != len(clock):
        return time is clock
    return len(time) == 0 or bool(time[0] == clock[0] and np.array_equal(time, clock))
