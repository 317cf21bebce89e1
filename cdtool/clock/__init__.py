"""Causal alignment of channels to a detector's clock, and the correction of faulty time stamps.

No function uses later samples: a value at time t is computed from samples at or before t. stamps.py makes the time
stamps of a log strictly increasing; coarse_clock.py does so for a clock that is coarser than the samples.
"""

from __future__ import annotations

import math

import numpy as np

from cdtool.clock.coarse_clock import recent_medians
from cdtool.clock.stamps import EPOCH, GAP_PERIODS, CleanTime, clean_time, epoch_start, gap_findings
from cdtool.kernels import READ_ONLY, kernel
from cdtool.recording import FloatArray, Series

__all__ = [
    "EPOCH",
    "GAP_PERIODS",
    "HOLD_PERIODS",
    "CleanTime",
    "clean_time",
    "differentiate",
    "epoch_start",
    "gap_findings",
    "integrate",
    "previous_value",
]

# A held value older than this many periods of its channel is missing.
HOLD_PERIODS = 5.0


def previous_value(series: Series, clock: FloatArray) -> FloatArray:
    """Return the last sample at or before each time of `clock` [s] (m, J); NaN if it is missing or too old."""
    if series.time is clock or (len(series.time) == len(clock) and np.array_equal(series.time, clock)):
        return series.values
    if not len(series.time):
        return np.full((len(clock), series.joint_count), np.nan)
    at = np.searchsorted(series.time, clock, side="right") - 1
    newest = np.maximum(at, 0)
    held = series.values[newest]
    age = clock - series.time[newest]
    # Of the times after the last one that is needed, none has an influence.
    oldest = HOLD_PERIODS * _recent_period(series.time[: newest.max(initial=0) + 1])[newest]
    return np.where(((at < 0) | (age > oldest))[:, np.newaxis], np.nan, held)


def _recent_period(time: FloatArray) -> FloatArray:
    """Return the median of the last steps [s] at each sample; infinite at the first sample."""
    period = np.full(len(time), np.inf)
    if len(time) > 1:
        steps = np.diff(time)
        period[1:] = recent_medians(steps, float(steps[0]))
    return period


def differentiate(series: Series, low_pass_hz: float, unit: str) -> Series:
    """Return the causal derivative of a position.

    It is a backward difference, filtered by two first-order low-passes at `low_pass_hz`. Across missing samples the
    difference is taken over the longer step. The first sample is NaN.
    """
    rates = np.full(series.values.shape, np.nan)
    for joint in range(series.joint_count):
        # A copy, as a Series is read-only and the kernel's signature requires a writable array.
        column = series.values[:, joint].copy()
        _differentiate(series.time, column, 2.0 * np.pi * low_pass_hz, rates[:, joint])
    return series.with_values(rates, unit)


def integrate(series: Series, unit: str) -> Series:
    """Return the causal integral of a speed from 0 (trapezoidal rule); a missing sample repeats the last speed."""
    filled = series.values
    known = np.isfinite(filled)
    if not known.all():
        filled = _hold_last(np.where(known, filled, np.nan))
    steps = np.diff(series.time)[:, np.newaxis] * 0.5 * (filled[1:] + filled[:-1])
    travel = np.vstack((np.zeros((1, series.joint_count)), np.cumsum(steps, axis=0)))
    return series.with_values(travel, unit)


def _hold_last(values: FloatArray) -> FloatArray:
    rows = np.where(np.isfinite(values), np.arange(len(values))[:, np.newaxis], 0)
    last = np.maximum.accumulate(rows, axis=0)
    held: FloatArray = np.take_along_axis(values, last, axis=0)
    return np.nan_to_num(held, nan=0.0)


@kernel(f"void({READ_ONLY}, {READ_ONLY}, float64, float64[:])")
def _differentiate(time: FloatArray, position: FloatArray, cutoff: float, out: FloatArray) -> None:
    last = -1
    first_stage = 0.0
    second_stage = 0.0
    started = False
    for k in range(len(time)):
        if not math.isfinite(position[k]):
            continue
        if last >= 0:
            step = time[k] - time[last]
            rate = (position[k] - position[last]) / step
            if started:
                weight = 1.0 - math.exp(-cutoff * step)
                first_stage += weight * (rate - first_stage)
                second_stage += weight * (first_stage - second_stage)
            else:
                first_stage = rate
                second_stage = rate
                started = True
            out[k] = second_stage
        last = k
