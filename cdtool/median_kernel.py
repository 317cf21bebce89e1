"""Medians and quantiles of short parts of a log as kernels, with the bits of numpy's.

A call of `np.median` costs more than the selection itself if the part is short; a log has hundreds of such parts.
"""

from __future__ import annotations

import math

from cdtool.kernels import READ_ONLY, kernel
from cdtool.recording import FloatArray

# Fewer values than this are sorted by insertion.
_FEW = 16
# Among more values than this the pivot is the median of three at random places: at fixed ones, a motion there and back
# takes n^2 steps. The random numbers are those of Park and Miller (1988) with the factor of 1993.
_MANY = 64
_FACTOR, _MODULUS = 48271, 2147483647


@kernel("float64(float64[::1], int64, int64, int64)", exact=True)
def _pivot(values: FloatArray, low: int, high: int, random: int) -> float:
    """Return the median of three of the values from `low` to `high`."""
    first = low
    middle = (low + high) // 2
    last = high
    if high - low >= _MANY:
        count = high - low + 1
        first = low + random % count
        middle = low + random * _FACTOR % _MODULUS % count
        last = low + random // count % count
    return float(max(min(values[first], values[middle]), min(max(values[first], values[middle]), values[last])))


@kernel("float64(float64[::1], int64, int64)", exact=True)
def kth_smallest(values: FloatArray, count: int, k: int) -> float:
    """Return the k-th smallest, from 0, of the first `count` values; reorder them so that no larger one is before it.

    None of them is NaN (Hoare 1961, Algorithm 65: FIND).
    """
    low = 0
    high = count - 1
    random = _FACTOR
    while high - low >= _FEW:
        random = random * _FACTOR % _MODULUS
        pivot = _pivot(values, low, high, random)
        # Without a branch per value: which values are smaller is not predictable.
        smaller = low
        for i in range(low, high + 1):
            value = values[i]
            values[i] = values[smaller]
            values[smaller] = value
            smaller += value < pivot
        if k < smaller:
            high = smaller - 1
        elif smaller > low:
            low = smaller
        else:
            # The pivot is the smallest of them: all that equal it are in their places next.
            for i in range(low, high + 1):
                value = values[i]
                values[i] = values[smaller]
                values[smaller] = value
                smaller += value <= pivot
            if k < smaller:
                return float(values[k])
            low = smaller
    for i in range(low + 1, high + 1):
        value = values[i]
        j = i - 1
        while j >= low and values[j] > value:
            values[j + 1] = values[j]
            j -= 1
        values[j + 1] = value
    return float(values[k])


@kernel("boolean(float64[::1], int64)", exact=True)
def has_nan(values: FloatArray, count: int) -> bool:
    """Return whether one of the first `count` values is NaN."""
    for i in range(count):  # noqa: SIM110  a kernel: no generator
        if math.isnan(values[i]):
            return True
    return False


@kernel("float64(float64[::1], int64)", exact=True)
def largest_of(values: FloatArray, count: int) -> float:
    """Return the largest of the first `count` values, at least one; none of them is NaN."""
    largest = values[0]
    for i in range(1, count):
        largest = max(largest, values[i])
    return float(largest)


@kernel("float64(float64[::1], int64)", exact=True)
def median_of(values: FloatArray, count: int) -> float:
    """Return the median of the first `count` values, which it reorders; NaN if one is NaN or the count is 0."""
    if count == 0 or has_nan(values, count):
        return math.nan
    middle = count // 2
    upper = kth_smallest(values, count, middle)
    if count % 2:
        return float(0.0 + upper)  # as in numpy, the median of negative zeros is 0
    return float((0.0 + largest_of(values, middle) + upper) / 2.0)


@kernel(f"float64({READ_ONLY}, float64[::1], int64)", exact=True)
def median_of_known(values: FloatArray, scratch: FloatArray, least: int) -> float:
    """Return the median of the finite values, NaN with fewer than `least`; `scratch` (n,) is overwritten."""
    count = 0
    for value in values:
        if math.isfinite(value):
            scratch[count] = value
            count += 1
    return float(median_of(scratch, count)) if count >= least else math.nan


@kernel("float64(float64[::1], int64, float64)", exact=True)
def quantile_of(values: FloatArray, count: int, share: float) -> float:
    """Return the quantile of the first `count` values, which it reorders, linear between two; NaN as `median_of`.

    A zero may have another sign than numpy's.
    """
    if count == 0 or has_nan(values, count):
        return math.nan
    place = (count - 1) * share
    before = min(math.floor(place), count - 1)
    upper = kth_smallest(values, count, min(before + 1, count - 1))
    lower = largest_of(values, before + 1)
    weight = place - before
    difference = upper - lower
    if weight >= 0.5:
        return float(upper - difference * (1.0 - weight))
    return float(lower + difference * weight)
