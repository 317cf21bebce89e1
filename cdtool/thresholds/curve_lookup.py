"""Mean and spread of learned curves at each location of a run, by straight lines between the grid points."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.base.kernels import READ_ONLY, fields_of, kernel

# More grid steps than a number holds exactly: the nearest grid point is then the first.
_TOO_MANY_STEPS = 2.0**53


class LearnedColumn(NamedTuple):
    """Mean and spread (g,) of one joint on the grid (g,) with its `step`, and their slopes (g - 1,) after each point.

    `infinite` is 1 if mean or spread are infinite anywhere, otherwise 0.
    """

    grid: FloatArray
    mean: FloatArray
    spread: FloatArray
    mean_slope: FloatArray
    spread_slope: FloatArray
    step: float
    infinite: float


@kernel("float64(float64, float64, float64, float64, float64)", exact=True)
def _between(value: float, after: float, slope: float, since: float, until: float) -> float:
    """Return the straight line from a value to the one `after` it, at `since` from the first, `until` the second."""
    result = slope * since + value
    if math.isnan(result):
        result = slope * until + after
        if math.isnan(result) and value == after:
            result = value
    return float(result)


@kernel(
    f"void({READ_ONLY}, Array(bool, 1, 'C', readonly=True), boolean, {fields_of(LearnedColumn)}, float64, float64, "
    "float64[::1], float64[::1])",
    exact=True,
)
def look_up(  # noqa: PLR0913  a kernel: one loop, arrays and numbers one by one
    locations: FloatArray,
    running: BoolArray,
    phase: bool,
    column: LearnedColumn,
    farthest: float,
    least: float,
    mean: FloatArray,
    spread: FloatArray,
) -> None:
    """Fill mean and spread (n,) at the locations of a run where `running` is `phase`; NaN outside the grid.

    No location is beyond the farthest one, and no spread below `least`.
    """
    grid, means, spreads = column.grid, column.mean, column.spread
    mean_slopes, spread_slopes = column.mean_slope, column.spread_slope
    last = len(grid) - 1
    at = 0
    for k in range(len(locations)):
        if running[k] != phase:
            continue
        location = farthest if locations[k] > farthest else locations[k]
        middle = wide = math.nan
        # As numpy, NaN included: a grid of a single point has its value there.
        if grid[0] <= location <= grid[last] or (last == 0 and math.isnan(location)):
            while at < last and grid[at + 1] <= location:
                at += 1
            while grid[at] > location:
                at -= 1
            middle, wide = means[at], spreads[at]
            if at < last and location != grid[at]:
                since, until = location - grid[at], location - grid[at + 1]
                middle = _between(means[at], means[at + 1], mean_slopes[at], since, until)
                wide = _between(spreads[at], spreads[at + 1], spread_slopes[at], since, until)
        if column.infinite > 0.0:
            steps = 0.0 if math.isnan(location) else np.rint(location / column.step)
            nearest = min(max(int(steps), 0), last) if abs(steps) < _TOO_MANY_STEPS else 0
            middle = means[nearest] if math.isinf(means[nearest]) else middle
            wide = spreads[nearest] if math.isinf(spreads[nearest]) else wide
        mean[k] = middle
        spread[k] = least if wide < least else wide
