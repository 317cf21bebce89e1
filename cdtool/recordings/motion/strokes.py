"""Cut a log into strokes as it comes: each begins where the log so far shows that it does."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.base.kernels import READ_ONLY, kernel
from cdtool.recordings.motion.motion_class import AVERAGED_SAMPLES, AVERAGED_SECONDS, MotionClass
from cdtool.recordings.motion.progress import CONFIRM, START_SHARE
from cdtool.recordings.recording import Recording, Series

# A rest this long [s] ends a stroke; a shorter one is a pause in it.
SHORTEST_REST = 0.2


@dataclass(frozen=True)
class Stroke:
    """A stroke that applies from `applies` [s], with everything logged since `start` [s] <= `applies`.

    `rests` [s]: when the stroke before came to rest, or turned round.
    """

    start: float
    applies: float
    rests: float = -np.inf


def strokes_so_far(recording: Recording, how: str, classes: Sequence[MotionClass]) -> list[Stroke]:
    """Return the strokes of a log, each decided at or before it applies; one of the whole log if it is not cut.

    By "motion" a stroke ends with a rest of 0.2 s after a motion, or where the motion turns round. A joint rests where
    its speed, averaged over the last 0.1 s, is below 10 % of the nominal speed of the slowest class that it leads.
    Without classes it rests below 10 % of the highest speed of any joint so far, and a stroke ends only with a rest:
    turning round needs the direction of a class's joint. By "trigger" a stroke begins at each rising edge. The strokes
    of a log are cut once for all detectors that learned the same classes.
    """
    if how not in ("motion", "trigger"):
        return [Stroke(-np.inf, -np.inf)]
    key = ("strokes", how, tuple((item.joint, item.nominal_speed) for item in classes))
    return list(recording.derived(key, lambda: tuple(_strokes(recording, how, classes))))


def _strokes(recording: Recording, how: str, classes: Sequence[MotionClass]) -> list[Stroke]:
    begin = Stroke(-np.inf, -np.inf)
    if how == "trigger" and "trigger" in recording:
        series = recording["trigger"]
        high = np.nan_to_num(series.values[:, 0]) > 0.5
        edges = [float(series.time[k]) for k in np.flatnonzero(high[1:] & ~high[:-1]) + 1]
        return [begin, *(Stroke(edge, edge, edge) for edge in edges)]
    if how == "trigger" or "speed" not in recording or not len(recording["speed"]):
        return [begin]
    time, speed = recording["speed"].time, averaged_so_far(recording["speed"])
    leads = sorted({item.joint for item in classes})
    if leads:
        slowest = [min(item.nominal_speed for item in classes if item.joint == joint) for joint in leads]
        levels = speed[:, leads] / (START_SHARE * np.array(slowest))
    else:
        leads, fastest = [0], np.max(np.abs(speed), axis=1)
        levels = (fastest / np.maximum(START_SHARE * np.fmax.accumulate(fastest), 1e-300))[:, np.newaxis]
    moves_most = np.argmax(np.abs(np.nan_to_num(levels)), axis=1)
    level = np.ascontiguousarray(levels[np.arange(len(levels)), moves_most])
    start = np.empty(len(time), dtype=np.int64)
    applies = np.empty(len(time), dtype=np.int64)
    turned = np.empty(len(time), dtype=np.bool_)
    count = _cut(time, level, moves_most.astype(np.int64), SHORTEST_REST, start, applies, turned)
    found = [begin]
    for first, last, turns in zip(start[:count], applies[:count], turned[:count], strict=True):
        # A motion that turned round began before its average shows it; after a rest it did not, and the rest of
        # the average belongs to the stroke before.
        since = float(time[first]) - (AVERAGED_SECONDS if turns else 0.0)
        found.append(Stroke(since, float(time[last]), float(time[first])))
    return found


def averaged_so_far(series: Series) -> FloatArray:
    """Return the mean (n, J) over the last 0.1 s, and at least the last 5 samples; NaN below 3, and at first."""
    time, values = series.time, series.values
    present = np.isfinite(values)
    nothing = np.zeros((1, values.shape[1]))
    total = np.vstack((nothing, np.cumsum(np.where(present, values, 0.0), axis=0)))
    number = np.vstack((nothing, np.cumsum(present, axis=0)))
    last = np.arange(1, len(time) + 1)
    first = np.minimum(np.searchsorted(time, time - AVERAGED_SECONDS, side="right"), last - AVERAGED_SAMPLES)
    first = np.maximum(first, 0)
    count = np.where((time >= time[0] + AVERAGED_SECONDS)[:, np.newaxis], number[last] - number[first], 0.0)
    # Fewer than three samples have no average.
    mean: FloatArray = np.divide(total[last] - total[first], count, out=np.full(values.shape, np.nan), where=count >= 3)
    return mean


@kernel(f"int64({READ_ONLY}, {READ_ONLY}, int64[::1], float64, int64[::1], int64[::1], b1[::1])")
def _cut(
    time: FloatArray,
    level: FloatArray,
    joint: npt.NDArray[np.int64],
    shortest: float,
    start: npt.NDArray[np.int64],
    applies: npt.NDArray[np.int64],
    turned: BoolArray,
) -> int:
    """Fill where strokes `start`, from where they apply, and whether the motion `turned`; return their number.

    `level` (n,): speed of the `joint` that moves most, as a multiple of the speed below which it rests.
    """
    count = 0
    direction = 0
    leads = -1
    backward = 0
    still_since = -1
    turned_at = 0
    for k in range(len(time)):
        value = level[k]
        if np.isnan(value):
            continue
        if abs(value) < 1.0:
            backward = 0
            if still_since < 0:
                still_since = k
            if direction != 0 and time[k] - time[still_since] >= shortest:
                start[count] = still_since
                applies[count] = k
                turned[count] = False
                count += 1
                direction = 0
            continue
        sign = 1 if value > 0.0 else -1
        if direction == 0:
            direction = sign
            leads = joint[k]
        elif joint[k] == leads and sign != direction:
            if backward == 0:
                turned_at = still_since if still_since >= 0 else k
            backward += 1
            if backward >= CONFIRM:
                start[count] = turned_at
                applies[count] = k
                turned[count] = True
                count += 1
                direction = sign
                backward = 0
        else:
            backward = 0
        still_since = -1
    return count
