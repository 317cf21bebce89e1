"""Causal filters that several detectors share: a second-order low-pass with its rate, and a local polynomial."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from cdtool.clock import GAP_PERIODS, HOLD_PERIODS
from cdtool.clock.coarse_clock import recent_medians
from cdtool.detectors.base import BRIDGED
from cdtool.kernels import READ_ONLY, kernel
from cdtool.recording import BoolArray, FloatArray

_READ_BOOL = "Array(b1, 1, 'C', readonly=True)"
# Time in which a Butterworth filter of cut-off 1 rad/s has settled to 5 %, as for the observers: 3 over its real part.
_SETTLE = 3.0 * math.sqrt(2.0)
# No gap is cut into more steps than this.
_MOST_PIECES = 10_000


def settling_time(cutoff: FloatArray | float) -> FloatArray:
    """Return the time that a low-pass needs to settle after a start: 3 over the real part of its poles.

    Parameters
    ----------
    cutoff : float or ndarray of float
        Cut-off frequency [Hz].

    Returns
    -------
    ndarray of float
        Settling time [s], in the shape of `cutoff`: 3 sqrt(2) / (2 pi cutoff) for the Butterworth filter of `low_pass`.

    Examples
    --------
    >>> settling_time(5.0).round(3).item()
    0.135
    """
    return np.asarray(_SETTLE / (2.0 * math.pi * cutoff), dtype=np.float64)


def longest_gap(cutoff: FloatArray | float) -> FloatArray:
    """Return the longest gap that a low-pass bridges; a longer one restarts it.

    Parameters
    ----------
    cutoff : float or ndarray of float
        Cut-off frequency [Hz].

    Returns
    -------
    ndarray of float
        The longer of the settling time and 0.15 s [s].

    Examples
    --------
    >>> longest_gap(5.0).item(), longest_gap(1.0).round(3).item()
    (0.15, 0.675)
    """
    return np.maximum(settling_time(cutoff), BRIDGED)


def low_pass(
    time: FloatArray, values: FloatArray, missing: BoolArray, cutoff: FloatArray | float
) -> tuple[FloatArray, FloatArray]:
    """Return a low-passed signal and its rate of change, from the same filter states.

    Parameters
    ----------
    time : ndarray of float, shape (n,)
        Strictly increasing times [s].
    values : ndarray of float, shape (n, J)
        The signal, in any unit.
    missing : ndarray of bool, shape (n, J)
        Where the signal has no sample.
    cutoff : float or ndarray of float, shape (J,)
        Cut-off frequency [Hz].

    Returns
    -------
    filtered : ndarray of float, shape (n, J)
        The low-passed signal, in its unit.
    rate : ndarray of float, shape (n, J)
        Its rate of change, in its unit per s.

    Notes
    -----
    Second-order Butterworth filter, w^2 / (s^2 + sqrt(2) w s + w^2) with w = 2 pi cutoff, bilinear with the measured
    step and prewarped for it; the rate is a state of the filter, so that nothing is differentiated numerically. Causal.
    A missing sample is skipped: over the longer step the signal is a straight line, which the filter processes in steps
    of the usual length. After a gap longer than `longest_gap` it restarts, at rest at the first value.

    Examples
    --------
    The rate of a ramp of 2 N/s:

    >>> import numpy as np
    >>> time = np.arange(2001) * 1e-3
    >>> ramp = 2.0 * time[:, np.newaxis]
    >>> filtered, rate = low_pass(time, ramp, np.zeros((2001, 1), dtype=bool), 5.0)
    >>> rate[-1, 0].round(6).item()
    2.0
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
    """Return for each sample (n,) into how many usual steps its step is cut: 1 up to 5 of them, if no row is lost."""
    pieces = np.ones(len(time), dtype=np.int64)
    if len(time) > 2:
        steps = np.diff(time)
        usual = recent_medians(steps, float(steps[0]))[:-1]
        long = steps[1:] > HOLD_PERIODS * usual
        pieces[2:][long] = np.minimum(np.rint(steps[1:][long] / usual[long]), _MOST_PIECES).astype(np.int64)
    return pieces


def usual_steps(time: FloatArray) -> FloatArray:
    """Return the median of the last 9 steps up to each sample.

    Parameters
    ----------
    time : ndarray of float, shape (n,)
        Strictly increasing times [s].

    Returns
    -------
    ndarray of float, shape (n,)
        The usual step [s]; infinite at the first sample.

    Examples
    --------
    >>> import numpy as np
    >>> usual_steps(np.array([0.0, 0.25, 0.5, 1.5])).tolist()
    [inf, 0.25, 0.25, 0.25]
    """
    usual = np.full(len(time), np.inf)
    if len(time) > 1:
        steps = np.diff(time)
        usual[1:] = recent_medians(steps, float(steps[0]))
    return usual


def unsettled(time: FloatArray, lost: BoolArray, longest: float) -> BoolArray:
    """Mark where a filter has not yet settled after a gap.

    Parameters
    ----------
    time : ndarray of float, shape (n,)
        Strictly increasing times [s].
    lost : ndarray of bool, shape (n, J)
        Where a sample is lost.
    longest : float
        Longest time that is marked [s].

    Returns
    -------
    ndarray of bool, shape (n, J)
        True after a gap for as long as the gap was, at most `longest`. A gap is a step of more than 2.5 usual ones
        between samples that are not lost: two lost samples or more.

    Examples
    --------
    >>> import numpy as np
    >>> time = np.arange(12) * 0.01
    >>> lost = np.zeros((12, 1), dtype=bool)
    >>> lost[4:7] = True
    >>> np.flatnonzero(unsettled(time, lost, longest=0.02)).tolist()
    [7, 8]
    """
    result = np.zeros(lost.shape, dtype=bool)
    if len(time) < 3:
        return result
    steps = np.diff(time)
    usual = np.concatenate((steps[:1], steps[:1], recent_medians(steps, float(steps[0]))[:-1]))
    for j in range(lost.shape[1]):
        known = np.where(lost[:, j], np.nan, time)
        # Time since the last sample that was not lost.
        since = time - np.fmax.accumulate(np.concatenate(([time[0]], known[:-1])))
        ends = time + np.minimum(since - usual, longest)
        behind = (since > GAP_PERIODS * usual) & ~lost[:, j]
        result[:, j] = time < np.maximum.accumulate(np.where(behind, ends, -np.inf)) - 0.5 * usual
    return result


def started_at(time: FloatArray, missing: BoolArray, longest_gap: FloatArray | float) -> FloatArray:
    """Return for each sample when its filter last started.

    Parameters
    ----------
    time : ndarray of float, shape (n,)
        Strictly increasing times [s].
    missing : ndarray of bool, shape (n, J)
        Where there is no sample.
    longest_gap : float or ndarray of float, shape (J,)
        A filter restarts with the first sample after a longer gap than this [s].

    Returns
    -------
    ndarray of float, shape (n, J)
        Time of the last start [s]; infinite before the first sample.

    Examples
    --------
    >>> import numpy as np
    >>> started_at(np.array([0.0, 1.0, 2.0, 9.0]), np.array([[True], [False], [False], [False]]), 5.0)[:, 0].tolist()
    [inf, 1.0, 1.0, 9.0]
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
    """Return the first and second time derivative of a signal, by a causal least-squares cubic.

    Parameters
    ----------
    time : ndarray of float, shape (n,)
        Strictly increasing times [s], with any sampling.
    values : ndarray of float, shape (n, J)
        The signal, in any unit.
    samples : int
        Number of last samples to which the cubic is fitted.

    Returns
    -------
    first, second : ndarray of float, shape (n, J)
        The derivatives at each sample, in its unit per s and per s2; NaN with fewer than 5 samples, or where one of
        them is missing.

    Notes
    -----
    The filter of Savitzky and Golay (order 3), evaluated at its newest sample.

    Examples
    --------
    >>> import numpy as np
    >>> time = np.arange(30) * 0.01
    >>> first, second = polynomial_rates(time, (time**2)[:, np.newaxis], 21)
    >>> first[-1, 0].round(6).item(), second[-1, 0].round(6).item()
    (0.58, 2.0)
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
