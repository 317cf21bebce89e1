"""The travel of a joint as a kernel: medians of equal parts of its position, and the steps between samples."""

from __future__ import annotations

import math

import numpy as np

from cdtool.kernels import READ_ONLY, kernel
from cdtool.median_kernel import median_of
from cdtool.recording import FloatArray

# Rounding errors are far smaller than a step of any encoder: this share of the largest position, or this value.
_ROUNDING, _LEAST = 1e-9, 1e-300


@kernel(f"UniTuple(float64, 3)({READ_ONLY}, int64)", exact=True)
def travel_of(position: FloatArray, parts: int) -> tuple[float, float, float]:
    """Return the range of the medians of so many parts of a position (n,), its smallest step and its largest one.

    The smallest step is that of an encoder, without rounding errors; 0 if all are equal. No sample is missing, and
    no part is empty: the first n modulo `parts` of them have a sample more.
    """
    count = len(position)
    scratch = np.empty(count // parts + 1)
    lowest = math.inf
    highest = -math.inf
    begin = 0
    for i in range(parts):
        size = count // parts + (1 if i < count % parts else 0)
        for k in range(size):
            scratch[k] = position[begin + k]
        begin += size
        median = median_of(scratch, size)
        lowest, highest = min(lowest, median), max(highest, median)
    farthest = _LEAST
    for k in range(count):
        farthest = max(farthest, abs(position[k]))
    smallest = 0.0
    largest = 0.0
    is_any = False
    for k in range(1, count):
        step = abs(position[k] - position[k - 1])
        largest = max(largest, step)
        if step > _ROUNDING * farthest and (step < smallest or not is_any):
            smallest = step
            is_any = True
    return float(highest - lowest), float(smallest), float(largest)
