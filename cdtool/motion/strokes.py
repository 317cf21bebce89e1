"""Cutting a log into strokes as it comes: each begins where what has been logged so far shows that it does."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cdtool.kernels import READ_ONLY, kernel
from cdtool.motion.motion_class import MotionClass
from cdtool.motion.progress import START_SHARE
from cdtool.recording import FloatArray, Recording

# A rest this long [s] ends a stroke; a shorter one is a pause in it.
SHORTEST_REST = 0.2
# Consecutive samples backward that end a stroke without a rest.
_CONFIRM = 3


@dataclass(frozen=True)
class Stroke:
    """A stroke judged from `applies` [s] on, with what was logged since `start` [s] <= `applies`."""

    start: float
    applies: float


def strokes_so_far(recording: Recording, how: str, classes: Sequence[MotionClass]) -> list[Stroke]:
    """Return the strokes of a log, each decided at or before it applies; one of the whole log where it is not cut.

    By "motion" a stroke ends with a rest of 0.2 s after a motion, or where the motion turns round. The axis rests below
    10 % of the slowest class's nominal speed; without classes, below 10 % of the highest speed of any joint so far. By
    "trigger" a stroke begins at each rising edge.
    """
    begin = Stroke(-np.inf, -np.inf)
    if how == "trigger" and "trigger" in recording:
        series = recording["trigger"]
        high = np.nan_to_num(series.values[:, 0]) > 0.5
        edges = np.flatnonzero(high[1:] & ~high[:-1]) + 1
        return [begin, *(Stroke(float(series.time[k]), float(series.time[k])) for k in edges)]
    if how != "motion" or "speed" not in recording:
        return [begin]
    speed = recording["speed"]
    if classes:
        slowest = min(classes, key=lambda item: item.nominal_speed)
        values = np.ascontiguousarray(speed.values[:, slowest.joint])
        resting = np.full(len(values), START_SHARE * slowest.nominal_speed)
    else:
        values = np.max(np.abs(speed.values), axis=1)
        resting = START_SHARE * np.fmax.accumulate(values)
    start = np.empty(len(speed.time), dtype=np.int64)
    applies = np.empty(len(speed.time), dtype=np.int64)
    count = _cut(speed.time, values, resting, SHORTEST_REST, start, applies)
    cuts = zip(speed.time[start[:count]].tolist(), speed.time[applies[:count]].tolist(), strict=True)
    return [begin, *(Stroke(first, last) for first, last in cuts)]


@kernel(f"int64({READ_ONLY}, {READ_ONLY}, {READ_ONLY}, float64, int64[::1], int64[::1])")
def _cut(
    time: FloatArray,
    speed: FloatArray,
    resting: FloatArray,
    shortest: float,
    start: npt.NDArray[np.int64],
    applies: npt.NDArray[np.int64],
) -> int:
    count = 0
    direction = 0
    backward = 0
    still_since = -1
    turned_at = 0
    for k in range(len(time)):
        value = speed[k]
        if np.isnan(value):
            continue
        if abs(value) < resting[k]:
            backward = 0
            if still_since < 0:
                still_since = k
            if direction != 0 and time[k] - time[still_since] >= shortest:
                start[count] = still_since
                applies[count] = k
                count += 1
                direction = 0
            continue
        sign = 1 if value > 0.0 else -1
        if direction == 0:
            direction = sign
        elif sign != direction:
            if backward == 0:
                turned_at = still_since if still_since >= 0 else k
            backward += 1
            if backward >= _CONFIRM:
                start[count] = turned_at
                applies[count] = k
                count += 1
                direction = sign
                backward = 0
        else:
            backward = 0
        still_since = -1
    return count
