"""The deviation of each channel from its normal band: when it first left it, and for how long.

Conventions: a diagnosis after the event, for people: it uses the recording before and after the event, and no detector,
no threshold and no latency depends on it. Times are seconds on the recording's own clock. Load cell and labels are not
used. Departures count in normal spreads: of single samples, and of a channel's level, the mean over 50 ms, which shows
a small lasting shift that single samples hide.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple, Self

import numpy as np

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.base.kernels import READ_ONLY, fields_of, kernel
from cdtool.recordings.recording import Recording, Series
from cdtool.results.explanation.movement import Movement
from cdtool.results.explanation.transient import Transient
from cdtool.thresholds.normal_motion import CHANNELS, POSITIONS, MotionComparison, NormalMotion, levels_of

# Two columns of a fit are the same straight line if the determinant is at most this share of its largest value.
_SINGULAR = 1e-13
# A channel has left its normal band if it is farther from the mean than impact-free runs are, by this factor (the runs
# learned from are closer to their own mean than others), and at least this many spreads.
_BEYOND, _LEAST_OUT = 1.5, 5.0
# The departure began where it last was within this share of that.
_BACK_TO = 0.4
_SUCCESSION = 3
# A departure that takes longer than this [s] to be certain may start with a slow drift: the bend of its curve is
# searched at this many samples, with this much of it before [s].
_SLOW, _BENDS, _BEFORE_BEND = 0.03, 60, 0.1
# A run's own constant distance from the mean counts up to this many spreads; more is a departure.
_OFFSET = 2.5
# Spreads by which a channel may deviate from its own past without a departure.
_OWN_REACH = 5.0
# Length of the interval from which a run's own distance is computed, up to the search [s].
BASELINE = 0.5
_ENOUGH = 10
# A departure is brief if it is over after this time [s], followed by this much calm, within this many spreads.
_BRIEF, _CALM, _BACK = 0.15, 0.03, 3.5


class Departure(IntEnum):
    """Whether a channel left its normal band: not known, no, or already before; otherwise of what and to which side."""

    UNKNOWN = 0
    NONE = 1
    BEFORE = 2
    SAMPLES_DOWN = 3
    LEVEL_DOWN = 4
    SAMPLES_UP = 5
    LEVEL_UP = 6


class Limits(NamedTuple):
    """Number of spreads outside which samples and level are out of the normal band: at the start, and while running."""

    samples: float
    samples_running: float
    level: float
    level_running: float


@dataclass(frozen=True)
class ComparedChannel:
    """One channel of one joint with its normal band, the same for every event: arrays (n,).

    `value`, `mean`, `spread`, `level` and `level_mean` are in `unit`; `raw` and `raw_level` are distances from the
    normal mean in normal spreads, NaN if unknown. It has left the band outside `limits`, others where it is `running`.
    """

    channel: str
    joint: str
    unit: str
    time: FloatArray
    value: FloatArray
    mean: FloatArray
    spread: FloatArray
    level: FloatArray
    level_mean: FloatArray
    raw: FloatArray
    raw_level: FloatArray
    running: BoolArray
    limits: Limits

    @classmethod
    def of(cls, channel: str, joint: str, compared: MotionComparison, j: int) -> Self:
        """Return one column of a comparison."""
        reach = (*compared.reach[:, j].tolist(), *compared.level_reach[:, j].tolist())
        return cls(
            channel=channel,
            joint=joint,
            unit=compared.unit,
            time=compared.time,
            value=compared.value[:, j],
            mean=compared.mean[:, j],
            spread=compared.spread[:, j],
            level=compared.level[:, j],
            level_mean=compared.level_mean[:, j],
            raw=np.ascontiguousarray(compared.distance[:, j]),
            raw_level=np.ascontiguousarray(compared.level_distance[:, j]),
            running=compared.running,
            limits=Limits(*(max(_BEYOND * item, _LEAST_OUT) for item in reach)),
        )


@dataclass(frozen=True)
class Track:
    """A compared channel in the time that is analysed for an event: its samples from `first` until `after`.

    The run's own constant distances `own` and `own_level` do not count. `shift` is subtracted from the distances of the
    samples before anything else.
    """

    compared: ComparedChannel
    first: int
    after: int
    shift: float
    own: float
    own_level: float

    @property
    def channel(self) -> str:
        """Return the name of the channel."""
        return self.compared.channel

    @property
    def joint(self) -> str:
        """Return the name of the joint."""
        return self.compared.joint

    @property
    def rows(self) -> slice:
        """Return the samples that are analysed."""
        return slice(self.first, self.after)

    def between(self, start: float, end: float) -> slice:
        """Return the samples from `start` to `end` [s]."""
        time, first = self.compared.time[self.first : self.after], self.first
        return slice(first + int(time.searchsorted(start)), first + int(time.searchsorted(end, side="right")))

    def distances(self, part: slice) -> FloatArray:
        """Return the distance of these samples from normal, in spreads."""
        return self.compared.raw[part] - self.shift - self.own

    def level_distances(self, part: slice) -> FloatArray:
        """Return the distance of the level at these samples from normal, in spreads."""
        return self.compared.raw_level[part] - self.own_level

    def level_shift(self, start: float, end: float) -> float:
        """Return the mean distance of the level from normal, in spreads, from `start` to `end` [s]; NaN if unknown."""
        return _mean(self.level_distances(self.between(start, end)))

    def change(self, start: float, end: float) -> float:
        """Return the same in the channel's unit, including the run's own constant distance."""
        part = self.between(start, end)
        return _mean(self.compared.level[part] - self.compared.level_mean[part])

    def normal(self, start: float, end: float) -> float:
        """Return the normal mean from `start` to `end` [s]."""
        return _mean(self.compared.level_mean[self.between(start, end)])

    def movement(self, begin: float, end: float) -> Movement:
        """Return when and in which direction the channel left its normal band from `begin` to `end` [s], if it did."""
        compared, part = self.compared, self.between(begin, end)
        found, first, farthest = find_departure(
            *(compared.raw, compared.raw_level, compared.running, compared.limits),
            *(self.shift, self.own, self.own_level, part.start, part.stop, _SUCCESSION),
        )
        if found == Departure.UNKNOWN:
            return Movement(self.channel, self.joint, math.nan, reason="no normal band known here", unit=compared.unit)
        if found == Departure.NONE:
            return self._movement_at(math.nan, "", "within its usual range", farthest)
        if found == Departure.BEFORE:
            side = _side(compared.raw[first] - self.shift)
            return self._movement_at(math.nan, side, "outside since before", first)
        is_upward = found in (Departure.SAMPLES_UP, Departure.LEVEL_UP)
        part = slice(part.start, first + 1)
        shares = self._shares(part, of_level=found in (Departure.LEVEL_DOWN, Departure.LEVEL_UP))
        start = part.start + _began(compared.time[part], shares if is_upward else -shares)
        return self._movement_at(float(compared.time[start]), "up" if is_upward else "down", "", farthest)

    def _shares(self, part: slice, *, of_level: bool) -> FloatArray:
        """Return the distances of the samples, or of the level, as shares of the limit."""
        starting, running = self.compared.limits[2:] if of_level else self.compared.limits[:2]
        distances = self.level_distances(part) if of_level else self.distances(part)
        shares: FloatArray = distances / np.where(self.compared.running[part], running, starting)
        return shares

    def brief(self, begin: float, end: float) -> Transient | None:
        """Return a departure that began from `begin` to `end` [s] and soon ended, or None."""
        moved, compared = self.movement(begin, end), self.compared
        if math.isnan(moved.time):
            return None
        part = self.between(moved.time, moved.time + _BRIEF)
        outside = np.flatnonzero(np.abs(self.distances(part)) > _BACK)
        if not len(outside) or compared.time[part][outside[-1]] > moved.time + _BRIEF - _CALM:
            return None
        last = part.start + int(outside[-1])
        part = slice(part.start, last + 1)
        samples, off = self.distances(part), compared.value[part] - compared.mean[part]
        k = int(np.nanargmax(np.abs(samples)))
        height = float(off[k])
        area = float(np.nansum(off[:-1] * np.diff(compared.time[part])))
        rings = bool((off < -0.3 * abs(height)).any() and (off > 0.3 * abs(height)).any())
        noises = float(abs(samples[k]))
        end = float(compared.time[last])
        return Transient(self.channel, self.joint, compared.unit, moved.time, end, height, noises, area, rings)

    def _movement_at(self, time: float, direction: str, reason: str, k: int) -> Movement:
        return Movement(
            self.channel,
            self.joint,
            time,
            direction,  # type: ignore[arg-type]
            reason,
            self.compared.unit,
            float(self.compared.value[k]),
            float(self.compared.mean[k]),
            float(self.compared.spread[k]),
        )


def tracks_of(recording: Recording, normal: NormalMotion | None, leading: str, begin: float, end: float) -> list[Track]:
    """Compare every channel of every joint from `begin` to `end` [s] with impact-free runs.

    Without `normal`, mean and spread of the run's own half second before `begin` are used. The position of the leading
    joint is the location in the stroke itself: the others are compared at that location.
    """
    tracks = []
    for channel in CHANNELS:
        if channel not in recording or (normal is not None and channel not in normal.channels):
            continue
        joints = [joint for joint in recording.joints if channel not in POSITIONS or joint != leading]
        if not joints:
            continue
        start = begin - BASELINE
        if normal is None:
            compared = _own_past(recording[channel], start, begin, end)
        else:
            compared = normal.compare(recording, channel, start, end)
        time = compared.time
        cut = int(time.searchsorted(start)), int(time.searchsorted(begin)), int(time.searchsorted(end))
        tracks += [_track(channel, joint, recording.joints.index(joint), compared, *cut) for joint in joints]
    return tracks


def _track(channel: str, joint: str, j: int, compared: MotionComparison, first: int, begin: int, after: int) -> Track:
    """Return the samples of a channel from `first` until `after`; those before `begin` show its own distance."""
    column = compared.derived(("column", j), lambda: ComparedChannel.of(channel, joint, compared, j))
    # The assumed start of the motion shifts a whole position: only a change of its distance counts.
    reach = math.inf if channel in POSITIONS else _OFFSET
    past = slice(first, min(begin, after))
    own, own_level = (_own_distance(values[past], reach) for values in (column.raw, column.raw_level))
    return Track(column, first, after, own if channel in POSITIONS else 0.0, own, own_level)


def _own_past(series: Series, start: float, begin: float, end: float) -> MotionComparison:
    """Compare the channel up to `end` with its past from `start` until `begin` [s]: constant mean and spread."""
    cut = slice(int(series.time.searchsorted(start)), int(series.time.searchsorted(end)))
    time, values, level = series.time[cut], series.values[cut], levels_of(series)[cut]
    quiet = int(time.searchsorted(begin))
    reach = np.full((2, values.shape[1]), _OWN_REACH)
    samples, means = (_own_normal(part, quiet) for part in (values, level))
    running = np.zeros(len(time), dtype=np.bool_)
    return MotionComparison(series.unit, time, values, *samples, level, *means, running, reach, reach)


def _own_normal(values: FloatArray, quiet: int) -> tuple[FloatArray, FloatArray]:
    past, shape = values[:quiet], values.shape
    if np.count_nonzero(np.isfinite(past).all(axis=1)) < _ENOUGH:
        return np.full(shape, np.nan), np.full(shape, np.nan)
    spread = np.maximum(np.nanstd(past, axis=0), 1e-3 * np.nanmax(np.abs(past), axis=0))
    return np.broadcast_to(np.nanmean(past, axis=0), shape), np.broadcast_to(spread, shape)


def _began(time: FloatArray, shares: FloatArray) -> int:
    """Return where an upward departure, certain at the last sample, began: traced back to `_BACK_TO` of its limit.

    If a channel had drifted that far before, its departure began at the bend of its curve.
    """
    last = len(shares) - 1
    below = np.flatnonzero(~(shares > _BACK_TO))
    first = min(int(below[-1]) + 1, last) if len(below) else 0
    if time[last] - time[first] <= _SLOW:
        return first
    begin = int(np.searchsorted(time, time[first] - _BEFORE_BEND))
    since, part = time[begin:] - time[begin], shares[begin:]
    known = np.isfinite(part)
    tried = np.unique(np.linspace(first, last + 1 - _SUCCESSION, _BENDS).astype(np.int64))
    bend = _steepest_bend(since[known], part[known], since[tried - begin])
    return first if bend is None else max(first, int(tried[bend]))


def _steepest_bend(time: FloatArray, values: FloatArray, bends: FloatArray) -> int | None:
    """Return the number of the bend [s] at which two joined lines fit best, the second one steeper upward.

    Least squares of a + b t + c max(t - bend, 0) with c > 0 over `time` (n,) [s] and `values` (n,); None if no bend has
    c > 0. If all samples are after a bend, the solution of least norm counts, as in numpy's `lstsq`.
    """
    if not len(time):
        return None
    t, y = time - time.mean(), values - values.mean()
    after = np.maximum(time - bends[:, np.newaxis], 0.0)
    after -= after.mean(axis=1, keepdims=True)
    tt, ta, aa, ty, ay = t @ t, after @ t, (after * after).sum(axis=1), t @ y, after @ y
    determinant = tt * aa - ta * ta
    regular = determinant > _SINGULAR * tt * aa
    with np.errstate(divide="ignore", invalid="ignore"):
        line = ty / tt
        least = (line - (values.mean() - line * time.mean()) * bends) / (bends * bends + 2.0)
        more = np.where(regular, (ay * tt - ty * ta) / determinant, least)
        slope = np.where(regular, (ty * aa - ay * ta) / determinant, line - least)
    left = y - slope[:, np.newaxis] * t - more[:, np.newaxis] * after
    error = np.where((tt * aa > 0.0) & (more > 0.0), (left * left).sum(axis=1), np.inf)
    return int(error.argmin()) if error.min() < np.inf else None


def _own_distance(values: FloatArray, reach: float) -> float:
    """Return a run's own constant distance from the mean [spreads], up to `reach`.

    With too few known values it is 0, or unknown (NaN) if it is unlimited.
    """
    known = values[np.isfinite(values)]
    if len(known) < _ENOUGH:
        return 0.0 if math.isfinite(reach) else math.nan
    middle = [(len(known) - 1) // 2, len(known) // 2]
    median = np.partition(known, middle)[middle].mean()  # the bits of np.median in a fifth of its time
    return float(np.clip(median, -reach, reach))


def _side(value: float) -> str:
    return "up" if value > 0.0 else "down"


def _mean(values: FloatArray) -> float:
    # The bits of `known.mean()`, without the time of its checks; a sum is finite only if all values are.
    total = np.add.reduce(values)
    if len(values) and math.isfinite(total):
        return float(total / len(values))
    known = values[np.isfinite(values)]
    return float(np.add.reduce(known) / len(known)) if len(known) else math.nan


@kernel(
    f"UniTuple(int64, 3)({READ_ONLY}, {READ_ONLY}, Array(bool, 1, 'C', readonly=True), {fields_of(Limits)}, float64, "
    "float64, float64, int64, int64, int64)",
    exact=True,
)
def find_departure(  # noqa: C901, PLR0913  a kernel: one loop, arrays and numbers one by one
    raw: FloatArray,
    raw_level: FloatArray,
    running: BoolArray,
    limits: Limits,
    shift: float,
    own: float,
    own_level: float,
    begin: int,
    end: int,
    succession: int,
) -> tuple[int, int, int]:
    """Return the `Departure` of a track from sample `begin` until `end`, its first sample, and the farthest one.

    The farthest is one after the departure, if there is any. It takes `succession` consecutive samples outside on one
    side; samples that are not known interrupt them. Of several that begin at the same sample, the first in the order
    of `Departure` counts.
    """
    found, first, known = 0, -1, 0
    samples_down = samples_up = level_down = level_up = 0
    for k in range(begin, end):
        sample, level = raw[k] - shift - own, raw_level[k] - own_level
        known += math.isfinite(sample)
        limit = limits.samples_running if running[k] else limits.samples
        level_limit = limits.level_running if running[k] else limits.level
        if first < 0 and abs(sample) <= limit and abs(level) <= level_limit:  # most samples
            samples_down = samples_up = level_down = level_up = 0
            continue
        samples_down = samples_down + 1 if sample < -limit else 0
        level_down = level_down + 1 if level < -level_limit else 0
        samples_up = samples_up + 1 if sample > limit else 0
        level_up = level_up + 1 if level > level_limit else 0
        if first < 0 and max(samples_down, samples_up, level_down, level_up) == succession:
            first = k - succession + 1
            if samples_down == succession:
                found = Departure.SAMPLES_DOWN.value
            elif level_down == succession:
                found = Departure.LEVEL_DOWN.value
            elif samples_up == succession:
                found = Departure.SAMPLES_UP.value
            else:
                found = Departure.LEVEL_UP.value
        if first >= 0 and known >= succession:
            break
    if known < succession:
        return Departure.UNKNOWN.value, -1, -1
    sign = 1.0 if found >= Departure.SAMPLES_UP.value else -1.0
    farthest, most, outside = first, -np.inf, 0
    for k in range(first if first >= 0 else begin, end):
        distance = raw[k] - shift
        size = abs(distance) if first < 0 else sign * (distance - own)
        if math.isfinite(size) and size > most:
            farthest, most = k, size
        if first < 0:
            outside = outside + 1 if size > (limits.samples_running if running[k] else limits.samples) else 0
            if outside == succession:
                return Departure.BEFORE.value, k - succession + 1, -1
    return found if first >= 0 else Departure.NONE.value, first, farthest
