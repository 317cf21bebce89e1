"""The usual step of a clock: the median of the last 9 steps, at each sample, so that it is causal."""

from __future__ import annotations

import weakref

import numpy as np

from cdtool.kernels import READ_ONLY, kernel
from cdtool.recording import FloatArray

RECENT_STEPS = 9
_BEFORE = RECENT_STEPS - 1
# Samples whose medians are computed together: their work arrays fit into the fastest cache.
_BLOCK = 512
# A window of nine is three triples, the oldest of them six samples before the newest.
_TRIPLES_BACK = 6
# Up to this many samples the usual steps are kept with the array of times; beyond, memory is worth more than time.
_MOST_KEPT = 1 << 20

_kept: dict[int, tuple[weakref.ref[FloatArray], FloatArray]] = {}


def usual_steps(time: FloatArray) -> FloatArray:
    """Return the median of the last 9 steps up to each sample.

    Parameters
    ----------
    time : ndarray of float, shape (n,)
        Strictly increasing times [s].

    Returns
    -------
    ndarray of float, shape (n,)
        The usual step [s], read-only; infinite at the first sample. Steps before the first are assumed to equal it.

    Notes
    -----
    For an array of times that cannot be written to, as those of a `Series` and of a signal on its clock, the result is
    computed once and kept for as long as the array exists.

    Examples
    --------
    >>> import numpy as np
    >>> usual_steps(np.array([0.0, 0.25, 0.5, 1.5])).tolist()
    [inf, 0.25, 0.25, 0.25]
    """
    kept = _kept.get(id(time))
    if kept is not None and kept[0]() is time:
        return kept[1]
    usual = np.full(len(time), np.inf)
    if len(time) > 1:
        padded = np.empty(len(time) + _BEFORE - 1)
        np.subtract(time[1:], time[:-1], out=padded[_BEFORE:])
        padded[:_BEFORE] = padded[_BEFORE]
        _take_medians(padded, usual[1:])
    usual.flags.writeable = False
    if not time.flags.writeable and len(time) <= _MOST_KEPT:
        key = id(time)
        _kept[key] = weakref.ref(time, lambda _: _kept.pop(key, None)), usual
    return usual


def recent_medians(steps: FloatArray, before: float) -> FloatArray:
    """Return the median of the last 9 steps at each step (n,); steps before the first are assumed to be `before`.

    NaN where one of the nine is NaN.
    """
    medians = np.empty(len(steps))
    _take_medians(np.concatenate((np.full(_BEFORE, before), steps)), medians)
    return medians


def _take_medians(padded: FloatArray, medians: FloatArray) -> None:
    """Fill `medians` (n,) with those of nine consecutive steps (n + 8,)."""
    unknown = _fill_medians(padded, *np.empty((3, _BLOCK + _TRIPLES_BACK)), medians)
    if unknown and len(medians):
        windows = np.lib.stride_tricks.sliding_window_view(np.isnan(padded), RECENT_STEPS)
        medians[windows.any(axis=1)] = np.nan


@kernel(f"int64({READ_ONLY}, float64[::1], float64[::1], float64[::1], float64[::1])")
def _fill_medians(steps: FloatArray, low: FloatArray, middle: FloatArray, high: FloatArray, medians: FloatArray) -> int:
    """Fill `medians` (n,) of nine consecutive `steps` (n + 8,); return how many steps are NaN.

    The median of nine is the median of three numbers: the largest of the smallest of three triples, the median of their
    medians, and the smallest of their largest. Each triple is sorted once, into a row of the three work arrays.
    """
    unknown = 0
    for k in range(len(steps)):
        unknown += 1 if steps[k] != steps[k] else 0
    for begin in range(0, len(medians), _BLOCK):
        count = min(_BLOCK, len(medians) - begin)
        for i in range(count + _TRIPLES_BACK):
            a, b, c = steps[begin + i], steps[begin + i + 1], steps[begin + i + 2]
            less, more = (a, b) if a < b else (b, a)
            least, rest = (less, c) if less < c else (c, less)
            low[i] = least
            middle[i] = more if more < rest else rest
            high[i] = rest if more < rest else more
        for i in range(count):
            a, b, c = low[i], low[i + 3], low[i + 6]
            a = b if a < b else a
            largest_low = c if a < c else a
            a, b, c = high[i], high[i + 3], high[i + 6]
            a = a if a < b else b
            smallest_high = a if a < c else c
            a, b, c = middle[i], middle[i + 3], middle[i + 6]
            less, more = (a, b) if a < b else (b, a)
            more = more if more < c else c
            middle_median = more if less < more else less
            a, b, c = largest_low, middle_median, smallest_high
            less, more = (a, b) if a < b else (b, a)
            more = more if more < c else c
            medians[begin + i] = more if less < more else less
    return unknown
