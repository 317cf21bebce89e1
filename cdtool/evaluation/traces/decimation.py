"""Min-max decimation to the pixels of a plot: a spike of one sample stays visible, a million samples draw fast."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from cdtool.errors import UsageError
from cdtool.recording import BoolArray, FloatArray

IndexArray = npt.NDArray[np.intp]


def decimate(time: FloatArray, values: FloatArray, pixels: int) -> tuple[FloatArray, FloatArray]:
    """At most 4 * pixels samples of `values` (n,) that draw alike; short series are returned as they are.

    Kept are the first and the last sample, and of each column of pixels its least and largest value and one NaN where
    there is one: a gap stays a gap. `time` increases strictly. Raises UsageError for fewer than 2 pixels.
    """
    kept = kept_samples(time, values, pixels)
    return time[kept], values[kept]


def kept_samples(time: FloatArray, values: FloatArray, pixels: int) -> IndexArray:
    """The indices that `decimate` keeps, in order of time."""
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
    """The first marked sample of each column of pixels that has one."""
    at = np.flatnonzero(mark)
    first = np.ones(len(at), dtype=bool)
    first[1:] = column[at[1:]] != column[at[:-1]]
    return at[first]
