"""Causal alignment of channels to a detector's clock, and the correction of faulty time stamps.

Alignment is causal: a value at time t is computed from samples at or before t. The correction of time stamps is not
quite: see `stamps`, which makes them strictly increasing, and `coarse_clock`, for a clock that is coarser than the
samples. `held_samples` aligns a channel to another clock, `lost_samples` marks what did not arrive, `recent_steps` is
the step so far, `lower_rate` finds slow columns of a table, `plausible_unit` a wrong unit.
"""

from __future__ import annotations

import math

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.kernels import READ_ONLY, kernel
from cdtool.recordings.clock.held_samples import HOLD_PERIODS, hold_last, previous_value
from cdtool.recordings.clock.stamps import GAP_PERIODS, THREE_YEARS, CleanTime, clean_time, epoch_start
from cdtool.recordings.recording import Series

__all__ = [
    "GAP_PERIODS",
    "HOLD_PERIODS",
    "THREE_YEARS",
    "CleanTime",
    "clean_time",
    "differentiate",
    "epoch_start",
    "integrate",
    "previous_value",
]


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
    speed = hold_last(series.values, ~np.isfinite(series.values))
    travel = np.zeros(speed.shape)
    np.cumsum(np.diff(series.time)[:, np.newaxis] * 0.5 * (speed[1:] + speed[:-1]), axis=0, out=travel[1:])
    return series.with_values(travel, unit)


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
