"""First-order filters for any sampling: the trend of a signal, and a low-pass."""

from __future__ import annotations

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.kernels import READ_ONLY, kernel


def filtered_slope(values: FloatArray, step: FloatArray, time_constant: float) -> FloatArray:
    """Return s / (1 + s tau) of `values` (m,): their trend, per s; `step` (m,) s is infinite where the filter starts.

    y_k = a y_{k-1} + (1 - a) (i_k - i_{k-1}) / T_k, a = exp(-T_k / tau): exact for a signal that is a straight line
    between two samples, for any T_k. Times tau it is the high-pass s tau / (1 + s tau).
    """
    going = np.isfinite(step)
    keep = np.where(going, np.exp(-step / time_constant), 0.0)
    slope = np.zeros(len(values))
    slope[1:] = np.where(going[1:], np.diff(values) / step[1:], 0.0)
    return recursion(keep, (1.0 - keep) * slope)


def low_passed(values: FloatArray, step: FloatArray, time_constant: float) -> FloatArray:
    """Return 1 / (1 + s tau) of `values` (m,), starting at the first value.

    y_k = a y_{k-1} + (1 - a) (u_k + u_{k-1}) / 2, a = exp(-T_k / tau).
    """
    going = np.isfinite(step)
    keep = np.where(going, np.exp(-step / time_constant), 0.0)
    mean = values.copy()
    mean[1:] = np.where(going[1:], 0.5 * (values[1:] + values[:-1]), values[1:])
    return recursion(keep, (1.0 - keep) * mean)


def recursion(keep: FloatArray, drive: FloatArray) -> FloatArray:
    """Return y_k = forget_k y_{k-1} + drive_k (m,), from y = 0."""
    result = np.empty(len(drive))
    _recursion(np.ascontiguousarray(keep), np.ascontiguousarray(drive), result)
    return result


@kernel(f"void({READ_ONLY}, {READ_ONLY}, float64[::1])")
def _recursion(keep: FloatArray, drive: FloatArray, result: FloatArray) -> None:
    y = 0.0
    for k in range(len(drive)):
        y = keep[k] * y + drive[k]
        result[k] = y
