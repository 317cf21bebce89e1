"""The times of samples whose clock is coarser than they are: 1 kHz under stamps of 10 ms, say."""

from __future__ import annotations

import math

import numpy as np

from cdtool.kernels import READ_ONLY, kernel
from cdtool.recording import BoolArray, FloatArray

# The stamp step, and the period of samples, are medians of this many steps before: the rate so far, not a later one.
RECENT_STEPS = 9
# A stamp step longer than this many usual ones holds a pause.
_PAUSE = 1.5
# After so many changes of the stamp the fit has mostly forgotten one: sample clock and stamp clock drift.
_MEMORY = 100.0
# A sample of which the line says that its stamp should have changed so many stamp steps ago is one of a stuck clock.
_STUCK = 1.0
# Where the line goes back, times go on by this share of a period until it has come up with them.
_CREEP = 0.5


def line_through(stamps: FloatArray) -> tuple[FloatArray, BoolArray]:
    """Times (n,) [s] of stamps (n,) [s] that never decrease and of which two differ at least; and those that are kept.

    A stamp is the last tick of its clock, so that its first sample lies at most one period behind it. The times are the
    line through (index, stamp) of the first samples of the stamps so far: least squares, recursive, with the weight
    1 - 1/100 from one change of the stamp to the next. The line restarts where it is off by more than a stamp step
    (the median of the last 9): after a pause with its slope, else with a new one. A sample lies within a stamp step
    of the line where the stamp changes, and never more than two from its stamp: what would is not kept, its clock is
    stuck. With a clock that rounds, all times are half a stamp step late.

    Where nothing before gives a time, what comes next does: the start of the log is placed by the next two changes of
    the stamp, the samples of the first stamp after a pause by the next change. No other time depends on a later stamp.
    """
    changes = np.flatnonzero(np.diff(stamps) > 0.0) + 1
    first = np.concatenate(([0], changes))
    distinct = np.ascontiguousarray(stamps[first])
    counts = np.diff(np.concatenate((first, [len(stamps)]))).astype(np.float64)
    steps = np.diff(distinct)
    usual = float(steps[:2].min())
    step = np.concatenate(([usual], recent_medians(steps, usual)))
    time = np.full(len(stamps), np.nan)
    _follow(distinct, counts, step, time)
    return time, np.isfinite(time)


def recent_medians(steps: FloatArray, before: float) -> FloatArray:
    """(n,) at each step the median of the last 9 up to it; the steps before the first are taken to be `before`."""
    padded = np.concatenate((np.full(RECENT_STEPS - 1, before), steps))
    medians: FloatArray = np.median(np.lib.stride_tricks.sliding_window_view(padded, RECENT_STEPS), axis=1)
    return medians


@kernel(f"float64({READ_ONLY}, {READ_ONLY}, {READ_ONLY})")
def _first_period(stamps: FloatArray, counts: FloatArray, step: FloatArray) -> float:
    """The sample period of the first stamps: the log may begin within one, which then has too few samples."""
    period = math.inf
    for i in range(min(2, len(stamps) - 1)):
        if stamps[i + 1] - stamps[i] <= _PAUSE * step[0]:
            period = min(period, (stamps[i + 1] - stamps[i]) / counts[i])
    if len(stamps) == 2:
        period = min(period, step[0] / counts[1])
    return period


@kernel(f"float64({READ_ONLY}, {READ_ONLY}, {READ_ONLY}, int64, float64)")
def _anchor(stamps: FloatArray, counts: FloatArray, step: FloatArray, i: int, period: float) -> float:
    """The time of the first sample of stamp i where a line begins: counted back from the next change of the stamp."""
    if i + 1 == len(stamps) or stamps[i + 1] - stamps[i] > _PAUSE * step[i]:
        return float(stamps[i])
    return float(min(max(stamps[i + 1] - counts[i] * period, stamps[i]), stamps[i] + step[i]))


@kernel(f"void({READ_ONLY}, {READ_ONLY}, {READ_ONLY}, float64[:])")
def _follow(stamps: FloatArray, counts: FloatArray, step: FloatArray, time: FloatArray) -> None:
    """Recursive least squares over the changes of the stamp; `time` stays NaN where a sample is not kept.

    The covariance (a, b; b, c) of the line's value and slope is in units of the variance of one change, which lies
    anywhere within a period.
    """
    period = _first_period(stamps, counts, step)
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
                keep = 1.0 - 1.0 / _MEMORY
                a, b, c = (a + taken * (2.0 * b + taken * c)) / keep, (b + taken * c) / keep, c / keep
                weight, slope_weight = a / (1.0 + a), b / (1.0 + a)
                value += weight * off
                period += slope_weight * off
                a, b, c = a * (1.0 - weight), b * (1.0 - weight), c - slope_weight * b
                if period <= 0.0:
                    period = width / taken
        for j in range(int(counts[i])):
            now = max(value + j * period, last + _CREEP * period)
            if now - stamps[i] <= (1.0 + _STUCK) * step[i] and now > last:
                time[k] = now
                last = now
            k += 1
