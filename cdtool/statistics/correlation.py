"""The correlation of two short series, without the cost of a general covariance matrix."""

from __future__ import annotations

import math

import numpy as np

from cdtool.base.arrays import FloatArray


def correlation(a: FloatArray, b: FloatArray) -> float:
    """Return the correlation coefficient of two series.

    Parameters
    ----------
    a, b : ndarray of float, shape (n,)
        The series; no value is missing.

    Returns
    -------
    float
        From -1 to 1; NaN if a series is constant, but for rounding errors, or has fewer than two values.

    Notes
    -----
    r = sum (a - mean a)(b - mean b) / sqrt(sum (a - mean a)^2 sum (b - mean b)^2) (Pearson 1895), in the operations of
    `numpy.corrcoef`, whose result has the same bits where neither series is constant.

    Examples
    --------
    >>> import numpy as np
    >>> correlation(np.array([1.0, 2.0, 4.0]), np.array([-1.0, -2.0, -4.0]))
    -1.0
    """
    if len(a) < 2:
        return math.nan
    pair = np.array((a, b), dtype=np.float64)
    rounding = 4.0 * np.finfo(np.float64).eps * np.abs(pair).max(axis=1)
    pair -= np.add.reduce(pair, axis=1, keepdims=True) / len(a)
    products = np.dot(pair, pair.T)
    products *= 1.0 / (len(a) - 1)
    (of_a, shared), (_, of_b) = products.tolist()
    if not (math.sqrt(of_a) > rounding[0] and math.sqrt(of_b) > rounding[1]):
        return math.nan
    return float(max(-1.0, min(shared / math.sqrt(of_a) / math.sqrt(of_b), 1.0)))
