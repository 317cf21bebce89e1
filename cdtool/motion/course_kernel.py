"""Which samples fit a class of motion: the speed of a log compared with the learned one, sample by sample."""

from __future__ import annotations

import math
from typing import NamedTuple

from cdtool.kernels import READ_ONLY, kernel
from cdtool.motion.progress import CONFIRM, START_SHARE
from cdtool.recording import BoolArray, FloatArray

# A speed fits within this many spreads of the mean.
_SPREADS = 5.5
# A stroke that ends at rest is below this share of the nominal speed at its end.
_SLOW = 0.5


class Curves(NamedTuple):
    """Mean and spread of the speed over time and over travel; a curve that is not used has no points.

    The points over time are the first `time_points`. `travel_end`: the last grid point over travel but one.
    """

    grid: FloatArray
    mean: FloatArray
    spread: FloatArray
    time_points: float
    travel_end: float


class Expected(NamedTuple):
    """Direction and nominal speed of a class; a deviation from the mean of at most `least` fits it."""

    direction: float
    nominal_speed: float
    least: float


@kernel(
    f"void({READ_ONLY}, {READ_ONLY}, {READ_ONLY}, Array(bool, 1, 'C', readonly=True), Expected, Curves, "
    "b1[::1], b1[::1])",
    exact=True,
)
def fit_course(
    speed: FloatArray,
    elapsed: FloatArray,
    travel: FloatArray,
    running: BoolArray,
    expected: Expected,
    curves: Curves,
    begun: BoolArray,
    fits: BoolArray,
) -> None:
    """Fill where the stroke of a class has `begun` (n,), and where the speed `fits` its mean and spread so far.

    Before it has begun everything fits but a confirmed motion backward. In the last grid step of the travel, a stroke
    that ends at rest slows down. Without curves the nominal speed is the mean once the axis runs, and before that all
    speeds up to it fit. Beyond the ends of the grids, the curves are constant.
    """
    nominal, least = expected.nominal_speed, expected.least
    time_points, points = int(curves.time_points), len(curves.grid)
    backward = 0
    time_place = 0
    travel_place = time_points
    for k in range(len(speed)):
        forward = expected.direction * speed[k]
        backward = backward + 1 if forward <= -START_SHARE * nominal else 0
        begun[k] = math.isfinite(elapsed[k])
        if not begun[k]:
            fits[k] = backward < CONFIRM
            continue
        if points == 0:
            lowest = nominal - least if running[k] else -least
            fits[k] = lowest <= forward <= nominal + least
            continue
        along = 0.0 if math.isnan(travel[k]) else travel[k]
        by_travel = points > time_points and (running[k] or time_points == 0)
        if by_travel:
            location, place, first, last = along, travel_place, time_points, points - 1
        else:
            location, place, first, last = elapsed[k], time_place, 0, time_points - 1
        while place < last and curves.grid[place + 1] <= location:
            place += 1
        while place > first and curves.grid[place] > location:
            place -= 1
        if by_travel:
            travel_place = place
        else:
            time_place = place
        mean, spread = curves.mean[place], curves.spread[place]
        beyond = location - curves.grid[place]
        if place < last and beyond > 0.0:
            width = curves.grid[place + 1] - curves.grid[place]
            mean += (curves.mean[place + 1] - mean) / width * beyond
            spread += (curves.spread[place + 1] - spread) / width * beyond
        reach = _SPREADS * spread
        if reach < least:
            reach = least
        lowest, highest = mean - reach, mean + reach
        if running[k] and along >= curves.travel_end and mean < _SLOW * nominal and lowest > -least:
            lowest = -least
        fits[k] = lowest <= forward <= highest
