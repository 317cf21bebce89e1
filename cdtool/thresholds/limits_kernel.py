"""The limits of a signature at each sample: between two grid points of its curves by straight lines, as numpy.interp.

The curves over time and over travel are one table, the curve over time first. Where a sample is in the table depends on
the motion alone: signatures of several detectors with the same grids share it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from cdtool.detection import Status, StatusArray
from cdtool.kernels import READ_ONLY, kernel
from cdtool.recording import BoolArray, FloatArray

PlaceArray = npt.NDArray[np.int32]

# A location of so many grid steps, 2^63, has no number that an int64 can represent.
_TOO_MANY_STEPS = 2.0**63

_PLACES = "Array(int32, 1, 'C', readonly=True)"
_TABLE = "Array(float64, 2, 'C', readonly=True)"


class Grids(NamedTuple):
    """The grids of a signature's curves over time and over travel; a curve that is not used has no `points`.

    The points over time are the first `time_points`; `time_end`: the last one that enough runs have reached.
    """

    points: FloatArray
    time_points: float
    time_step: float
    time_end: float
    travel_step: float


@kernel(
    f"void({READ_ONLY}, {READ_ONLY}, Array(bool, 1, 'C', readonly=True), Grids, int32[::1], int32[::1], float64[::1])",
    exact=True,
)
def locate(
    elapsed: FloatArray,
    travel: FloatArray,
    running: BoolArray,
    grids: Grids,
    place: PlaceArray,
    nearest: PlaceArray,
    beyond: FloatArray,
) -> None:
    """Fill each sample's last grid point, how far `beyond` it the sample is, and the nearest grid point.

    Without one, one past the last: before the motion begins, or outside the grid, which still has a nearest point.
    If both time and travel are used, the time counts until the axis runs, and at most up to `time_end`.
    """
    grid, time_points, points = grids.points, int(grids.time_points), len(grids.points)
    uses_time, uses_travel = time_points > 0, points > time_points
    time_place = 0
    travel_place = time_points
    for k in range(len(elapsed)):
        place[k] = points
        nearest[k] = points
        beyond[k] = 0.0
        if not math.isfinite(elapsed[k]):
            continue
        by_travel = uses_travel and (running[k] or not uses_time)
        if by_travel:
            location, step, at, first, last = travel[k], grids.travel_step, travel_place, time_points, points - 1
        else:
            location, step, at, first, last = elapsed[k], grids.time_step, time_place, 0, time_points - 1
            if uses_travel and location > grids.time_end:
                location = grids.time_end
        if math.isnan(location):
            nearest[k] = first
            if last == first:  # as numpy: a grid of a single point has its value there
                place[k] = first
            continue
        steps = np.rint(location / step)
        nearest[k] = first + (min(max(int(steps), 0), last - first) if abs(steps) < _TOO_MANY_STEPS else 0)
        if location < grid[first] or location > grid[last]:
            continue
        while at < last and grid[at + 1] <= location:
            at += 1
        while grid[at] > location:
            at -= 1
        place[k] = at
        beyond[k] = location - grid[at]
        if by_travel:
            travel_place = at
        else:
            time_place = at


@kernel(f"void({_PLACES}, {_PLACES}, {READ_ONLY}, {_TABLE}, {_TABLE}, boolean, float64[:,::1])", exact=True)
def _limit_at(
    place: PlaceArray,
    nearest: PlaceArray,
    beyond: FloatArray,
    table: FloatArray,
    slope: FloatArray,
    has_infinite: bool,
    limit: FloatArray,
) -> None:
    """Fill a limit (n, J) from its values and slopes at each grid point (g, J); NaN where it is not known.

    The last row of the table is NaN. Where the nearest grid point has an infinite limit, it is infinite: a straight
    line would be NaN there.
    """
    for j in range(table.shape[1]):
        for k in range(len(place)):
            at = np.uint32(place[k])
            value = table[at, j]
            limit[k, j] = value if beyond[k] == 0.0 else slope[at, j] * beyond[k] + value
        if not has_infinite:
            continue
        for k in range(len(place)):
            at = np.uint32(place[k])
            close = table[np.uint32(nearest[k]), j]
            if math.isinf(close):
                limit[k, j] = close
            elif math.isnan(limit[k, j]) and beyond[k] != 0.0:
                # From the next point back: the slope is infinite or NaN, the distance does not matter.
                limit[k, j] = table[at + 1, j] - slope[at, j]
                if math.isnan(limit[k, j]) and table[at, j] == table[at + 1, j]:
                    limit[k, j] = table[at, j]


@kernel(
    f"void({_PLACES}, {_PLACES}, {READ_ONLY}, {_TABLE}, {_TABLE}, boolean, {_TABLE}, {_TABLE}, boolean, "
    "Array(uint8, 1, 'C', readonly=True), float64[:,::1], float64[:,::1], uint8[::1])",
    exact=True,
)
def limits_at(
    place: PlaceArray,
    nearest: PlaceArray,
    beyond: FloatArray,
    lower_table: FloatArray,
    lower_slope: FloatArray,
    lower_has_infinite: bool,
    upper_table: FloatArray,
    upper_slope: FloatArray,
    upper_has_infinite: bool,
    status: StatusArray,
    lower: FloatArray,
    upper: FloatArray,
    limited: StatusArray,
) -> None:
    """Fill both limits (n, J), and `limited` (n J,): `status` with NO_LIMIT where a valid sample's limit is unknown."""
    _limit_at(place, nearest, beyond, lower_table, lower_slope, lower_has_infinite, lower)
    _limit_at(place, nearest, beyond, upper_table, upper_slope, upper_has_infinite, upper)
    low, high = lower.reshape(lower.size), upper.reshape(upper.size)
    for i in range(len(status)):
        unlimited = (status[i] == Status.VALID) & ((low[i] != low[i]) | (high[i] != high[i]))
        limited[i] = Status.NO_LIMIT.value if unlimited else status[i]
