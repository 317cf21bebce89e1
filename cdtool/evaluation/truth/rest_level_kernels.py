"""The rest level of a load cell as kernels: medians of intervals, robust lines through them, levels of samples.

Conventions: `first` and `last` (m,) are the samples at which each interval begins and ends, `ends` its last time [s],
`centre` and `median` its middle [s] and reading [N]. A line is five numbers: level [N], drift [N/s], time [s], standard
error of the level [N] and of the drift [N/s]; `start` is the line that applies before two intervals are known.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from cdtool.kernels import READ_ONLY, kernel
from cdtool.median_kernel import median_of, quantile_of
from cdtool.recording import BoolArray, FloatArray

INTERVAL = 0.05
GAP = 0.3
WINDOW = 20
# A line needs this many intervals and a slope of this many standard errors, more of them with few intervals n:
# 3 (1 + 10 / n). Otherwise the level is constant.
_LINE, _BEYOND_DOUBT, _FEW = 6, 3.0, 10.0
# A line is extended for at most this long [s]; after that its last value is used.
EXTENDED = 1.0
# Until two intervals are old enough the level is that of the log's first samples [s], at least this many.
_FIRST, _FEWEST = 0.1, 3
# A standard deviation from the median absolute deviation of Gaussian noise; that of a median, in units of a mean's.
_MAD, _OF_MEDIAN = 1.4826, 1.2533
# Intervals deviate by more than so many times what the quietest third does: they say nothing about the noise at rest.
_RESTLESS = 3.0

# Room for the times and readings of a window, and for the slopes between each two of them.
SCRATCH = 2 * WINDOW + WINDOW * (WINDOW - 1) // 2

IntArray = npt.NDArray[np.intp]

_FLOATS, _INTS = "float64[::1]", "int64[::1]"


@kernel(f"float64({_FLOATS}, int64)", exact=True)
def _sum(values: FloatArray, count: int) -> float:
    """Return the sum of the first `count` values, at most 128, in numpy's order: eight partial sums."""
    total = 0.0
    k = 0
    if count >= 8:
        a, b, c, d = values[0], values[1], values[2], values[3]
        e, f, g, h = values[4], values[5], values[6], values[7]
        k = 8
        while k < count - count % 8:
            a, b, c, d = a + values[k], b + values[k + 1], c + values[k + 2], d + values[k + 3]
            e, f, g, h = e + values[k + 4], f + values[k + 5], g + values[k + 6], h + values[k + 7]
            k += 8
        total = ((a + b) + (c + d)) + ((e + f) + (g + h))
    while k < count:
        total += values[k]
        k += 1
    return float(total)


@kernel(f"float64({_FLOATS}, int64, float64, {_FLOATS})", exact=True)
def _deviation(values: FloatArray, count: int, about: float, scratch: FloatArray) -> float:
    """Return the standard deviation about a value by the median absolute deviation."""
    for i in range(count):
        scratch[i] = abs(values[i] - about)
    return float(_MAD * median_of(scratch, count))


@kernel(f"void({_FLOATS}, {_FLOATS}, int64, {_FLOATS}, {_FLOATS})", exact=True)
def _fit(time: FloatArray, values: FloatArray, size: int, scratch: FloatArray, line: FloatArray) -> None:
    """Fill `line` with the robust line through the first `size` values; `scratch` has room for each pair of them."""
    at = _sum(time, size) / size
    for i in range(size):
        scratch[i] = values[i]
    level = median_of(scratch, size)
    spread = _deviation(values, size, level, scratch)
    drift = 0.0
    drift_error = 0.0
    if size >= _LINE:
        pair = 0
        for a in range(size):
            for b in range(a + 1, size):
                scratch[pair] = (values[b] - values[a]) / (time[b] - time[a])
                pair += 1
        slope = median_of(scratch, pair)
        left = scratch[size : 2 * size]
        for i in range(size):
            left[i] = values[i] - slope * (time[i] - at)
            scratch[i] = left[i]
        middle = median_of(scratch, size)
        about = _deviation(left, size, middle, scratch)
        for i in range(size):
            scratch[i] = (time[i] - at) * (time[i] - at)
        drift_error = about / math.sqrt(_sum(scratch, size))
        if abs(slope) > _BEYOND_DOUBT * (1.0 + _FEW / size) * drift_error:
            drift, level, spread = slope, middle, about
    line[0], line[1], line[2] = level, drift, at
    line[3], line[4] = _OF_MEDIAN * spread / math.sqrt(size), drift_error


@kernel(f"int64({_FLOATS}, float64)", exact=True)
def count_until(times: FloatArray, until: float) -> int:
    """Return how many of the increasing times (n,) [s] are not later than `until`."""
    low = 0
    high = len(times)
    while low < high:
        middle = (low + high) // 2
        if times[middle] <= until:
            low = middle + 1
        else:
            high = middle
    return low


@kernel(
    f"float64({_FLOATS}, {_FLOATS}, {_FLOATS}, boolean[::1], {_FLOATS}, float64, {_FLOATS}, {_FLOATS})",
    exact=True,
)
def fit_before(  # noqa: PLR0913  a kernel: arrays one by one
    ends: FloatArray,
    centre: FloatArray,
    median: FloatArray,
    rest: BoolArray,
    start: FloatArray,
    until: float,
    scratch: FloatArray,
    line: FloatArray,
) -> float:
    """Fill `line` with the line through the last intervals at rest that ended by `until` [s].

    Return when the last of them ended [s]; infinite if fewer than two are known. `scratch` (SCRATCH,) is overwritten.
    """
    times, values = scratch[:WINDOW], scratch[WINDOW : 2 * WINDOW]
    i = count_until(ends, until) - 1
    known = WINDOW
    last = math.inf
    while i >= 0 and known > 0:
        if rest[i]:
            if known == WINDOW:
                last = ends[i]
            known -= 1
            times[known], values[known] = centre[i], median[i]
        i -= 1
    size = WINDOW - known
    if size < 2:
        for k in range(len(start)):
            line[k] = start[k]
        return math.inf
    _fit(times[known:], values[known:], size, scratch[2 * WINDOW :], line)
    return float(last)


@kernel(f"void({READ_ONLY}, {_INTS}, float64[:, ::1], int64, {_FLOATS})", exact=True)
def _evaluate(time: FloatArray, first: IntArray, lines: FloatArray, begin: int, levels: FloatArray) -> None:
    """Fill `levels` (n,) with the lines (m, 5) of the samples from interval `begin` on."""
    for i in range(begin, len(first)):
        end = first[i + 1] if i + 1 < len(first) else len(time)
        level, drift, at = lines[i, 0], lines[i, 1], lines[i, 2]
        for k in range(first[i], end):
            levels[k] = level + drift * (time[k] - at)


@kernel(
    f"int64({READ_ONLY}, {READ_ONLY}, {_INTS}, {_FLOATS}, {_FLOATS}, {_FLOATS}, {_FLOATS}, float64[:, ::1], {_FLOATS})",
    exact=True,
)
def estimate(  # noqa: PLR0913  a kernel: arrays one by one
    time: FloatArray,
    force: FloatArray,
    first: IntArray,
    ends: FloatArray,
    centre: FloatArray,
    median: FloatArray,
    start: FloatArray,
    lines: FloatArray,
    levels: FloatArray,
) -> int:
    """Pool the readings (n,) into intervals and fill all other arrays, nothing being excluded; return their number."""
    count: int = _pool(time, force, first, ends, centre, median)
    _start(time, force, start)
    rest = np.ones(count, dtype=np.bool_)
    scratch = np.empty(SCRATCH)
    for i in range(count):
        fit_before(ends[:count], centre, median, rest, start, time[first[i]] - GAP, scratch, lines[i])
    _evaluate(time, first[:count], lines, 0, levels)
    return count


@kernel(f"int64({READ_ONLY}, {READ_ONLY}, {_INTS}, {_FLOATS}, {_FLOATS}, {_FLOATS})", exact=True)
def _pool(
    time: FloatArray, force: FloatArray, first: IntArray, ends: FloatArray, centre: FloatArray, median: FloatArray
) -> int:
    """Fill the arrays with the intervals of the samples (n,); return how many there are."""
    count = 0
    number = 0
    for k in range(len(time)):
        own = math.floor((time[k] - time[0]) / INTERVAL)
        if k == 0 or own > number:
            first[count] = k
            number = own
            count += 1
    _medians(force, first[:count], median)
    for i in range(count):
        ends[i] = time[(first[i + 1] if i + 1 < count else len(time)) - 1]
        centre[i] = 0.5 * (time[first[i]] + ends[i])
    return count


@kernel(f"void({READ_ONLY}, {_INTS}, {_FLOATS})", exact=True)
def _medians(values: FloatArray, first: IntArray, medians: FloatArray) -> None:
    """Fill `medians` (m,) with the median of the values (n,) in each interval."""
    scratch = np.empty(len(values))
    for i in range(len(first)):
        end = first[i + 1] if i + 1 < len(first) else len(values)
        size = end - first[i]
        for k in range(size):
            scratch[k] = values[first[i] + k]
        medians[i] = median_of(scratch, size)


@kernel(f"void({READ_ONLY}, {READ_ONLY}, {_FLOATS})", exact=True)
def _start(time: FloatArray, force: FloatArray, start: FloatArray) -> None:
    """Fill `start` with the constant line through the first samples."""
    until = time[0] + _FIRST
    count = 0
    while count < len(time) and (time[count] < until or count < _FEWEST):
        count += 1
    values, scratch = np.empty(count), np.empty(count)
    for k in range(count):
        values[k] = force[k]
        scratch[k] = force[k]
    level = median_of(scratch, count)
    start[0], start[1], start[2] = level, 0.0, time[0]
    start[3] = _OF_MEDIAN * _deviation(values, count, level, scratch) / math.sqrt(count)
    start[4] = 0.0


@kernel(f"float64({READ_ONLY}, {_INTS}, {READ_ONLY})", exact=True)
def noise_about(force: FloatArray, first: IntArray, levels: FloatArray) -> float:
    """Return the standard deviation of the readings (n,) about the rest level (n,) [N].

    In a contact the force is no line: intervals far noisier than the quietest third are not at rest.
    """
    deviations = np.empty(len(force))
    for k in range(len(force)):
        deviations[k] = abs(force[k] - levels[k])
    medians, scratch = np.empty(len(first)), np.empty(len(first))
    _medians(deviations, first, medians)
    for i in range(len(first)):
        scratch[i] = medians[i]
    most = _RESTLESS * quantile_of(scratch, len(first), 1.0 / 3.0)
    quiet = 0
    for i in range(len(first)):
        if medians[i] <= most:
            scratch[quiet] = medians[i]
            quiet += 1
    return float(_MAD * median_of(scratch, quiet))


@kernel(
    f"void({READ_ONLY}, {_INTS}, {_FLOATS}, {_FLOATS}, {_FLOATS}, boolean[::1], {_FLOATS}, int64, int64, "
    f"float64[:, ::1], {_FLOATS})",
    exact=True,
)
def estimate_again(  # noqa: PLR0913  a kernel: arrays one by one
    time: FloatArray,
    first: IntArray,
    ends: FloatArray,
    centre: FloatArray,
    median: FloatArray,
    rest: BoolArray,
    start: FloatArray,
    begin: int,
    stop: int,
    lines: FloatArray,
    levels: FloatArray,
) -> None:
    """Fill the lines (m, 5) of intervals `begin` to `stop` - 1 again, and the levels (n,) of samples from there on."""
    scratch = np.empty(SCRATCH)
    for i in range(begin, stop):
        before = time[first[i]]
        last = fit_before(ends, centre, median, rest, start, before - GAP, scratch, lines[i])
        if before - last > EXTENDED:
            lines[i, 0] += lines[i, 1] * (last - lines[i, 2])
            lines[i, 1], lines[i, 2] = 0.0, last
    _evaluate(time, first, lines, begin, levels)
