"""Min-max decimation to the pixels of a plot: a spike of one sample stays visible, a million samples draw fast."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.base.errors import UsageError
from cdtool.base.kernels import READ_ONLY, kernel

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
    kept = np.zeros(len(time), dtype=np.bool_)
    mark_kept(time, values, pixels, kept)
    return np.flatnonzero(kept)


def mark_kept(time: FloatArray, values: FloatArray, pixels: int, kept: BoolArray) -> None:
    """Mark the samples that `decimate` keeps in addition to those that are marked in `kept` (n,)."""
    if pixels < 2:
        raise UsageError(f"pixels is {pixels}", "a plot is at least 2 pixels wide")
    if len(time) <= 4 * pixels:
        kept[:] = True
        return
    _mark_extremes(*(np.ascontiguousarray(item, dtype=np.float64) for item in (time, values)), pixels, kept)


@kernel(f"void({READ_ONLY}, {READ_ONLY}, int64, b1[::1])", exact=True)
def _mark_extremes(time: FloatArray, values: FloatArray, pixels: int, kept: BoolArray) -> None:
    """Mark the ends of a curve, and the first smallest, largest and missing value of each column of pixels."""
    kept[0] = kept[-1] = True
    width = (time[-1] - time[0]) / pixels
    k = 0
    for column in range(1, pixels + 1):
        edge = column * width + time[0]
        least = greatest = missing = -1
        while k < len(time) and (column == pixels or time[k] < edge):
            if np.isnan(values[k]):
                missing = k if missing < 0 else missing
            else:
                if least < 0 or values[k] < values[least]:
                    least = k
                if greatest < 0 or values[k] > values[greatest]:
                    greatest = k
            k += 1
        for found in (least, greatest, missing):
            if found >= 0:
                kept[found] = True
