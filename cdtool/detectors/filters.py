"""Causal filters that several detectors share: a second-order low-pass with its rate, and a local polynomial."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from cdtool.clock import GAP_PERIODS, HOLD_PERIODS
from cdtool.clock.coarse import recent_medians
from cdtool.detectors.base import BRIDGED
from cdtool.kernels import READ_ONLY, kernel
from cdtool.recording import BoolArray, FloatArray

_READ_BOOL = "Array(b1, 1, 'C', readonly=True)"
# Time in which a Butterworth filter of cut-off 1 rad/s has settled to 5 %, as for the observers: 3 over its real part.
_SETTLE = 3.0 * math.sqrt(2.0)
# No gap is cut into more steps than this.
_MOST_PIECES = 10_000


def settling_time(cutoff: FloatArray | float) -> FloatArray:
    """How long after a start a low-pass of `cutoff` [Hz] is not to be trusted [s]: 3 over its poles' real part."""
    return np.asarray(_SETTLE / (2.0 * math.pi * cutoff), dtype=np.float64)


def longest_gap(cutoff: FloatArray | float) -> FloatArray:
    """The longest gap over which a low-pass of `cutoff` [Hz] goes on [s]: a longer one restarts it."""
    return np.maximum(settling_time(cutoff), BRIDGED)


def low_pass(
    time: FloatArray, values: FloatArray, missing: BoolArray, cutoff: FloatArray | float
) -> tuple[FloatArray, FloatArray]:
    """Low-pass (n, J) of `values` (n, J) and its rate of change: y and s y with the same states, so that they match.

    Second-order Butterworth, w^2 / (s^2 + sqrt(2) w s + w^2), w = 2 pi `cutoff` [Hz] (one, or one a joint), bilinear
    with the measured step and prewarped for it; nothing is differenced afterwards. A missing sample is skipped: over
    the longer step the value runs straight, and the filter takes it in steps of the usual length. After a gap longer
    than `longest_gap` it starts again, from rest at the first value.
    """
    filtered, rate = np.empty(values.shape), np.empty(values.shape)
    corners = np.broadcast_to(np.asarray(cutoff, dtype=np.float64), values.shape[1])
    longest = longest_gap(corners)
    pieces = _pieces(time)
    for j in range(values.shape[1]):
        column, lost = np.ascontiguousarray(values[:, j]), np.ascontiguousarray(missing[:, j])
        _low_pass(time, column, lost, pieces, 2.0 * math.pi * corners[j], longest[j], filtered[:, j], rate[:, j])
    return filtered, rate


def _pieces(time: FloatArray) -> npt.NDArray[np.int64]:
    """(n,): into how many usual steps the step to each sample is cut: 1 up to 5 of them, where no row is lost."""
    pieces = np.ones(len(time), dtype=np.int64)
    if len(time) > 2:
        steps = np.diff(time)
        usual = recent_medians(steps, float(steps[0]))[:-1]
        long = steps[1:] > HOLD_PERIODS * usual
        pieces[2:][long] = np.minimum(np.rint(steps[1:][long] / usual[long]), _MOST_PIECES).astype(np.int64)
    return pieces


def usual_steps(time: FloatArray) -> FloatArray:
    """(n,): the median of the last 9 steps up to each sample [s]; infinite at the first."""
    usual = np.full(len(time), np.inf)
    if len(time) > 1:
        steps = np.diff(time)
        usual[1:] = recent_medians(steps, float(steps[0]))
    return usual


def unsettled(time: FloatArray, lost: BoolArray, longest: float) -> BoolArray:
    """Where a filter has not settled yet behind a gap (n, J): for as long as the gap was, at most `longest` [s].

    A gap is a step of more than 2.5 usual ones between samples that were not `lost` (n, J): two lost ones or more.
    """
    result = np.zeros(lost.shape, dtype=bool)
    if len(time) < 3:
        return result
    steps = np.diff(time)
    usual = np.concatenate((steps[:1], steps[:1], recent_medians(steps, float(steps[0]))[:-1]))
    for j in range(lost.shape[1]):
        known = np.where(lost[:, j], np.nan, time)
        # How long before each sample the last one was that was not lost.
        since = time - np.fmax.accumulate(np.concatenate(([time[0]], known[:-1])))
        ends = time + np.minimum(since - usual, longest)
        behind = (since > GAP_PERIODS * usual) & ~lost[:, j]
        result[:, j] = time < np.maximum.accumulate(np.where(behind, ends, -np.inf)) - 0.5 * usual
    return result


def started_at(time: FloatArray, missing: BoolArray, longest_gap: FloatArray | float) -> FloatArray:
    """(n, J): for each sample when its filter last started [s]; infinite before the first sample.

    A filter starts with the first sample and again with the first one after a gap longer than `longest_gap` [s], one or
    one a joint.
    """
    starts = np.empty(missing.shape)
    longest = np.broadcast_to(longest_gap, missing.shape[1])
    for j in range(missing.shape[1]):
        present = np.flatnonzero(~missing[:, j])
        fresh = np.ones(len(present), dtype=bool)
        fresh[1:] = np.diff(time[present]) > longest[j]
        last = np.full(len(time), np.inf)
        last[present[fresh]] = time[present[fresh]]
        index = np.where(np.isfinite(last), np.arange(len(time)), -1)
        index = np.maximum.accumulate(index) if len(index) else index
        starts[:, j] = np.where(index >= 0, last[np.maximum(index, 0)], np.inf)
    return starts


def polynomial_rates(time: FloatArray, values: FloatArray, samples: int) -> tuple[FloatArray, FloatArray]:
    """First and second time derivative (n, J) of `values` at each sample, from a cubic through the last `samples`.

    Least squares over the samples so far with their own times: Savitzky and Golay's filter (order 3) at its newest end,
    for any sampling. NaN where fewer than 5 samples are known or a sample is missing.
    """
    first, second = np.full(values.shape, np.nan), np.full(values.shape, np.nan)
    equations = np.empty((4, 5))
    for j in range(values.shape[1]):
        _polynomial_rates(time, np.ascontiguousarray(values[:, j]), samples, equations, first[:, j], second[:, j])
    return first, second


@kernel(f"void({READ_ONLY}, {READ_ONLY}, {_READ_BOOL}, int64[::1], float64, float64, float64[:], float64[:])")
def _low_pass(  # noqa: PLR0913  a kernel takes arrays and scalars one by one
    time: FloatArray,
    values: FloatArray,
    missing: BoolArray,
    pieces: npt.NDArray[np.int64],
    cutoff: float,
    longest_gap: float,
    filtered: FloatArray,
    rate: FloatArray,
) -> None:
    """x1' = x2, x2' = w^2 (u - x1) - sqrt(2) w x2, trapezoid; w prewarped: (2 / T) tan(w T / 2)."""
    root = math.sqrt(2.0)
    y = 0.0
    slope = 0.0
    last = -1
    for k in range(len(time)):
        if not missing[k]:
            step = time[k] - time[last] if last >= 0 else math.inf
            if step > longest_gap:
                y = values[k]
                slope = 0.0
            else:
                parts = max(pieces[k], k - last)
                half = 0.5 * step / parts
                # Above its Nyquist frequency a filter cannot be prewarped: it stays just below.
                w = math.tan(min(cutoff * half, 1.4)) / half
                square = w * w
                before = values[last]
                for part in range(parts):
                    after = values[k] if part == parts - 1 else before + (values[k] - before) / (parts - part)
                    drive = half * square * (after + before)
                    right_slope = slope * (1.0 - half * root * w) - half * square * y + drive
                    right_y = y + half * slope
                    slope = (right_slope - half * square * right_y) / (1.0 + half * root * w + half * half * square)
                    y = right_y + half * slope
                    before = after
            last = k
        filtered[k] = y
        rate[k] = slope


@kernel(f"void({READ_ONLY}, {READ_ONLY}, int64, float64[:, ::1], float64[:], float64[:])")
def _polynomial_rates(  # noqa: C901  a kernel is one loop
    time: FloatArray, values: FloatArray, samples: int, matrix: FloatArray, first: FloatArray, second: FloatArray
) -> None:
    """Normal equations of a cubic in the scaled time x = (t - t_k) / span, definite: no pivoting.

    `matrix` (4, 5) is overwritten.
    """
    for k in range(len(time)):
        start = k - samples + 1 if k >= samples else 0
        span = time[k] - time[start]
        if k - start < 4 or not span > 0.0:
            continue
        for row in range(4):
            for column in range(5):
                matrix[row, column] = 0.0
        for i in range(start, k + 1):
            x = (time[i] - time[k]) / span
            change = values[i] - values[k]
            of_row = 1.0
            for row in range(4):
                of_column = 1.0
                for column in range(4):
                    matrix[row, column] += of_row * of_column
                    of_column *= x
                matrix[row, 4] += of_row * change
                of_row *= x
        for pivot in range(4):
            for row in range(pivot + 1, 4):
                factor = matrix[row, pivot] / matrix[pivot, pivot]
                for column in range(pivot, 5):
                    matrix[row, column] -= factor * matrix[pivot, column]
        cubic = matrix[3, 4] / matrix[3, 3]
        square = (matrix[2, 4] - matrix[2, 3] * cubic) / matrix[2, 2]
        linear = (matrix[1, 4] - matrix[1, 2] * square - matrix[1, 3] * cubic) / matrix[1, 1]
        first[k] = linear / span
        second[k] = 2.0 * square / (span * span)
