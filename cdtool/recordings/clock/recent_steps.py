"""The usual step of a clock: the median of the last 9 steps, at each sample, so that it is causal."""

from __future__ import annotations

import weakref

import numpy as np

from cdtool.base.arrays import FloatArray

#: Enough that their median is the period of a jittering clock, few enough to follow a change of rate.
RECENT_STEPS = 9
_BEFORE = RECENT_STEPS - 1

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
    # Up to a million samples the usual steps are kept with the array of times; beyond, memory is worth more than time.
    if not time.flags.writeable and len(time) <= 1 << 20:
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
    """Fill `medians` (n,) with those of nine consecutive steps (n + 8,).

    The median of nine is the median of three numbers: the largest of the smallest of three triples, the median of their
    medians, and the smallest of their largest. Each triple is sorted once.
    """
    if not len(medians):
        return
    triples = [padded[i : len(padded) - 2 + i] for i in range(3)]
    low, middle, high = np.minimum.reduce(triples), _middle(*triples), np.maximum.reduce(triples)
    count = len(medians)
    lows, middles, highs = ([row[i : i + count] for i in (0, 3, 6)] for row in (low, middle, high))
    medians[:] = _middle(np.maximum.reduce(lows), _middle(*middles), np.minimum.reduce(highs))


def _middle(a: FloatArray, b: FloatArray, c: FloatArray) -> FloatArray:
    return np.maximum(np.minimum(a, b), np.minimum(np.maximum(a, b), c))
