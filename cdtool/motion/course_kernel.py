"""Which samples fit a class of motion: the speed of a log compared with the learned one, sample by sample."""

from __future__ import annotations

import math

from cdtool.kernels import READ_ONLY, kernel
from cdtool.motion.progress import CONFIRM, START_SHARE
from cdtool.recording import BoolArray, FloatArray

# A speed fits within this many spreads of the mean.
_SPREADS = 5.5
# A stroke that ends at rest is below this share of the nominal speed at its end.
_SLOW = 0.5


@kernel(
    f"void({READ_ONLY}, {READ_ONLY}, {READ_ONLY}, Array(bool, 1, 'C', readonly=True), float64, float64, float64, "
    f"boolean, boolean, boolean, {READ_ONLY}, {READ_ONLY}, {READ_ONLY}, {READ_ONLY}, {READ_ONLY}, {READ_ONLY}, "
    "float64, b1[::1], b1[::1])",
    exact=True,
)
def fit_course(
    speed: FloatArray,
    elapsed: FloatArray,
    travel: FloatArray,
    running: BoolArray,
    direction: float,
    nominal_speed: float,
    least: float,
    is_learned: bool,
    uses_time: bool,
    uses_travel: bool,
    time_grid: FloatArray,
    mean_by_time: FloatArray,
    spread_by_time: FloatArray,
    travel_grid: FloatArray,
    mean_by_travel: FloatArray,
    spread_by_travel: FloatArray,
    travel_end: float,
    begun: BoolArray,
    fits: BoolArray,
) -> None:
    """Fill where the stroke of a class has `begun` (n,), and where the speed `fits` its mean and spread so far.

    A deviation from the mean by at most `least` fits. Before it has begun everything fits but a confirmed motion
    backward. From `travel_end` on, the last grid step, a stroke that ends at rest slows down. If the class `is_learned`
    not, the nominal speed is the mean once the axis runs, and all speeds up to it fit before.
    """
    backward = 0
    time_place = 0
    travel_place = 0
    for k in range(len(speed)):
        forward = direction * speed[k]
        backward = backward + 1 if forward <= -START_SHARE * nominal_speed else 0
        begun[k] = math.isfinite(elapsed[k])
        if not begun[k]:
            fits[k] = backward < CONFIRM
            continue
        if not is_learned:
            lowest = nominal_speed - least if running[k] else -least
            fits[k] = lowest <= forward <= nominal_speed + least
            continue
        along = 0.0 if math.isnan(travel[k]) else travel[k]
        if uses_travel and (running[k] or not uses_time):
            last = len(travel_grid) - 1
            while travel_place < last and travel_grid[travel_place + 1] <= along:
                travel_place += 1
            while travel_place > 0 and travel_grid[travel_place] > along:
                travel_place -= 1
            mean, spread = mean_by_travel[travel_place], spread_by_travel[travel_place]
            beyond = along - travel_grid[travel_place]
            if travel_place < last and beyond > 0.0:
                width = travel_grid[travel_place + 1] - travel_grid[travel_place]
                mean += (mean_by_travel[travel_place + 1] - mean) / width * beyond
                spread += (spread_by_travel[travel_place + 1] - spread) / width * beyond
        else:
            last = len(time_grid) - 1
            while time_place < last and time_grid[time_place + 1] <= elapsed[k]:
                time_place += 1
            while time_place > 0 and time_grid[time_place] > elapsed[k]:
                time_place -= 1
            mean, spread = mean_by_time[time_place], spread_by_time[time_place]
            beyond = elapsed[k] - time_grid[time_place]
            if time_place < last and beyond > 0.0:
                width = time_grid[time_place + 1] - time_grid[time_place]
                mean += (mean_by_time[time_place + 1] - mean) / width * beyond
                spread += (spread_by_time[time_place + 1] - spread) / width * beyond
        reach = _SPREADS * spread
        if reach < least:
            reach = least
        lowest, highest = mean - reach, mean + reach
        if running[k] and along >= travel_end and mean < _SLOW * nominal_speed and lowest > -least:
            lowest = -least
        fits[k] = lowest <= forward <= highest
