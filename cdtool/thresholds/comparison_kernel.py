"""A statistic compared with limits, sample by sample: unknown samples, factors that meet a limit, several classes."""

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


@kernel(f"boolean({_MATRIX}, {_MATRIX}, {_MATRIX}, {_STATUS})")
def is_unknown_where_valid(values: FloatArray, lower: FloatArray, upper: FloatArray, status: StatusArray) -> bool:
    """Whether a sample (n, J) is valid although its value or one of its limits is NaN."""
    for k in range(values.shape[0]):
        for j in range(values.shape[1]):
            unknown = math.isnan(values[k, j]) or math.isnan(lower[k, j]) or math.isnan(upper[k, j])
            if unknown and status[k, j] == Status.VALID:
                return True
    return False


@kernel("float64(float64, float64, float64, float64)", fused=False)
def _met_at(value: float, limit: float, wider: float, factor: float) -> float:
    """Return the factor at which a value meets its limit, given at `factor` and `wider` at twice this factor."""
    if math.isnan(limit) or limit == math.inf:
        return -math.inf
    if wider == limit:
        return math.inf if value > limit else -math.inf
    return factor + factor * (value - limit) / (wider - limit)


@kernel(
    f"void({_MATRIX}, {_MATRIX}, {_MATRIX}, {_MATRIX}, {_MATRIX}, float64, float64[:,::1])",
    fused=False,
)
def factors_met(
    values: FloatArray,
    lower: FloatArray,
    upper: FloatArray,
    wider_lower: FloatArray,
    wider_upper: FloatArray,
    factor: float,
    met: FloatArray,
) -> None:
    """Fill (n, J) the factor at which each value meets its limits, given at `factor` and `wider` at twice this factor.

    -inf where no limit is known or the value is not limited.
    """
    for k in range(values.shape[0]):
        for j in range(values.shape[1]):
            above = _met_at(values[k, j], upper[k, j], wider_upper[k, j], factor)
            below = _met_at(-values[k, j], -lower[k, j], -wider_lower[k, j], factor)
            met[k, j] = above if above >= below or math.isnan(below) else below


@kernel(
    f"void({_MATRIX}, {_STATUS}, {_MATRIX}, {_MATRIX}, {_ROWS}, int64, "
    "float64[:,::1], uint8[:,::1], float64[:,::1], float64[:,::1], float64[:,::1], uint8[:,::1])",
    fused=False,
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
    for i in range(own_values.shape[0]):
        if not judges[i]:
            continue
        k = first + i
        for j in range(own_values.shape[1]):
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


@kernel(f"void({_MATRIX}, {_STATUS}, {_ROWS}, int64, float64[:,::1], b1[:,::1])", fused=False)
def lower_factors(
    own_met: FloatArray, own_status: StatusArray, judges: BoolArray, first: int, met: FloatArray, judged: BoolArray
) -> None:
    """Take a class's factors where they are lower than those so far, and mark the samples that any class judges."""
    for i in range(own_met.shape[0]):
        for j in range(own_met.shape[1]):
            if judges[i] and own_status[i, j] == Status.VALID:
                k = first + i
                if own_met[i, j] < met[k, j] or math.isnan(own_met[i, j]):
                    met[k, j] = own_met[i, j]
                judged[k, j] = True
