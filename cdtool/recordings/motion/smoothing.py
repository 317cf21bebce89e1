"""The mean over neighbouring grid points."""

from __future__ import annotations

from typing import Any

import numpy as np

from cdtool.base.arrays import FloatArray


def moving_mean(values: FloatArray, known: Any, reach: int) -> FloatArray:
    """Return the mean (g, J) over the known neighbours within `reach` grid points to either side; 0 without any."""
    weights = np.vstack((np.zeros((1, values.shape[1])), np.cumsum(known, axis=0)))
    totals = np.vstack((np.zeros((1, values.shape[1])), np.cumsum(np.where(known, values, 0.0), axis=0)))
    points = np.arange(len(values))
    first, last = np.maximum(points - reach, 0), np.minimum(points + reach + 1, len(values))
    number = weights[last] - weights[first]
    total = totals[last] - totals[first]
    mean: FloatArray = np.divide(total, number, out=np.zeros_like(total), where=number > 0)
    return mean
