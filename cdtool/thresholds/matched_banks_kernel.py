"""The loops of `matched_banks`: when a motion is settled, innovations of several channels, evidence of templates."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from cdtool.kernels import READ_ONLY, kernel
from cdtool.recording import FloatArray

IndexArray = npt.NDArray[np.int64]
MarkArray = npt.NDArray[np.uint8]

_TABLE = "Array(float64, 2, 'C', readonly=True)"
_CUBE = "Array(float64, 3, 'C', readonly=True)"
_INDEX = "Array(int64, 1, 'C', readonly=True)"
_INDICES = "Array(int64, 2, 'C', readonly=True)"
_MARKS = "Array(uint8, 1, 'C', readonly=True)"

# Marks of a sample: a column is missing; all are known; all are known, but the sample before was lost.
UNKNOWN, KNOWN, AFTER_GAP = range(3)
# Rows of the table of a template's numbers (f, groups): see `evidence_of`.
LENGTH, STRIDE, MEMORY, MASK, WINDOW, FIRST, LAST, BANK = range(8)
# Rows of the table of what was learned about a template: mean and deviation of its runs' maxima, prior, slack.
CENTRE, SPREAD, PRIOR, SLACK = range(4)
# From this stride on, a response is summed where it is needed; below, for all samples at once, which is faster.
_SPARSE = 4
# A non-negative fit is good enough once no coefficient changes its sum by more than this share.
_SWEEPS, _ENOUGH = 30, 1e-3


@kernel(f"int64({READ_ONLY}, int64, int64, float64, float64)")
def settled_from(speed: FloatArray, short: int, long: int, share: float, least: float) -> int:
    """Return the first sample at which the motion is settled; the number of samples if it never is.

    u: mean of `speed` (n,) over `short` samples. Settled: u changed by at most `share` of its largest change over
    `long` samples so far, and is above `least`, for `short` samples one after another.
    """
    total = 0.0
    largest = 0.0
    calm = 0
    mean = np.zeros(len(speed))
    for k in range(len(speed)):
        total += speed[k]
        if k >= short:
            total -= speed[k - short]
        mean[k] = total / short
        before = mean[k - long] if k >= long else 0.0
        change = abs(mean[k] - before)
        largest = max(largest, change)
        calm = calm + 1 if (change <= share * largest and mean[k] > least) else 0
        if calm >= short:
            return k
    return len(speed)


# Innovations are computed for so many samples at a time, which stay in the processor's fastest cache.
_BLOCK = 512


@kernel(f"void({_TABLE}, {_MARKS}, {_CUBE}, {_TABLE}, int64, float64[:,::1])")
def innovations_of(
    deviation: FloatArray,
    known: MarkArray,
    model: FloatArray,
    root: FloatArray,
    first: int,
    innovations: FloatArray,
) -> None:
    """Fill rows `first` to `first` + C of `innovations` with those of deviations (C, n) by a vector autoregression.

    `model` (p, C, C): the deviation i samples before is multiplied by `model[i - 1]`; `root` (C, C): inverse square
    root of the innovations' covariance. `known` (n,): `UNKNOWN` etc. An innovation is 0, no evidence, until
    the `p` samples before it and itself are known.
    """
    order, channels, n = model.shape[0], model.shape[1], deviation.shape[1]
    rest = np.empty((channels, _BLOCK))
    run = 0
    for begin in range(0, n, _BLOCK):
        end = min(begin + _BLOCK, n)
        for c in range(channels):
            for k in range(begin, end):
                rest[c, k - begin] = deviation[c, k]
            for i in range(1, order + 1):
                since = max(begin, i)
                for d in range(channels):
                    factor = model[i - 1, c, d]
                    for k in range(since, end):
                        rest[c, k - begin] -= factor * deviation[d, k - i]
        for c in range(channels):
            for k in range(begin, end):
                innovations[first + c, k] = 0.0
            for d in range(channels):
                factor = root[c, d]
                for k in range(begin, end):
                    innovations[first + c, k] += factor * rest[d, k - begin]
        for k in range(begin, end):
            run = 0 if known[k] == UNKNOWN else (1 if known[k] == AFTER_GAP else run + 1)
            if run <= order:
                for c in range(channels):
                    innovations[first + c, k] = 0.0


@kernel(f"float64(float64[::1], {_TABLE}, {_MARKS}, int64, int64, float64[::1])")
def _non_negative(
    evidence: FloatArray, gram: FloatArray, free: MarkArray, first: int, count: int, x: FloatArray
) -> float:
    """Return the largest 2 b'x - x'Gx over x that are not negative where not `free`, by coordinate ascent from `x`."""
    for _ in range(_SWEEPS):
        gained = 0.0
        for i in range(count):
            slope = evidence[i]
            for j in range(count):
                slope -= gram[first + i, j] * x[j]
            step = slope / gram[first + i, i]
            if not free[first + i] and x[i] + step < 0.0:
                step = -x[i]
            x[i] += step
            gained += step * (2.0 * slope - gram[first + i, i] * step)
        best = 0.0
        for i in range(count):
            slope = 2.0 * evidence[i]
            for j in range(count):
                slope -= gram[first + i, j] * x[j]
            best += slope * x[i]
        if gained <= _ENOUGH * best:
            return best
    return best


@kernel(f"float64(float64[::1], {_TABLE}, {_MARKS}, int64)")
def _non_negative_pair(evidence: FloatArray, gram: FloatArray, free: MarkArray, first: int) -> float:
    """Return `_non_negative` of two components: of both if that is allowed, otherwise of the better one alone."""
    b, c = evidence[0], evidence[1]
    g, h, k = gram[first, 0], gram[first, 1], gram[first + 1, 1]
    size = g * k - h * h
    x, y = (k * b - h * c) / size, (g * c - h * b) / size
    if (x >= 0.0 or free[first]) and (y >= 0.0 or free[first + 1]):
        both: float = b * x + c * y
        return both
    best: float = b * b / g if b > 0.0 or free[first] else 0.0
    other: float = c * c / k if c > 0.0 or free[first + 1] else 0.0
    return max(best, other)


@kernel(
    f"void({_TABLE}, {_INDICES}, {_INDEX}, {_INDEX}, {_INDEX}, {READ_ONLY}, {_TABLE}, {_TABLE}, {_MARKS}, "
    f"{_TABLE}, {_TABLE}, {_INDEX}, int64, int64, {_INDEX}, float64[:,::1])"
)
def evidence_of(
    total: FloatArray,
    groups: IndexArray,
    first_node: IndexArray,
    lag: IndexArray,
    column: IndexArray,
    weight: FloatArray,
    gain: FloatArray,
    gram: FloatArray,
    free: MarkArray,
    usual: FloatArray,
    learned: FloatArray,
    place: IndexArray,
    start: int,
    mode: int,
    rows: IndexArray,
    result: FloatArray,
) -> None:
    """Raise `result` (rows, n), NaN at first, to the evidence of each template group, while it runs, in its row.

    `total` (C, n + 1): summed innovations. `groups` (8, G): see `LENGTH` etc.; the components of a group are
    `FIRST` to `LAST`. The response of component c is the sum of weight total[column, k + 1 - lag] over its nodes,
    `first_node[c]` to `first_node[c + 1]`, less gain[c] times the mean innovation before. `gram` (components, K).
    `usual` (G, places): usual size of Z, `place` (n,) where. `mode` 0: Z; 1: Z over its usual and its own recent size,
    less the mean of the runs' maxima, over their deviation.
    """
    n = total.shape[1] - 1
    channels = total.shape[0]
    widest = gram.shape[1]
    responses = np.empty((widest, n))
    fit = np.empty(widest)
    evidence = np.empty(widest)
    recent = np.empty(n + 1)
    inverse = np.empty(usual.shape[1])
    for g in range(groups.shape[1]):
        length, stride, memory = groups[LENGTH, g], groups[STRIDE, g], groups[MEMORY, g]
        opens = start + groups[MASK, g]
        window = groups[WINDOW, g]
        first, last = groups[FIRST, g], groups[LAST, g]
        count = last - first
        opens = max(opens, length)
        row = rows[g]
        if opens >= n:
            continue
        sparse = stride >= _SPARSE
        for i in range(0 if sparse else count):
            for k in range(opens, n):
                responses[i, k] = 0.0
            for node in range(first_node[first + i], first_node[first + i + 1]):
                w, shift, c = weight[node], 1 - lag[node], column[node]
                for k in range(opens, n):
                    responses[i, k] += w * total[c, k + shift]
        limit = learned[SLACK, g] * learned[SLACK, g]
        centre, spread, prior = learned[CENTRE, g], learned[SPREAD, g], learned[PRIOR, g]
        for i in range(count):
            fit[i] = 0.0
        # Evaluations so far, and how many of them lie within a template and within its memory of its own size.
        done = 0
        recent[0] = 0.0
        counted, share = 0, 1.0 / prior
        for at in range(usual.shape[1]):
            inverse[at] = 1.0 / (usual[g if mode == 1 else 0, at] * usual[g if mode == 1 else 0, at])
        own, past = (length + stride - 1) // stride, window // stride
        k = opens
        while k < n:
            for i in range(count):
                evidence[i] = 0.0 if sparse else responses[i, k]
                if sparse:
                    for node in range(first_node[first + i], first_node[first + i + 1]):
                        evidence[i] += weight[node] * total[column[node], k + 1 - lag[node]]
            if memory > 0:
                newest = k + 1 - length
                oldest = max(newest - memory, start)
                per_sample = 1.0 / (newest - oldest)
                for c in range(channels):
                    drift = per_sample * (total[c, newest] - total[c, oldest])
                    for i in range(count):
                        evidence[i] -= gain[first + i, c] * drift
            if count == 2:
                square = _non_negative_pair(evidence, gram, free, first)
            elif count > 2:
                square = _non_negative(evidence, gram, free, first, count, fit)
            else:
                square = evidence[0] * evidence[0] / gram[first, 0] if evidence[0] > 0.0 or free[first] else 0.0
            square = max(0.0, square)
            value = math.nan
            if mode == 0:
                value = math.sqrt(square)
            else:
                square *= inverse[place[k]]
                recent[done + 1] = recent[done] + square
                until = max(done + 1 - own, 0)
                since = max(until - past, 0)
                if until - since != counted:
                    counted = until - since
                    share = 1.0 / (prior + stride * counted)
                size = (prior + stride * (recent[until] - recent[since])) * share
                if size > limit:
                    square *= limit / size
                done += 1
            for held in range(k, min(k + stride, n)):
                # The root is needed only where this is the largest so far.
                needed = result[row, held] * spread + centre
                if mode == 1 and needed > 0.0 and square <= needed * needed:
                    continue
                if math.isnan(value):
                    value = (math.sqrt(square) - centre) / spread
                if not result[row, held] >= value:
                    result[row, held] = value
            k += stride
