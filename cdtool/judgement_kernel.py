"""Classes of motion over a log, sample by sample: where none judges, and the limits of the one exceeded least."""

from __future__ import annotations

import math

from cdtool.detection import Status, StatusArray
from cdtool.kernels import kernel
from cdtool.recording import BoolArray, FloatArray

_MATRIX = "Array(float64, 2, 'C', readonly=True)"
_STATUS = "Array(uint8, 2, 'C', readonly=True)"
_ROWS = "Array(bool, 1, 'C', readonly=True)"

# Marks of a sample: on which sides a class leaves it unlimited, and whether a class limits it.
OPEN_BELOW, OPEN_ABOVE, LIMITED = 1, 2, 4


@kernel(f"void({_STATUS}, {_ROWS}, uint8[:,::1])")
def mark_elsewhere(status: StatusArray, judges: BoolArray, marked: StatusArray) -> None:
    """Fill `marked` (n, J): `status`, with OTHER_SPEED where a valid sample is not one that a class `judges` (n,)."""
    for j in range(status.shape[1]):
        for k in range(status.shape[0]):
            elsewhere = (status[k, j] == Status.VALID) & (not judges[k])
            marked[k, j] = Status.OTHER_SPEED.value if elsewhere else status[k, j]


@kernel(
    f"void({_MATRIX}, {_STATUS}, {_MATRIX}, {_MATRIX}, {_ROWS}, {_STATUS}, {_ROWS}, "
    "float64[:,::1], uint8[:,::1], float64[:,::1], float64[:,::1])"
)
def take_only_class(
    own_values: FloatArray,
    own_status: StatusArray,
    own_lower: FloatArray,
    own_upper: FloatArray,
    judges: BoolArray,
    signal_status: StatusArray,
    recent: BoolArray,
    values: FloatArray,
    status: StatusArray,
    lower: FloatArray,
    upper: FloatArray,
) -> None:
    """Fill `values`, `status` and limits (n, J) where the only class judges (n,), and what holds elsewhere.

    There, a valid sample of the signal is of another speed, or missing without a `recent` speed (n,).
    """
    for j in range(status.shape[1]):
        for k in range(status.shape[0]):
            taken = judges[k] & (own_status[k, j] == Status.VALID)
            values[k, j] = own_values[k, j] if taken else values[k, j]
            lower[k, j] = own_lower[k, j] if taken else math.nan
            upper[k, j] = own_upper[k, j] if taken else math.nan
            elsewhere = Status.OTHER_SPEED.value if recent[k] else Status.GAP.value
            state = elsewhere if signal_status[k, j] == Status.VALID else int(signal_status[k, j])
            status[k, j] = own_status[k, j] if judges[k] & (taken | (state == Status.OTHER_SPEED.value)) else state


@kernel(
    f"void({_MATRIX}, {_STATUS}, {_MATRIX}, {_MATRIX}, {_ROWS}, int64, "
    "float64[:,::1], uint8[:,::1], float64[:,::1], float64[:,::1], float64[:,::1], uint8[:,::1])",
)
def merge_share(
    own_values: FloatArray,
    own_status: StatusArray,
    own_lower: FloatArray,
    own_upper: FloatArray,
    judges: BoolArray,
    first: int,
    values: FloatArray,
    status: StatusArray,
    lower: FloatArray,
    upper: FloatArray,
    least: FloatArray,
    marks: StatusArray,
) -> None:
    """Take a class's statistic and limits where it is exceeded `least` so far; its own arrays begin at row `first`."""
    for j in range(own_values.shape[1]):
        for i in range(own_values.shape[0]):
            if not judges[i]:
                continue
            k = first + i
            if own_status[i, j] != Status.VALID:
                if status[k, j] == Status.OTHER_SPEED:
                    status[k, j] = own_status[i, j]
                continue
            value, low, high = own_values[i, j], own_lower[i, j], own_upper[i, j]
            above, below = value - high, low - value
            outside = above if above >= below or math.isnan(below) else below
            if outside < least[k, j] or status[k, j] != Status.VALID:
                values[k, j], lower[k, j], upper[k, j], least[k, j] = value, low, high, outside
                status[k, j] = Status.VALID
            if low == -math.inf:
                marks[k, j] |= OPEN_BELOW
            if high == math.inf:
                marks[k, j] |= OPEN_ABOVE
            if math.isfinite(low) or math.isfinite(high):
                marks[k, j] |= LIMITED


@kernel(f"void({_MATRIX}, {_STATUS}, {_ROWS}, int64, float64[:,::1], b1[:,::1])")
def lower_factors(
    own_met: FloatArray, own_status: StatusArray, judges: BoolArray, first: int, met: FloatArray, judged: BoolArray
) -> None:
    """Take a class's factors where they are lower than those so far, and mark the samples that any class judges."""
    for j in range(own_met.shape[1]):
        for i in range(own_met.shape[0]):
            if judges[i] and own_status[i, j] == Status.VALID:
                k = first + i
                if own_met[i, j] < met[k, j] or math.isnan(own_met[i, j]):
                    met[k, j] = own_met[i, j]
                judged[k, j] = True
