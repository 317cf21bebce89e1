"""A statistic compared with its limits, sample by sample: unknown samples, and factors that meet a limit.

Without branches, so that the loops become vector instructions.
"""

from __future__ import annotations

import math

from cdtool.base.arrays import FloatArray
from cdtool.base.kernels import READ_ONLY, kernel
from cdtool.detectors.detection import Status, StatusArray

_STATUS = "Array(uint8, 1, 'C', readonly=True)"


@kernel(f"int64({READ_ONLY}, {READ_ONLY}, {READ_ONLY}, {_STATUS})")
def unknown_but_valid(values: FloatArray, lower: FloatArray, upper: FloatArray, status: StatusArray) -> int:
    """Return how many samples (m,) are valid although their value or one of their limits is NaN."""
    count = 0
    for i in range(len(values)):
        unknown = (values[i] != values[i]) | (lower[i] != lower[i]) | (upper[i] != upper[i])
        count += 1 if unknown & (status[i] == Status.VALID) else 0
    return count


@kernel(
    f"void({READ_ONLY}, {READ_ONLY}, {READ_ONLY}, {READ_ONLY}, {READ_ONLY}, float64, float64[::1])",
    exact=True,
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
    """Fill (m,) the factor at which each value meets its limits, given at `factor` and `wider` at twice this factor.

    -inf where no limit is known or the value is not limited.
    """
    for i in range(len(values)):
        value, limit, wider = values[i], upper[i], wider_upper[i]
        above = factor + factor * (value - limit) / (wider - limit)
        above = above if wider != limit else (math.inf if value > limit else -math.inf)
        above = -math.inf if (limit != limit) | (limit == math.inf) else above
        value, limit, wider = -values[i], -lower[i], -wider_lower[i]
        below = factor + factor * (value - limit) / (wider - limit)
        below = below if wider != limit else (math.inf if value > limit else -math.inf)
        below = -math.inf if (limit != limit) | (limit == math.inf) else below
        met[i] = above if (above >= below) | (below != below) else below
