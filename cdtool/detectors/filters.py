"""Causal filters that several detectors share: a second-order low-pass with its rate, and a local polynomial."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from cdtool.clock import GAP_PERIODS, HOLD_PERIODS
from cdtool.clock.held_samples import READ_MARKS, READ_TABLE
from cdtool.clock.recent_steps import usual_steps
from cdtool.detectors.base import BRIDGED
from cdtool.instructions import aligned_zeros, part_of, widest_vectors
from cdtool.kernels import READ_ONLY, kernel
from cdtool.recording import BoolArray, FloatArray

# Time in which a Butterworth filter of cut-off 1 rad/s has settled to 5 %, as for the observers: 3 over its real part.
_SETTLE = 3.0 * math.sqrt(2.0)
# The samples whose cubics are computed at once, and the fewest that determine a cubic with one to spare.
BLOCK, _FEWEST = 32, 5
# Rows of the work space of a cubic: sums of powers; factors and matrix of its elimination; right-hand side.
_SPAN, _COUNT, _FOURTH, _FIFTH = range(0, 4 * BLOCK, BLOCK)
_S1, _S2, _S3, _S4, _S5, _S22, _S33 = range(4 * BLOCK, 11 * BLOCK, BLOCK)
_F10, _F20, _F30, _F21, _F31, _F32 = range(11 * BLOCK, 17 * BLOCK, BLOCK)
_M11, _M12, _M13, _M22, _M23, _M33 = range(17 * BLOCK, 23 * BLOCK, BLOCK)
_R0, _R1, _R2, _R3, _ROWS = range(23 * BLOCK, 28 * BLOCK, BLOCK)
# Rows of the powers of x of one sample of the window.
_WEIGHT, _X, _SQUARE, _CUBE, _POWERS = range(0, 5 * BLOCK, BLOCK)
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
    result = np.zeros(lost.shape, dtype=bool)
    if len(time) > 2:
        _mark_unsettled(time, usual_steps(time), np.ascontiguousarray(lost), longest, result)
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
    longest = np.array(np.broadcast_to(longest_gap, missing.shape[1]), dtype=np.float64)
    _fill_starts(time, np.ascontiguousarray(missing), longest, starts)
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
    if samples >= _FEWEST:
        work = aligned_zeros(samples * _POWERS), aligned_zeros(_ROWS), np.empty((2, BLOCK + samples - 1))
        _polynomial_rates(time, np.ascontiguousarray(values), samples, *work, first, second)
    return first, second


@kernel(
    f"void({READ_ONLY}, {READ_TABLE}, {READ_MARKS}, {READ_ONLY}, {READ_ONLY}, {READ_ONLY}, int64[::1], "
    "float64[:, ::1], float64[:, ::1])",
)
def _low_pass(  # noqa: PLR0913  a kernel: one loop, arrays one by one
    time: FloatArray,
    values: FloatArray,
    missing: BoolArray,
    usual: FloatArray,
    cutoff: FloatArray,
    longest_gap: FloatArray,
    last: npt.NDArray[np.int64],
    filtered: FloatArray,
    rate: FloatArray,
) -> None:
    """x1' = x2, x2' = w^2 (u - x1) - sqrt(2) w x2, trapezoid; w prewarped: (2 / T) tan(w T / 2).

    `usual` (n,): the usual step up to each sample. A step of more than 5 of them is cut into as many as it contains.
    `last` (J,) is overwritten.
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
                if step > longest_gap[j]:
                    y = values[k, j]
                    slope = 0.0
                else:
                    parts = max(pieces, k - before)
                    own_half = 0.5 * step / parts
                    # Joints with the same cut-off and the same step share the coefficients.
                    if cutoff[j] * own_half != angle or own_half != half:
                        angle, half = cutoff[j] * own_half, own_half
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


@kernel(f"void({READ_ONLY}, {READ_ONLY}, {READ_MARKS}, float64, b1[:, ::1])")
def _mark_unsettled(time: FloatArray, usual: FloatArray, lost: BoolArray, longest: float, result: BoolArray) -> None:
    for j in range(lost.shape[1]):
        newest, until = time[0], -math.inf
        for k in range(len(time)):
            period = usual[max(k - 1, 1)]
            since = time[k] - newest
            if since > GAP_PERIODS * period and not lost[k, j]:
                until = max(until, time[k] + min(since - period, longest))
            result[k, j] = time[k] < until - 0.5 * period
            if not lost[k, j]:
                newest = time[k]


@kernel(f"void({READ_ONLY}, {READ_MARKS}, {READ_ONLY}, float64[:, ::1])")
def _fill_starts(time: FloatArray, missing: BoolArray, longest_gap: FloatArray, starts: FloatArray) -> None:
    for j in range(missing.shape[1]):
        start, last = math.inf, -math.inf
        for k in range(len(time)):
            if not missing[k, j]:
                if start == math.inf or time[k] - last > longest_gap[j]:
                    start = time[k]
                last = time[k]
            starts[k, j] = start


@kernel(f"void({READ_ONLY}, int64, int64, float64[:, ::1], float64[::1], float64[::1])")
def _fill_powers(
    time: FloatArray, begin: int, before: int, window: FloatArray, powers: FloatArray, rows: FloatArray
) -> None:
    """Fill the powers of x = (t - t_k) / span of a block of windows, which end at `begin` and later, and their sums.

    The sample is innermost, and its rows are at distances known at compile time: otherwise one instruction handles one
    sample. In a window that begins before the first sample, what is missing there does not count: weight and x are 0.
    """
    widest_vectors()
    clock = window[0]
    for i in range(BLOCK + before):
        clock[i] = time[min(max(begin - before + i, 0), len(time) - 1)]
    for k in range(BLOCK):
        rows[_SPAN + k] = clock[before + k] - clock[k]
        rows[_COUNT + k] = min(begin + k, before) + 1.0
    for k in range(_S1, _S33 + BLOCK):
        rows[k] = 0.0
    for m in range(before + 1):
        own = powers[m * _POWERS : (m + 1) * _POWERS]
        for k in range(BLOCK):
            own[_WEIGHT + k] = 1.0 if begin + k + m >= before else 0.0
            x = own[_WEIGHT + k] * ((clock[m + k] - clock[before + k]) / rows[_SPAN + k])
            own[_X + k] = x
            own[_SQUARE + k] = x * x
            own[_CUBE + k] = x * x * x
            rows[_FOURTH + k] = x * (x * x * x)
            rows[_FIFTH + k] = (x * x) * (x * x * x)
        for k in range(BLOCK):
            rows[_S1 + k] += own[_X + k]
            rows[_S2 + k] += own[_SQUARE + k]
            rows[_S3 + k] += own[_CUBE + k]
            rows[_S4 + k] += rows[_FOURTH + k]
            rows[_S5 + k] += rows[_FIFTH + k]
            rows[_S22 + k] += own[_SQUARE + k] * own[_SQUARE + k]
            rows[_S33 + k] += own[_CUBE + k] * own[_CUBE + k]


@kernel(f"void({READ_TABLE}, int64, int64, float64[::1])")
def _take_window(values: FloatArray, begin: int, joint: int, column: FloatArray) -> None:
    """Fill `column` with the samples of one joint from `begin` on, those beyond the ends as the last one there."""
    count, joints = values.shape
    if begin >= 0 and begin + len(column) <= count:
        own = part_of(values, begin * joints + joint, (len(column) - 1) * joints + 1)
        for i in range(len(column)):
            column[i] = own[i * joints]
    else:
        for i in range(len(column)):
            column[i] = values[min(max(begin + i, 0), count - 1), joint]


@kernel("void(float64[::1], int64, int64, float64[:, ::1], float64[:, ::1])")
def _give_rates(rows: FloatArray, begin: int, joint: int, first: FloatArray, second: FloatArray) -> None:
    """The rates of one joint in a block of samples, where there are enough before them."""
    count, joints = first.shape
    size = (min(BLOCK, count - begin) - 1) * joints + 1
    at = begin * joints + joint
    speeds, accelerations = part_of(first, at, size), part_of(second, at, size)
    for k in range(max(_FEWEST - 1 - begin, 0), min(BLOCK, count - begin)):
        speeds[k * joints] = rows[_R0 + k]
        accelerations[k * joints] = rows[_R1 + k]


@kernel(
    f"void({READ_ONLY}, {READ_TABLE}, int64, float64[::1], float64[::1], float64[:, ::1], float64[:, ::1], "
    "float64[:, ::1])",
)
def _polynomial_rates(  # noqa: PLR0913  a kernel: one loop, arrays one by one
    time: FloatArray,
    values: FloatArray,
    samples: int,
    powers: FloatArray,
    rows: FloatArray,
    window: FloatArray,
    first: FloatArray,
    second: FloatArray,
) -> None:
    """Normal equations of a cubic in the scaled time x = (t - t_k) / span, definite: no pivoting.

    All joints have the same matrix, which is eliminated once per sample, and a block of samples is computed at once.
    `powers`, `rows` and `window` are work space; what `first` and `second` (n, J) hold stays where x is too short.
    """
    widest_vectors()
    before = samples - 1
    column = window[1]
    for begin in range(0, len(time), BLOCK):
        _fill_powers(time, begin, before, window, powers, rows)
        _eliminate(rows)
        for j in range(values.shape[1]):
            _take_window(values, begin - before, j, column)
            for k in range(_R0, _R3 + BLOCK):
                rows[k] = 0.0
            # Two samples of a window at once; the newest one, whose change is 0, may be left out.
            for m in range(0, samples - 1, 2):
                own, newest = powers[m * _POWERS : (m + 2) * _POWERS], column[before : before + BLOCK]
                pair = column[m : m + BLOCK + 1]
                for k in range(BLOCK):
                    older, newer = pair[k] - newest[k], pair[k + 1] - newest[k]
                    rows[_R0 + k] = rows[_R0 + k] + own[_WEIGHT + k] * older + own[_POWERS + _WEIGHT + k] * newer
                    rows[_R1 + k] = rows[_R1 + k] + own[_X + k] * older + own[_POWERS + _X + k] * newer
                    rows[_R2 + k] = rows[_R2 + k] + own[_SQUARE + k] * older + own[_POWERS + _SQUARE + k] * newer
                    rows[_R3 + k] = rows[_R3 + k] + own[_CUBE + k] * older + own[_POWERS + _CUBE + k] * newer
            for k in range(BLOCK):
                r0 = rows[_R0 + k]
                r1, r2 = rows[_R1 + k] - rows[_F10 + k] * r0, rows[_R2 + k] - rows[_F20 + k] * r0
                r3 = rows[_R3 + k] - rows[_F30 + k] * r0
                r2, r3 = r2 - rows[_F21 + k] * r1, r3 - rows[_F31 + k] * r1
                cubic = (r3 - rows[_F32 + k] * r2) / rows[_M33 + k]
                square = (r2 - rows[_M23 + k] * cubic) / rows[_M22 + k]
                linear = (r1 - rows[_M12 + k] * square - rows[_M13 + k] * cubic) / rows[_M11 + k]
                rows[_R0 + k] = linear / rows[_SPAN + k]
                rows[_R1 + k] = 2.0 * square / (rows[_SPAN + k] * rows[_SPAN + k])
            _give_rates(rows, begin, j, first, second)


@kernel("void(float64[::1])")
def _eliminate(rows: FloatArray) -> None:
    """Eliminate (n, s1, s2, s3), (s1, s2, s3, s4), (s2, s3, s22, s5), (s3, s4, s5, s33): factors and upper rows."""
    widest_vectors()
    for k in range(BLOCK):
        n, s1, s2, s3 = rows[_COUNT + k], rows[_S1 + k], rows[_S2 + k], rows[_S3 + k]
        s4, s5, s22, s33 = rows[_S4 + k], rows[_S5 + k], rows[_S22 + k], rows[_S33 + k]
        f10, f20, f30 = s1 / n, s2 / n, s3 / n
        m11, m12, m13 = s2 - f10 * s1, s3 - f10 * s2, s4 - f10 * s3
        m21, m22, m23 = s3 - f20 * s1, s22 - f20 * s2, s5 - f20 * s3
        m31, m32, m33 = s4 - f30 * s1, s5 - f30 * s2, s33 - f30 * s3
        f21, f31 = m21 / m11, m31 / m11
        m22, m23 = m22 - f21 * m12, m23 - f21 * m13
        m32, m33 = m32 - f31 * m12, m33 - f31 * m13
        f32 = m32 / m22
        rows[_F10 + k], rows[_F20 + k], rows[_F30 + k] = f10, f20, f30
        rows[_F21 + k], rows[_F31 + k], rows[_F32 + k] = f21, f31, f32
        rows[_M11 + k], rows[_M12 + k], rows[_M13 + k] = m11, m12, m13
        rows[_M22 + k], rows[_M23 + k], rows[_M33 + k] = m22, m23, m33 - f32 * m23
