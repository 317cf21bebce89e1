"""The limits of a signature at each sample: between two grid points of its curves by straight lines, as numpy.interp.

The curves over time and over travel are one table, the curve over time first. Where a sample is in the table depends on
the motion alone: signatures of several detectors with the same grids share it.
"""

from __future__ import annotations

import math

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


@kernel(
    f"void({READ_ONLY}, {READ_ONLY}, Array(bool, 1, 'C', readonly=True), boolean, boolean, {READ_ONLY}, float64, "
    f"float64, {READ_ONLY}, float64, int32[::1], int32[::1], float64[::1])",
    exact=True,
)
def locate(
    elapsed: FloatArray,
    travel: FloatArray,
    running: BoolArray,
    uses_time: bool,
    uses_travel: bool,
    time_grid: FloatArray,
    time_step: float,
    time_end: float,
    travel_grid: FloatArray,
    travel_step: float,
    place: PlaceArray,
    nearest: PlaceArray,
    beyond: FloatArray,
) -> None:
    """Fill each sample's last grid point, how far `beyond` it the sample is, and the nearest grid point.

    Without one, one past the last: before the motion begins, or outside the grid, which still has a nearest point.
    If both time and travel are used, the time counts until the axis runs, and at most up to `time_end`.
    """
    time_place = 0
    travel_place = 0
    none = len(time_grid) + len(travel_grid)
    for k in range(len(elapsed)):
        place[k] = none
        nearest[k] = none
        beyond[k] = 0.0
        if not math.isfinite(elapsed[k]):
            continue
        by_travel = uses_travel and (running[k] or not uses_time)
        if by_travel:
            location, step, last, first = travel[k], travel_step, len(travel_grid) - 1, len(time_grid)
        else:
            location, step, last, first = elapsed[k], time_step, len(time_grid) - 1, 0
            if uses_travel and location > time_end:
                location = time_end
        if math.isnan(location):
            nearest[k] = first
            if last == 0:  # as numpy: a grid of a single point has its value there
                place[k] = first
            continue
        steps = np.rint(location / step)
        nearest[k] = first + (min(max(int(steps), 0), last) if abs(steps) < _TOO_MANY_STEPS else 0)
        if by_travel:
            if travel_grid[0] <= location <= travel_grid[last]:
                while travel_place < last and travel_grid[travel_place + 1] <= location:
                    travel_place += 1
                while travel_grid[travel_place] > location:
                    travel_place -= 1
                place[k] = first + travel_place
                beyond[k] = location - travel_grid[travel_place]
        elif time_grid[0] <= location <= time_grid[last]:
            while time_place < last and time_grid[time_place + 1] <= location:
                time_place += 1
            while time_grid[time_place] > location:
                time_place -= 1
            place[k] = time_place
            beyond[k] = location - time_grid[time_place]


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
