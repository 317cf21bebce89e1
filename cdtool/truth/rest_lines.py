"""Robust lines through the rest level of a load cell, pooled into intervals.

Conventions: `first` (m,) are the samples at which intervals begin, `ends` (m,) their last times [s], `centre` and
`median` (m,) their middles [s] and readings [N]. A line is five numbers: level [N], drift [N/s], time [s], standard
error of the level [N] and of the drift [N/s].
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.statistics.spread import MAD_TO_STD

#: Readings are pooled over this long [s]: noise and the hum of the mains average out, drift does not.
INTERVAL = 0.05
#: Time between the rest and the force that it is for [s]: a soft contact must not be mistaken for drift of the cell.
GAP = 0.3
#: Intervals that a line is fitted to: 1 s, over which drift is straight.
WINDOW = 20
#: Fewer intervals determine no slope: the level is constant.
_LINE = 6
# A line is extended for at most this long [s]; after that its last value is used.
EXTENDED = 1.0
# The standard deviation of a median of Gaussian noise, in units of a mean's: sqrt(pi / 2).
_OF_MEDIAN = 1.2533
# So many lines are fitted together: the slopes between each two intervals take 6 MB.
_TOGETHER = 4096

IntArray = npt.NDArray[np.intp]


def intervals_of(time: FloatArray) -> IntArray:
    """Return the samples (m,) at which intervals of 50 ms begin; one without samples is left out."""
    number = np.floor((time - time[0]) / INTERVAL)
    return np.flatnonzero(np.diff(number, prepend=-1.0) > 0.0)


def medians_of(values: FloatArray, first: IntArray) -> FloatArray:
    """Return the median of the values (n,) in each interval (m,)."""
    size, medians = np.diff(first, append=len(values)), np.empty(len(first))
    for each in np.unique(size):  # most intervals have as many samples
        rows = np.flatnonzero(size == each)
        ordered = np.sort(values[first[rows, np.newaxis] + np.arange(each)], axis=1)
        medians[rows] = 0.5 * (ordered[:, (each - 1) // 2] + ordered[:, each // 2])
    return medians


def line_of_start(time: FloatArray, force: FloatArray) -> FloatArray:
    """Return the constant line (5,) through the first samples."""
    first = force[: max(int(np.searchsorted(time, time[0] + 0.1)), 3)]  # 0.1 s, as until two intervals are known
    level = float(np.median(first))
    error = _OF_MEDIAN * MAD_TO_STD * float(np.median(np.abs(first - level))) / np.sqrt(len(first))
    return np.array([level, 0.0, time[0], error, 0.0])


def noise_about(force: FloatArray, first: IntArray, levels: FloatArray) -> float:
    """Return the standard deviation of the readings (n,) about the rest level (n,) [N].

    In a contact the force is no line: intervals three times noisier than the quietest third are not at rest.
    """
    deviations = medians_of(np.abs(force - levels), first)
    quiet = deviations[deviations <= 3.0 * np.quantile(deviations, 1.0 / 3.0)]
    return MAD_TO_STD * float(np.median(quiet))


def lines_before(
    ends: FloatArray, centre: FloatArray, median: FloatArray, start: FloatArray, until: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the lines (k, 5) through the last intervals (m,) that ended by `until` (k,), and when the last did (k,).

    Where fewer than two are known, the line is `start` (5,) and the time infinite [s].
    """
    known = np.searchsorted(ends, until, side="right")
    lines, last = np.tile(start, (len(until), 1)), np.full(len(until), np.inf)
    rows = np.flatnonzero(known >= 2)
    last[rows] = ends[known[rows] - 1]
    for begin in range(0, len(rows), _TOGETHER):
        part = rows[begin : begin + _TOGETHER]
        window = known[part, np.newaxis] - np.arange(WINDOW, 0, -1)
        inside, window = window >= 0, np.maximum(window, 0)
        lines[part] = _fit(centre[window], median[window], inside)
    return lines, last


def _fit(time: FloatArray, values: FloatArray, inside: BoolArray) -> FloatArray:
    """Return the robust line (k, 5) through the intervals (k, WINDOW) that are `inside`, by Theil and Sen."""
    size = inside.sum(axis=1)
    at = np.where(inside, time, 0.0).sum(axis=1) / size
    level, spread = _centre_and_spread(values, inside)
    a, b = np.triu_indices(WINDOW, 1)
    both = inside[:, a] & inside[:, b]
    slopes = (values[:, b] - values[:, a]) / np.where(both, time[:, b] - time[:, a], 1.0)
    slope = _medians(slopes, both)
    off = np.where(inside, time - at[:, np.newaxis], 0.0)
    middle, about = _centre_and_spread(values - slope[:, np.newaxis] * off, inside)
    drift_error = np.where(size >= _LINE, about / np.sqrt((off * off).sum(axis=1)), 0.0)
    # A slope is beyond doubt at three standard errors, more of them with few intervals.
    drifts = (size >= _LINE) & (np.abs(slope) > 3.0 * (1.0 + 10.0 / size) * drift_error)
    error = _OF_MEDIAN * np.where(drifts, about, spread) / np.sqrt(size)
    return np.column_stack((np.where(drifts, middle, level), np.where(drifts, slope, 0.0), at, error, drift_error))


def _centre_and_spread(values: FloatArray, inside: BoolArray) -> tuple[FloatArray, FloatArray]:
    """Return the medians (k,) of the values `inside`, and standard deviations about them by the absolute deviation."""
    centre = _medians(values, inside)
    return centre, MAD_TO_STD * _medians(np.abs(values - centre[:, np.newaxis]), inside)


def _medians(values: FloatArray, inside: BoolArray) -> FloatArray:
    """Return the median of those values of each row (k, w) that are `inside`, at least one."""
    ordered, size = np.sort(np.where(inside, values, np.inf), axis=1), inside.sum(axis=1)
    rows = np.arange(len(size))
    return np.asarray(0.5 * (ordered[rows, (size - 1) // 2] + ordered[rows, size // 2]))
