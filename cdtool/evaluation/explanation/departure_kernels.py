"""Compiled loops of a departure: the first samples outside, and the bend where a curve leaves a straight line."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from cdtool.kernels import READ_ONLY, kernel
from cdtool.median_kernel import median_of
from cdtool.recording import FloatArray

# Two columns of a fit are the same straight line if the determinant is at most this share of its largest value.
_SINGULAR = 1e-13


@kernel(f"int64({READ_ONLY}, float64, int64)")
def first_beyond(values: FloatArray, sign: float, succession: int) -> int:
    """Return the first of `succession` consecutive samples above 1 on that side, -1 without; NaN interrupts them."""
    run = 0
    for k in range(len(values)):
        run = run + 1 if sign * values[k] > 1.0 else 0
        if run == succession:
            return k - succession + 1
    return -1


@kernel(f"float64({READ_ONLY}, float64[::1], int64)", exact=True)
def median_of_known(values: FloatArray, scratch: FloatArray, least: int) -> float:
    """Return the median of the finite values, NaN with fewer than `least`; `scratch` (n,) is overwritten."""
    count = 0
    for value in values:
        if np.isfinite(value):
            scratch[count] = value
            count += 1
    return float(median_of(scratch, count)) if count >= least else np.nan


@kernel(f"int64({READ_ONLY}, {READ_ONLY}, int64, {READ_ONLY}, int64[::1])")
def steepest_bend(
    time: FloatArray, values: FloatArray, found: int, bends: FloatArray, candidates: npt.NDArray[np.int64]
) -> int:
    """Return the candidate at whose time in `bends` [s] two joined lines fit best, the second one steeper upward.

    Least squares of a + b t + c max(t - bend, 0) with c > 0 over `time` (n,) [s] and `values` (n,); `found` if no
    candidate has c > 0. If all samples are after a bend, the solution of least norm counts, as in numpy's `lstsq`.
    """
    n = len(time)
    mean_time = np.sum(time) / max(n, 1)
    mean_value = np.sum(values) / max(n, 1)
    best = np.inf
    for i in range(len(bends)):
        mean_after = 0.0
        for k in range(n):
            mean_after += max(time[k] - bends[i], 0.0)
        mean_after /= max(n, 1)
        tt = ta = aa = ty = ay = 0.0
        for k in range(n):
            t, y = time[k] - mean_time, values[k] - mean_value
            after = max(time[k] - bends[i], 0.0) - mean_after
            tt += t * t
            ta += t * after
            aa += after * after
            ty += t * y
            ay += after * y
        determinant = tt * aa - ta * ta
        if determinant > _SINGULAR * tt * aa:
            slope, more = (ty * aa - ay * ta) / determinant, (ay * tt - ty * ta) / determinant
        elif tt > 0.0 and aa > 0.0:
            line = ty / tt
            level = mean_value - line * mean_time
            more = (line - level * bends[i]) / (bends[i] * bends[i] + 2.0)
            slope = line - more
        else:
            continue
        if not more > 0.0:
            continue
        error = 0.0
        for k in range(n):
            after = max(time[k] - bends[i], 0.0) - mean_after
            left = values[k] - mean_value - slope * (time[k] - mean_time) - more * after
            error += left * left
        if error < best:
            best, found = error, candidates[i]
    return found
