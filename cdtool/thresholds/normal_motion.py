"""Normal curves of every channel along a stroke: mean and spread over impact-free runs of one class of motion.

No detector and no threshold uses them: an explanation compares a run with them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Self

import numpy as np

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.base.derived import SendsFields, StoresDerived
from cdtool.base.kernels import READ_ONLY, kernel
from cdtool.detectors.detection import Signal, Status
from cdtool.recordings.motion import MotionClass
from cdtool.recordings.motion.progress import RUNNING_SHARE, START_SHARE, Progress, progress
from cdtool.recordings.recording import MEASURED, REFERENCES, Recording, Series
from cdtool.thresholds.curve_lookup import look_up
from cdtool.thresholds.signature_curve import Curve, resample

CHANNELS = (*MEASURED, *REFERENCES)
# Their normal curve is over time: along the travel they are the travel itself.
POSITIONS = ("position", "reference_position")
# A level is the mean of a channel over this long before a sample [s].
LEVEL_SECONDS = 0.05
_FILLED = 0.8
# Share of the runs [%] that stay within the largest distance: one faulty sample in one run does not widen it.
_MOST = 80.0
# Fewer runs do not determine a spread.
LEAST_RUNS = 3

# Grid and window over time while accelerating [s]; along the travel [s at the nominal speed]; of a position [s].
_TIME, _TRAVEL, _POSITION = (0.01, 0.03), (0.05, 0.1), (0.05, 0.1)
# Numbers are stored to this many digits of the largest.
_DIGITS = 6
# The time curve reaches this much beyond the slowest run's acceleration.
_TIME_RESERVE = 1.5
# A spread is at least this share of the largest mean: a channel that is computed may not vary at all, and a command
# varies by no more than when the motion is taken to have begun.
_SMALLEST_SPREAD, _SMALLEST_OF_COMMAND = 1e-3, 0.02
_SUCCESSION = 3


@dataclass(frozen=True)
class NormalChannel:
    """One channel's samples and its level (see `LEVEL_SECONDS`), in `unit`; positions count from the motion's start."""

    unit: str
    samples: NormalCurves
    level: NormalCurves


@dataclass(frozen=True)
class MotionComparison(StoresDerived):
    """A run's channel and its normal curve, on the channel's clock `time` (n,) [s]; the others are (n, J).

    `value` and `level` are the run's own, `mean` and `spread` those of the impact-free runs at the same location; NaN
    before the motion starts and where there are too few runs. `reach` and `level_reach` (2, J): the distance of the
    impact-free runs themselves from the mean, in spreads, while accelerating and while `running` (n,).
    """

    unit: str
    time: FloatArray
    value: FloatArray
    mean: FloatArray
    spread: FloatArray
    level: FloatArray
    level_mean: FloatArray
    level_spread: FloatArray
    running: BoolArray
    reach: FloatArray
    level_reach: FloatArray

    @cached_property
    def distance(self) -> FloatArray:
        """Return the distance of the values from the mean (n, J) [spreads]; NaN if unknown."""
        return _in_spreads(self.value - self.mean, self.spread)

    @cached_property
    def level_distance(self) -> FloatArray:
        """Return the distance of the level from its mean (n, J) [spreads]; NaN if unknown."""
        return _in_spreads(self.level - self.level_mean, self.level_spread)


@dataclass(frozen=True)
class NormalMotion:
    """Normal curves of every channel of impact-free runs, for one class of motion; `runs`: their number."""

    motion: MotionClass
    joints: tuple[str, ...]
    runs: int
    channels: Mapping[str, NormalChannel]

    def compare(
        self, recording: Recording, channel: str, start: float = -math.inf, end: float = math.inf
    ) -> MotionComparison:
        """Compare a recording's channel from `start` to `end` [s] with its normal curve.

        Raises RecordingError without speed and position.
        """
        series, normal = recording[channel], self.channels[channel]
        where = self.progress(recording, series.time)
        value = _from_start(channel, series.values, where)
        level = levels_of(series) if value is series.values else levels(series.time, value)
        least = _SMALLEST_OF_COMMAND if channel in REFERENCES else _SMALLEST_SPREAD
        rows = slice(int(series.time.searchsorted(start)), int(series.time.searchsorted(end, side="right")))
        where = where.part(rows)
        samples, means = normal.samples.at(where, least), normal.level.at(where, least)
        reaches = normal.samples.reach, normal.level.reach
        return MotionComparison(
            normal.unit, series.time[rows], value[rows], *samples, level[rows], *means, where.running, *reaches
        )

    def serves(self, recording: Recording) -> bool:
        """Whether a recording has these joints, and the channels that locate it in its stroke."""
        return recording.joints == self.joints and "speed" in recording and "position" in recording

    def progress(self, recording: Recording, clock: FloatArray) -> Progress:
        """Return where in its stroke a recording is at each time of `clock` [s]."""
        return _progress(recording, clock, self.motion)

    def with_run(self, recording: Recording, cap: float, forget: float | None = None) -> NormalMotion:
        """Return the curves with one more impact-free run, updated and clipped like a signature."""
        channels = dict(self.channels)
        for name, normal in self.channels.items():
            if name not in recording or recording[name].unit != normal.unit:
                continue
            clock = recording[name].time
            where = self.progress(recording, clock)
            value = _from_start(name, recording[name].values, where)
            channels[name] = replace(
                normal,
                samples=normal.samples.updated(value, clock, where, cap, forget),
                level=normal.level.updated(levels(clock, value), clock, where, cap, forget),
            )
        return replace(self, runs=self.runs + 1, channels=channels)

    def to_dict(self) -> dict[str, Any]:
        """Return the curves as JSON values."""
        return {
            "direction": self.motion.direction,
            "nominal_speed": self.motion.nominal_speed,
            "leading_joint": self.motion.joint,
            "joints": list(self.joints),
            "runs": self.runs,
            "channels": {
                name: {"unit": item.unit, "samples": item.samples.to_dict(), "level": item.level.to_dict()}
                for name, item in self.channels.items()
            },
        }

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """Return the inverse of `to_dict`; raises ValueError if the curves do not match these joints."""
        joints = tuple(map(str, values["joints"]))
        channels = {}
        for name, item in values["channels"].items():
            if name not in CHANNELS:
                raise ValueError(f"a normal curve of '{name}'")
            samples, level = (NormalCurves.from_dict(item[part]) for part in ("samples", "level"))
            for curve in (samples.by_time, samples.by_travel, level.by_time, level.by_travel):
                if curve is not None and curve.mean.shape[1] != len(joints):
                    raise ValueError(f"a normal curve of {curve.mean.shape[1]} joints, not of {len(joints)}")
            channels[name] = NormalChannel(str(item["unit"]), samples, level)
        motion = MotionClass(int(values["direction"]), float(values["nominal_speed"]), int(values["leading_joint"]))
        if motion.direction not in (-1, 1) or not 0 <= motion.joint < len(joints) or not motion.nominal_speed > 0.0:
            raise ValueError(f"class of motion {motion}")
        return cls(motion, joints, int(values["runs"]), channels)


def learn_normal_motion(recordings: Sequence[Recording], motion: MotionClass) -> NormalMotion | None:
    """Learn normal curves of every channel from impact-free recordings of one class of motion.

    Parameters
    ----------
    recordings : sequence of Recording
        Impact-free recordings on the load side.
    motion : MotionClass
        Their class: direction, leading joint and nominal speed.

    Returns
    -------
    NormalMotion or None
        None if fewer than 3 of them have speed and position, or if the class does not move.

    Examples
    --------
    >>> import numpy as np
    >>> from cdtool.recordings.recording import Series
    >>> time, valid = np.arange(2001) * 1e-3, np.zeros((2001, 1), dtype=np.uint8)
    >>> channels = {"speed": Series(time, np.full(2001, 0.2), "m/s"), "position": Series(time, 0.2 * time, "m")}
    >>> strokes = [Recording(f"{i}", "", ("axis",), channels) for i in range(10)]
    >>> from cdtool.recordings.motion import measured_class
    >>> normal = learn_normal_motion(strokes, measured_class(strokes[0]))
    >>> normal.runs, sorted(normal.channels)
    (10, ['position', 'speed'])
    """
    usable = [item for item in recordings if "speed" in item and "position" in item]
    usable = [item for item in usable if item.joints == usable[0].joints]
    if motion.direction == 0 or len(usable) < LEAST_RUNS:
        return None
    channels: dict[str, NormalChannel] = {}
    for name in CHANNELS:
        having = [item for item in usable if name in item]
        having = [item for item in having if item[name].unit == having[0][name].unit]
        if len(having) >= LEAST_RUNS:
            channels[name] = _learn_channel(name, having, motion)
    return NormalMotion(motion, usable[0].joints, len(usable), channels)


def levels(time: FloatArray, values: FloatArray) -> FloatArray:
    """Return at each sample the mean of a channel over the last 50 ms.

    Parameters
    ----------
    time : ndarray of float, shape (n,)
        Strictly increasing times [s].
    values : ndarray of float, shape (n, J)
        The channel, in any unit; NaN: no sample.

    Returns
    -------
    ndarray of float, shape (n, J)
        The level, in the unit of the channel; NaN where more than a fifth of the usual number of samples is missing.

    Examples
    --------
    >>> import numpy as np
    >>> time = np.arange(100) * 1e-3
    >>> step = np.where(time < 0.05, 0.0, 10.0)[:, np.newaxis]
    >>> levels(time, step)[[49, 99], 0].round(6).tolist()
    [0.0, 10.0]
    """
    period = float(np.median(np.diff(time))) if len(time) > 1 else math.nan
    return _levels(time, values, period)


def levels_of(series: Series) -> FloatArray:
    """Return the levels of a channel, computed once and stored with it.

    Parameters
    ----------
    series : Series
        The channel.

    Returns
    -------
    ndarray of float, shape (n, J)
        Its levels, read-only.

    Examples
    --------
    >>> import numpy as np
    >>> time = np.arange(100) * 1e-3
    >>> series = Series(time, np.where(time < 0.05, 0.0, 10.0), "N")
    >>> levels_of(series)[[49, 99], 0].round(6).tolist()
    [0.0, 10.0]
    """
    return series.derived("levels", lambda: _frozen(_levels(series.time, series.values, series.period)))


def _frozen(values: FloatArray) -> FloatArray:
    values.flags.writeable = False
    return values


def _levels(time: FloatArray, values: FloatArray, period: float) -> FloatArray:
    if len(time) < 2:
        return values.copy()
    usual = min(LEVEL_SECONDS / period, float(len(time)))
    about = _middles(values)
    mean = np.empty(values.shape)
    enough, sums = max(_FILLED * usual, 1.0), (np.empty(len(time) + 1), np.empty(len(time) + 1))
    for j in range(values.shape[1]):
        _fill_levels(time, np.ascontiguousarray(values[:, j]), about[j], enough, *sums, mean[:, j])
    return mean


def _middles(values: FloatArray) -> FloatArray:
    """Return the median of each joint's values that are not NaN (J,); 0 if one joint has no finite value."""
    present = np.isfinite(values)
    if not present.any(axis=0).all():
        return np.zeros(values.shape[1])
    if not present.all():
        known: FloatArray = np.nanmedian(values, axis=0)
        return known
    # As numpy's median, without the time of its checks.
    middle, odd = divmod(len(values), 2)
    parts: FloatArray = np.partition(values, middle, axis=0)
    found: FloatArray = parts[middle] if odd else (parts[:middle].max(axis=0) + parts[middle]) / 2.0
    return found


@kernel(f"void({READ_ONLY}, {READ_ONLY}, float64, float64, float64[::1], float64[::1], float64[:])", exact=True)
def _fill_levels(
    time: FloatArray,
    values: FloatArray,
    about: float,
    enough: float,
    sums: FloatArray,
    counts: FloatArray,
    mean: FloatArray,
) -> None:
    """Fill `mean` (n,) with the mean of the values over the last 50 ms, NaN with fewer than `enough`.

    Sums of the distance from `about` up to each sample keep their digits at any offset.
    """
    sums[0] = counts[0] = 0.0
    first = 0
    for k in range(len(time)):
        is_known = np.isfinite(values[k])
        sums[k + 1] = sums[k] + (values[k] - about if is_known else 0.0)
        counts[k + 1] = counts[k] + (1.0 if is_known else 0.0)
        while time[first] <= time[k] - LEVEL_SECONDS:
            first += 1
        count = counts[k + 1] - counts[first]
        mean[k] = (sums[k + 1] - sums[first]) / count + about if count >= enough else np.nan


def _learn_channel(name: str, recordings: Sequence[Recording], motion: MotionClass) -> NormalChannel:
    wheres = [_progress(item, item[name].time, motion) for item in recordings]
    values = [_from_start(name, item[name].values, where) for item, where in zip(recordings, wheres, strict=True)]
    means = [levels(item[name].time, value) for item, value in zip(recordings, values, strict=True)]
    clocks = [item[name].time for item in recordings]
    samples, level = (_learn_curves(name, motion, clocks, items, wheres) for items in (values, means))
    return NormalChannel(recordings[0][name].unit, samples, level)


def _learn_curves(
    name: str,
    motion: MotionClass,
    clocks: Sequence[FloatArray],
    values: Sequence[FloatArray],
    wheres: Sequence[Progress],
) -> NormalCurves:
    over_time = name in POSITIONS
    lasting = [where.elapsed if over_time else where.elapsed[~where.running] for where in wheres]
    longest = max((float(np.nanmax(item, initial=0.0)) for item in lasting), default=0.0)
    farthest = max((float(np.nanmax(where.travel, initial=0.0)) for where in wheres), default=0.0)
    joints = values[0].shape[1]

    def learned(curve: Curve, axes: Sequence[FloatArray]) -> Curve:
        runs = [
            resample(_signal_of(clock, value), where, curve, axis)
            for clock, value, where, axis in zip(clocks, values, wheres, axes, strict=True)
        ]
        return _rounded(curve.learned(np.array(runs)))

    step, window = _POSITION if over_time else _TIME
    reach = longest if over_time else _TIME_RESERVE * longest
    by_time = learned(Curve.empty(step, window, reach, joints), [where.elapsed for where in wheres])
    by_travel = None
    if not over_time:
        step, window = (motion.nominal_speed * seconds for seconds in _TRAVEL)
        by_travel = learned(Curve.empty(step, window, farthest, joints), [where.travel for where in wheres])
    curves = NormalCurves(by_time, by_travel, np.zeros(joints), np.zeros(joints))
    distances = [curves.distances(value, where) for value, where in zip(values, wheres, strict=True)]
    by_time_most, along_most = (np.percentile([item[i] for item in distances], _MOST, axis=0) for i in (0, 1))
    return replace(curves, farthest_by_time=by_time_most, farthest_by_travel=along_most)


def _rounded(curve: Curve) -> Curve:
    """Return a curve rounded to `_DIGITS` digits: spreads are far less certain, and people read the files."""

    def short(values: FloatArray) -> FloatArray:
        size = np.abs(values).max(initial=0.0)
        decimals = _DIGITS - 1 - math.floor(math.log10(size)) if size > 0.0 else 0
        return np.round(values, decimals)

    return replace(curve, mean=short(curve.mean), squares=short(curve.squares))


def _from_start(channel: str, values: FloatArray, where: Progress) -> FloatArray:
    """Return positions relative to where the motion began, and other channels unchanged."""
    if channel not in POSITIONS:
        return values
    begun = np.flatnonzero(np.isfinite(where.elapsed))
    result = np.full(values.shape, np.nan)
    for j in range(values.shape[1] if len(begun) else 0):
        known = begun[np.isfinite(values[begun, j])]
        if len(known):
            result[begun, j] = values[begun, j] - values[known[0], j]
    return result


def _progress(recording: Recording, clock: FloatArray, motion: MotionClass) -> Progress:
    speed = motion.nominal_speed
    return progress(recording, clock, motion.direction, START_SHARE * speed, RUNNING_SHARE * speed, motion.joint)


@dataclass(frozen=True)
class NormalCurves(SendsFields):
    """Statistics of one quantity (g, J): over time since motion start, and along the travel (None: over time alone).

    `farthest_by_time` and `farthest_by_travel` (J,): the largest distance from the mean that a run has for 3
    samples, in spreads: over time while accelerating, and along the travel after it. Four of five runs stay within it.
    """

    by_time: Curve
    by_travel: Curve | None
    farthest_by_time: FloatArray
    farthest_by_travel: FloatArray

    def at(self, where: Progress, least: float) -> tuple[FloatArray, FloatArray]:
        """Return mean and spread (n, J) at each location of a run; NaN where there are too few runs.

        No spread is below the share `least` of the joint's largest mean.
        """
        return self._looked_up(where, least * self._largest)

    @cached_property
    def _largest(self) -> FloatArray:
        largest: FloatArray = np.abs(self.by_time.mean).max(axis=0)
        if self.by_travel is not None:
            largest = np.maximum(largest, np.abs(self.by_travel.mean).max(axis=0))
        return largest

    def _looked_up(self, where: Progress, least: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return mean and spread (n, J); no spread is below the joint's entry of `least` (J,)."""
        by_time, by_travel = self.by_time, self.by_travel
        # Without a curve by travel, nothing is known after the end of that by time.
        beyond = where.running if by_travel is not None else where.elapsed > by_time.end
        mean, spread = np.empty((2, by_time.mean.shape[1], len(where.elapsed)))
        for j, found in enumerate(zip(mean, spread, strict=True)):
            look_up(where.elapsed, beyond, False, by_time.columns[j], by_time.end, least[j], *found)
            if by_travel is not None:
                look_up(where.travel, beyond, True, by_travel.columns[j], np.inf, least[j], *found)
            else:
                mean[j, beyond] = spread[j, beyond] = np.nan
        return mean.T, spread.T

    def updated(self, values: FloatArray, clock: FloatArray, where: Progress, cap: float, forget: float | None) -> Self:
        """Return the curves with one more run (n, J), clipped to `cap` spreads from the mean; see `Curve.updated`.

        The largest distances of runs from the mean stay as first learned.
        """
        signal = _signal_of(clock, values)

        def one(curve: Curve, axis: FloatArray) -> Curve:
            return curve.updated(curve.clipped(resample(signal, where, curve, axis), cap, pooled=True), forget)

        by_travel = one(self.by_travel, where.travel) if self.by_travel is not None else None
        return replace(self, by_time=one(self.by_time, where.elapsed), by_travel=by_travel)

    def distances(self, values: FloatArray, where: Progress) -> tuple[FloatArray, FloatArray]:
        """Return how far a run is from the mean for 3 samples (J,) [spreads]: while accelerating, and after it."""
        mean, spread = self._looked_up(where, np.full(values.shape[1], -np.inf))
        running = where.running if self.by_travel is not None else np.zeros(len(values), dtype=bool)
        columns = zip(values.T, mean.T, spread.T, strict=True)
        found = np.array([farthest_lasting(*column, running, _SUCCESSION) for column in columns])
        return found[:, 0], found[:, 1]

    @cached_property
    def reach(self) -> FloatArray:
        """The largest distance of impact-free runs from the mean (2, J) [spreads]: while accelerating, and after it."""
        after = self.farthest_by_time if self.by_travel is None else self.farthest_by_travel
        return np.array((self.farthest_by_time, after))

    def to_dict(self) -> dict[str, Any]:
        """Return the curves as JSON values."""
        along = self.by_travel.to_dict() if self.by_travel is not None else None
        return {
            "by_time": self.by_time.to_dict(),
            "by_travel": along,
            "farthest_by_time": self.farthest_by_time.tolist(),
            "farthest_by_travel": self.farthest_by_travel.tolist(),
        }

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """Return the curves that `to_dict` has written."""
        along = values["by_travel"]
        by_time, by_travel = Curve.from_dict(values["by_time"]), None if along is None else Curve.from_dict(along)
        farthest = [np.array(values[name], dtype=np.float64) for name in ("farthest_by_time", "farthest_by_travel")]
        if any(item.shape != by_time.mean.shape[1:] or not np.isfinite(item).all() for item in farthest):
            raise ValueError("distances of other joints than the curves'")
        return cls(by_time, by_travel, *farthest)


@kernel(
    "UniTuple(float64, 2)(Array(float64, 1, 'A', readonly=True), Array(float64, 1, 'A', readonly=True), "
    "Array(float64, 1, 'A', readonly=True), Array(bool, 1, 'C', readonly=True), int64)",
    exact=True,
)
def farthest_lasting(
    values: FloatArray, mean: FloatArray, spread: FloatArray, running: BoolArray, succession: int
) -> tuple[float, float]:
    """Return the largest distance from the mean [spreads] that `succession` consecutive samples all have.

    Those that end before the axis is `running`, and those that end there. Distances that are not known count as 0.
    """
    before = after = 0.0
    for k in range(succession - 1, len(values)):
        least = np.inf
        for i in range(k - succession + 1, k + 1):
            off = abs(values[i] - mean[i]) / spread[i]
            least = min(least, off if math.isfinite(off) else 0.0)
        if running[k]:
            after = max(after, least)
        else:
            before = max(before, least)
    return before, after


def _in_spreads(off: FloatArray, spread: FloatArray) -> FloatArray:
    with np.errstate(invalid="ignore", divide="ignore"):
        shares = off / spread
    return np.where(np.isfinite(shares), shares, np.nan)


def _signal_of(clock: FloatArray, values: FloatArray) -> Signal:
    """Return values (n, J) as a signal whose missing ones are gaps."""
    status = np.where(np.isfinite(values), Status.VALID, Status.GAP).astype(np.uint8)
    return Signal(clock, values, status, "")
