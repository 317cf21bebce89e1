"""Causal filters that several detectors share: a second-order low-pass with its rate, and a local polynomial."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.base.kernels import READ_ONLY, kernel
from cdtool.detectors.base import BRIDGED
from cdtool.recordings.clock import GAP_PERIODS, HOLD_PERIODS
from cdtool.recordings.clock.recent_steps import usual_steps

# Time constants after which 5 % of a start are left.
SETTLED = 3.0
# Time in which a Butterworth filter of cut-off 1 rad/s has settled so far: its poles have a real part of 1 / sqrt(2).
_SETTLE = SETTLED * math.sqrt(2.0)
# The fewest samples that determine a cubic with one to spare.
_FEWEST = 5
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
    corners = np.array(np.broadcast_to(np.asarray(cutoff, dtype=np.float64), values.shape[1]))
    columns = np.ascontiguousarray(values), np.ascontiguousarray(missing)
    last, limits = np.empty(values.shape[1], dtype=np.int64), (2.0 * math.pi * corners, longest_gap(corners))
    _low_pass(time, *columns, usual_steps(time), *limits, last, filtered, rate)
    return filtered, rate


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
    if len(time) <= 2:
        return np.zeros(lost.shape, dtype=bool)
    result = np.zeros(lost.shape, dtype=bool)
    lost = lost if lost.any() else lost[:, :1]  # then it is the same in every column
    now, usual = time[:, np.newaxis], usual_steps(time)
    period = np.concatenate((usual[1:2], usual[1:2], usual[1:-1]))[:, np.newaxis]
    since = now - np.maximum(_last_before(now, lost), time[0])
    ends_gap = (since > GAP_PERIODS * period) & ~lost
    if not ends_gap.any():
        return result
    until = now + np.minimum(since - period, longest)
    until = np.maximum.accumulate(np.where(ends_gap, until, -np.inf))
    result[:] = now < until - 0.5 * period
    return result


def _last_before(now: FloatArray, lost: BoolArray) -> FloatArray:
    """Return the time of the last sample before each one that is not lost (n, J); -inf without any."""
    known = np.maximum.accumulate(np.where(lost, -np.inf, now)) if lost.any() else np.broadcast_to(now, lost.shape)
    return np.concatenate((np.full((1, lost.shape[1]), -np.inf), known[:-1]))


def started_at(time: FloatArray, missing: BoolArray, longest: FloatArray | float) -> FloatArray:
    """Return for each sample when its filter last started.

    Parameters
    ----------
    time : ndarray of float, shape (n,)
        Strictly increasing times [s].
    missing : ndarray of bool, shape (n, J)
        Where there is no sample.
    longest : float or ndarray of float, shape (J,)
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
    now = time[:, np.newaxis]
    before = _last_before(now, missing)
    begins = ~missing & (np.isinf(before) | (now - before > longest))
    starts = np.maximum.accumulate(np.where(begins, now, -np.inf))
    return np.where(np.isinf(starts), np.inf, starts)


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
    if samples >= _FEWEST:
        _fill_rates(time, np.ascontiguousarray(values), samples, np.empty(4 * values.shape[1]), first, second)
    return first, second


@kernel(
    f"void({READ_ONLY}, Array(float64, 2, 'C', readonly=True), Array(b1, 2, 'C', readonly=True), {READ_ONLY}, "
    f"{READ_ONLY}, {READ_ONLY}, int64[::1], float64[:, ::1], float64[:, ::1])",
)
def _low_pass(  # noqa: PLR0913  a kernel: one loop, arrays one by one
    time: FloatArray,
    values: FloatArray,
    missing: BoolArray,
    usual: FloatArray,
    corner: FloatArray,
    longest: FloatArray,
    last: npt.NDArray[np.int64],
    filtered: FloatArray,
    rate: FloatArray,
) -> None:
    """x1' = x2, x2' = w^2 (u - x1) - sqrt(2) w x2, trapezoid; w prewarped: (2 / T) tan(w T / 2).

    `corner` w (J,) [rad/s]; after a gap over `longest` (J,) [s] it restarts. `usual` (n,): the usual step up to each
    sample. A step of more than 5 of them is cut into as many as it contains. `last` (J,) is overwritten.
    """
    root = math.sqrt(2.0)
    joints = values.shape[1]
    for j in range(joints):
        last[j] = -1
    for k in range(len(time)):
        pieces = 1
        if k > 1 and time[k] - time[k - 1] > HOLD_PERIODS * usual[k - 1]:
            pieces = int(min(np.rint((time[k] - time[k - 1]) / usual[k - 1]), _MOST_PIECES))
        angle = half = kept = share = whole = -1.0
        for j in range(joints):
            y = filtered[k - 1, j] if k > 0 else 0.0
            slope = rate[k - 1, j] if k > 0 else 0.0
            before = last[j]
            if not missing[k, j]:
                step = time[k] - time[before] if before >= 0 else math.inf
                if step > longest[j]:
                    y = values[k, j]
                    slope = 0.0
                else:
                    parts = max(pieces, k - before)
                    own_half = 0.5 * step / parts
                    # Joints with the same cut-off and the same step share the coefficients.
                    if corner[j] * own_half != angle or own_half != half:
                        angle, half = corner[j] * own_half, own_half
                        # Above its Nyquist frequency a filter cannot be prewarped: it stays just below.
                        w = math.tan(min(angle, 1.4)) / half
                        square = w * w
                        kept, share = 1.0 - half * root * w, half * square
                        whole = 1.0 + half * root * w + half * half * square
                    old = values[before, j]
                    for part in range(parts):
                        new = values[k, j] if part == parts - 1 else old + (values[k, j] - old) / (parts - part)
                        right_slope = slope * kept - share * y + share * (new + old)
                        right_y = y + half * slope
                        slope = (right_slope - share * right_y) / whole
                        y = right_y + half * slope
                        old = new
                last[j] = k
            filtered[k, j] = y
            rate[k, j] = slope


@kernel(
    f"void({READ_ONLY}, Array(float64, 2, 'C', readonly=True), int64, float64[::1], float64[:, ::1], float64[:, ::1])"
)
def _fill_rates(
    time: FloatArray, values: FloatArray, samples: int, right: FloatArray, first: FloatArray, second: FloatArray
) -> None:
    """Solve the normal equations of a cubic in the scaled time x = (t - t_k) / span; definite, so without pivoting.

    All joints share the matrix, which is eliminated once per sample. `right` (4 J,) is overwritten.
    """
    joints = values.shape[1]
    for k in range(_FEWEST - 1, len(time)):
        begin = max(k - samples + 1, 0)
        span = time[k] - time[begin]
        s1 = s2 = s3 = s4 = s5 = s6 = 0.0
        right[:] = 0.0
        for i in range(begin, k):
            x = (time[i] - time[k]) / span
            square = x * x
            cube = square * x
            s1, s2, s3 = s1 + x, s2 + square, s3 + cube
            s4, s5, s6 = s4 + square * square, s5 + square * cube, s6 + cube * cube
            for j in range(joints):
                change = values[i, j] - values[k, j]
                right[4 * j] += change
                right[4 * j + 1] += x * change
                right[4 * j + 2] += square * change
                right[4 * j + 3] += cube * change
        count = k + 1.0 - begin
        f10, f20, f30 = s1 / count, s2 / count, s3 / count
        m11, m12, m13 = s2 - f10 * s1, s3 - f10 * s2, s4 - f10 * s3
        m22, m23, m33 = s4 - f20 * s2, s5 - f20 * s3, s6 - f30 * s3
        f21, f31 = m12 / m11, m13 / m11
        m22, m23, m33 = m22 - f21 * m12, m23 - f21 * m13, m33 - f31 * m13
        f32 = m23 / m22
        m33 -= f32 * m23
        for j in range(joints):
            r0 = right[4 * j]
            r1, r2, r3 = right[4 * j + 1] - f10 * r0, right[4 * j + 2] - f20 * r0, right[4 * j + 3] - f30 * r0
            r2, r3 = r2 - f21 * r1, r3 - f31 * r1
            cubic = (r3 - f32 * r2) / m33
            quadratic = (r2 - m23 * cubic) / m22
            first[k, j] = (r1 - m12 * quadratic - m13 * cubic) / m11 / span
            second[k, j] = 2.0 * quadratic / (span * span)
