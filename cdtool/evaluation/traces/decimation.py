"""Min-max decimation to the pixels of a plot: a spike of one sample stays visible, a million samples draw fast."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from cdtool.errors import UsageError
from cdtool.recording import BoolArray, FloatArray

IndexArray = npt.NDArray[np.intp]


def decimate(time: FloatArray, values: FloatArray, pixels: int) -> tuple[FloatArray, FloatArray]:
    """Decimate a curve to the pixels of a plot, without losing a spike.

    Parameters
    ----------
    time : ndarray of float, shape (n,)
        Strictly increasing times [s].
    values : ndarray of float, shape (n,)
        The curve, in any unit; NaN is a gap.
    pixels : int
        Width of the plot.

    Returns
    -------
    time, values : ndarray of float, shape (m,)
        At most 4 * pixels samples that look the same: the first and the last, and of each column of pixels the smallest
        and largest value and one NaN if there is one. Short series are returned unchanged.

    Raises
    ------
    UsageError
        There are fewer than 2 pixels.

    Examples
    --------
    >>> time, values = np.arange(100_000.0), np.zeros(100_000)
    >>> values[54_321] = 9.0
    >>> at, drawn = decimate(time, values, pixels=100)
    >>> len(at) <= 400, at[drawn == 9.0].tolist()
    (True, [54321.0])
    """
    kept = kept_samples(time, values, pixels)
    return time[kept], values[kept]


def kept_samples(time: FloatArray, values: FloatArray, pixels: int) -> IndexArray:
    """Return which samples of a curve `decimate` keeps.

    Parameters
    ----------
    time : ndarray of float, shape (n,)
        Strictly increasing times [s].
    values : ndarray of float, shape (n,)
        The curve; NaN is a gap.
    pixels : int
        Width of the plot.

    Returns
    -------
    ndarray of int, shape (m,)
        Their indices, in order of time.

    Raises
    ------
    UsageError
        There are fewer than 2 pixels.

    Examples
    --------
    >>> kept_samples(np.arange(3.0), np.zeros(3), pixels=100).tolist()
    [0, 1, 2]
    """
    if pixels < 2:
        raise UsageError(f"pixels is {pixels}", "a plot is at least 2 pixels wide")
    if len(time) <= 4 * pixels:
        return np.arange(len(time))
    edges = np.searchsorted(time, np.linspace(time[0], time[-1], pixels + 1)[1:-1])
    starts = np.unique([0, *edges.tolist()])
    starts = starts[starts < len(time)]
    column = np.repeat(np.arange(len(starts)), np.diff([*starts.tolist(), len(time)]))
    missing = np.isnan(values)
    low, high = np.where(missing, np.inf, values), np.where(missing, -np.inf, values)
    least, greatest = np.minimum.reduceat(low, starts), np.maximum.reduceat(high, starts)
    marks = (~missing & (low == least[column]), ~missing & (high == greatest[column]), missing)
    ends = np.array([0, len(time) - 1])
    return np.unique(np.concatenate([ends, *(_first_of_each(mark, column) for mark in marks)]))


def _first_of_each(mark: BoolArray, column: IndexArray) -> IndexArray:
    """Return the first marked sample of each column of pixels that has one."""
    at = np.flatnonzero(mark)
    first = np.ones(len(at), dtype=bool)
    first[1:] = column[at[1:]] != column[at[:-1]]
    return at[first]
