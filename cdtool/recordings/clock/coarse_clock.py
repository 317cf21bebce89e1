"""The times of samples whose clock is coarser than the sample period, for example 1 kHz with stamps every 10 ms."""

from __future__ import annotations

import math

import numpy as np

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.base.kernels import READ_ONLY, kernel
from cdtool.recordings.clock.recent_steps import recent_medians

# A stamp step longer than this many usual ones contains a pause.
_PAUSE = 1.5


def fit_line(stamps: FloatArray) -> tuple[FloatArray, BoolArray]:
    """Return the times (n,) [s] of the samples of a coarse clock, and which samples are kept (n,).

    `stamps` (n,) [s] never decrease, and at least two of them differ. A stamp is the last tick of its clock, so the
    first sample with a new stamp is at most one period after the tick. The times are on the line through (index, stamp)
    of these first samples: recursive least squares with a forgetting factor of 1 - 1/100 per stamp change. The line
    restarts if its error exceeds a stamp step (median of the last 9): after a pause with the same slope, otherwise with
    a new one. A sample is within a stamp step of the line where the stamp changes, and at most two stamp steps from its
    stamp; beyond that the clock is stuck and the sample is not kept. If the clock rounds instead of truncating, all
    times are half a stamp step late.

    Times are causal with two exceptions, where no earlier stamp determines them: the start of the log depends on the
    next two stamp changes, and the samples of the first stamp after a pause on the next one.
    """
    changes = np.flatnonzero(np.diff(stamps) > 0.0) + 1
    first = np.concatenate(([0], changes))
    distinct = np.ascontiguousarray(stamps[first])
    counts = np.diff(np.concatenate((first, [len(stamps)]))).astype(np.float64)
    steps = np.diff(distinct)
    shorter = float(steps[:2].min())
    step = np.concatenate(([shorter], recent_medians(steps, shorter)))
    time = np.full(len(stamps), np.nan)
    # The log may begin within a stamp, with too few samples: of the first two stamps, the shorter period counts.
    near = steps[:2] <= _PAUSE * shorter
    periods = steps[:2][near] / counts[: len(steps)][:2][near]
    last = [shorter / counts[1]] if len(distinct) == 2 else []
    _follow(distinct, counts, step, float(min(*periods, *last, np.inf)), time)
    return time, np.isfinite(time)


@kernel(f"float64({READ_ONLY}, {READ_ONLY}, {READ_ONLY}, int64, float64)")
def _anchor(stamps: FloatArray, counts: FloatArray, step: FloatArray, i: int, period: float) -> float:
    """Return the time of the first sample of stamp i at the start of a line, counted back from the next change."""
    if i + 1 == len(stamps) or stamps[i + 1] - stamps[i] > _PAUSE * step[i]:
        return float(stamps[i])
    return float(min(max(stamps[i + 1] - counts[i] * period, stamps[i]), stamps[i] + step[i]))


@kernel(f"void({READ_ONLY}, {READ_ONLY}, {READ_ONLY}, float64, float64[:])")
def _follow(stamps: FloatArray, counts: FloatArray, step: FloatArray, period: float, time: FloatArray) -> None:
    """Fill `time` by recursive least squares over the stamp changes; it stays NaN where a sample is not kept.

    The covariance (a, b; b, c) of the line's value and slope is in units of the variance of one stamp change, which is
    uniformly distributed over a period.
    """
    value = _anchor(stamps, counts, step, 0, period)
    a, b, c = 1.0, 0.0, 12.0 / (step[0] / period) ** 2
    last = -math.inf
    k = 0
    for i in range(len(stamps)):
        if i > 0:
            taken = counts[i - 1]
            width = stamps[i] - stamps[i - 1]
            value += period * taken
            off = stamps[i] - value
            if abs(off) > step[i]:
                a, b = 1.0, 0.0
                if width > _PAUSE * step[i] and off > 0.0:
                    value = _anchor(stamps, counts, step, i, period)
                else:
                    value = stamps[i]
                    period = width / taken
                    c = 12.0 / taken**2
            else:
                keep = 0.99  # the fit forgets within 100 changes of the stamp: it must follow the drift of both clocks
                a, b, c = (a + taken * (2.0 * b + taken * c)) / keep, (b + taken * c) / keep, c / keep
                weight, slope_weight = a / (1.0 + a), b / (1.0 + a)
                value += weight * off
                period += slope_weight * off
                a, b, c = a * (1.0 - weight), b * (1.0 - weight), c - slope_weight * b
                if period <= 0.0:
                    period = width / taken
        for j in range(int(counts[i])):
            # If the line steps back, times advance by half a period until the line has caught up.
            now = max(value + j * period, last + 0.5 * period)
            # The clock is stuck if, by the line, the stamp should have changed more than one stamp step ago.
            if now - stamps[i] <= 2.0 * step[i] and now > last:
                time[k] = now
                last = now
            k += 1
