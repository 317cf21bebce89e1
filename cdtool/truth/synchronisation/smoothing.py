"""A signal with gaps and an irregular clock as smooth values on a grid: by local polynomials with Gaussian weights.

Where samples are regular, the local fit of the n-th derivative is exactly the n-th derivative of the signal smoothed by
the Gaussian. Two channels of which one is the derivative of the other are therefore smoothed alike, without a delay
between them, although their clocks and rates differ.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cdtool.base.arrays import FloatArray

IntArray = npt.NDArray[np.int_]

# The kernel ends so many widths from its centre.
REACH = 3.5
# A grid has two points per width: the spectrum of a Gaussian ends far below its Nyquist frequency.
POINTS_PER_WIDTH = 2.0
# Weights that are computed at once.
_BLOCK = 1 << 19


@dataclass(frozen=True)
class Grid:
    """Equidistant times `start + k step` [s], k = 0 to `count` - 1."""

    start: float
    step: float
    count: int

    @property
    def times(self) -> FloatArray:
        """Return the times (count,) [s]."""
        return np.asarray(self.start + self.step * np.arange(self.count), dtype=np.float64)

    @classmethod
    def over(cls, start: float, end: float, step: float) -> Grid:
        """Return the grid from `start` to `end` [s] whose points are multiples of `step` [s]."""
        first, last = math.ceil(start / step), math.floor(end / step)
        return cls(first * step, step, max(last - first + 1, 0))


def local_derivative(time: FloatArray, values: FloatArray, at: FloatArray, width: float, order: int = 0) -> FloatArray:
    """Return a signal, or its derivative of a given order, smoothed by a Gaussian.

    Parameters
    ----------
    time : ndarray of float, shape (n,)
        Strictly increasing times of the samples [s], regular or not.
    values : ndarray of float, shape (n,)
        The samples; NaN: missing.
    at : ndarray of float, shape (m,)
        Increasing times at which the result is wanted [s].
    width : float
        Standard deviation of the Gaussian [s].
    order : int, optional
        0: the signal; 1, 2: its derivatives.

    Returns
    -------
    ndarray of float, shape (m,)
        In the unit of the values per s^order; NaN where samples are missing: with less than half of the weight of
        regular samples, or nearly all of it on one side.

    Notes
    -----
    A polynomial of degree order + 1 in t - at is fitted with the weights exp(-(t - at)^2 / (2 width^2)) (Cleveland and
    Devlin, Locally weighted regression, 1988); the result is order! times its coefficient of that order.

    Examples
    --------
    >>> import numpy as np
    >>> time = np.cumsum(np.random.default_rng(1).uniform(0.5e-3, 1.5e-3, 1000))
    >>> slope = local_derivative(time, 3.0 * time + 1.0, np.array([0.3, 0.5]), width=5e-3, order=1)
    >>> np.round(slope, 9).tolist()
    [3.0, 3.0]
    """
    known = np.isfinite(values)
    if not known.all():
        time, values = time[known], values[known]
    result = np.full(len(at), np.nan)
    if len(time) < order + 3:
        return result
    regular = width * math.sqrt(2.0 * math.pi) / float(np.median(np.diff(time)))
    first = np.searchsorted(time, at - REACH * width)
    count = np.searchsorted(time, at + REACH * width, side="right") - first
    begin = 0
    while begin < len(at):
        # As many grid points as fit into a block, whatever the density of the samples is.
        longest = np.maximum.accumulate(count[begin : begin + _BLOCK])
        fitting = int(np.searchsorted(longest * np.arange(1, len(longest) + 1), _BLOCK, side="right"))
        part = slice(begin, begin + max(fitting, 1))
        result[part] = _fitted(time, values, at[part], first[part], count[part], width, order, regular)
        begin = part.stop
    return result


def _fitted(  # noqa: PLR0913 (one block of local_derivative)
    time: FloatArray,
    values: FloatArray,
    at: FloatArray,
    first: IntArray,
    count: IntArray,
    width: float,
    order: int,
    regular: float,
) -> FloatArray:
    offsets = np.arange(max(int(count.max()), 1))
    index = np.minimum(first[:, np.newaxis] + offsets, len(time) - 1)
    distance = (time[index] - at[:, np.newaxis]) / width
    weights = np.where(offsets < count[:, np.newaxis], np.exp(-0.5 * distance**2), 0.0)
    terms = order + 2
    moments, right = np.empty((len(at), 2 * terms - 1)), np.empty((len(at), terms))
    power, found = weights.copy(), values[index]
    for p in range(2 * terms - 1):
        moments[:, p] = power.sum(axis=1)
        if p < terms:
            right[:, p] = np.einsum("ij,ij->i", power, found)
        power *= distance
    before = np.einsum("ij,ij->i", weights, (distance < 0.0).astype(np.float64))
    total = moments[:, 0]
    # Missing below half of the weight that regular samples would have, and below 15 % of it on one side.
    sound = (total >= 0.5 * regular) & (count >= order + 3)
    sound &= np.minimum(before, total - before) >= 0.15 * total
    matrix = moments[:, np.add.outer(np.arange(terms), np.arange(terms))]
    sound &= np.abs(np.linalg.det(matrix / np.maximum(total, 1e-300)[:, np.newaxis, np.newaxis])) > 1e-9
    result = np.full(len(at), np.nan)
    if sound.any():
        solved = np.linalg.solve(matrix[sound], right[sound][..., np.newaxis])[:, order, 0]
        result[sound] = solved * math.factorial(order) / width**order
    return result
