"""The speed of a class of motion along its stroke, learned from impact-free runs: what the speed of a log must fit."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple, Self

import numpy as np

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.base.derived import SendsFields
from cdtool.base.kernels import READ_ONLY, fields_of, kernel, read_only
from cdtool.recordings.clock import integrate
from cdtool.recordings.motion.progress import ALIGNMENTS, CONFIRM, RUNNING_SHARE, START_SHARE, Progress, progress
from cdtool.recordings.motion.smoothing import moving_mean
from cdtool.recordings.recording import Recording

# A speed fits within this many spreads of the mean.
SPREADS = 5.5
# A stroke that ends at rest is below this share of the nominal speed at its end.
SLOW = 0.5


# Grid points along the stroke: a quarter of a percent of it, as fine as a speed is known.
_POINTS = 400
# A grid point, or a level, is known where this share of the runs has been.
COVERAGE = 0.8
# A time curve reaches this much beyond the slowest run's acceleration: later ones may be slower.
TIME_RESERVE = 1.5
# A speed fits within this share of the nominal speed in any case.
TOLERANCE = 0.05


@dataclass(frozen=True)
class SpeedCurve(SendsFields):
    """Mean and spread (g,) of the forward speed [load unit/s] on the grid 0, step, 2 step ...

    Both are constant beyond the grid's ends.
    """

    step: float
    mean: FloatArray
    spread: FloatArray

    @property
    def last(self) -> float:
        """The last grid point but one."""
        return self.step * max(len(self.mean) - 2, 0)

    @cached_property
    def content(self) -> tuple[float, bytes, bytes]:
        """Step, mean and spread, bit by bit: equal for equal curves."""
        return self.step, self.mean.tobytes(), self.spread.tobytes()


@dataclass(frozen=True)
class SpeedCourse(SendsFields):
    """Speed over the time since the motion began, used while accelerating, and over travel, used after that.

    `alignment` is the signature's: with "time" or "position" only that one is used.
    """

    alignment: str
    by_time: SpeedCurve
    by_travel: SpeedCurve

    @cached_property
    def content(self) -> tuple[object, ...]:
        """Alignment and both curves, bit by bit: hashable, equal for equal courses."""
        return self.alignment, self.by_time.content, self.by_travel.content

    @cached_property
    def curves(self) -> _KernelCurves:
        """The curves that its alignment uses, one after the other, as the kernel needs them."""
        by_time, by_travel = self.alignment != "position", self.alignment != "time"
        used = [curve for curve, is_used in ((self.by_time, by_time), (self.by_travel, by_travel)) if is_used]
        return _KernelCurves(
            read_only(np.concatenate([np.arange(len(curve.mean)) * curve.step for curve in used])),
            read_only(np.concatenate([curve.mean for curve in used])),
            read_only(np.concatenate([curve.spread for curve in used])),
            float(len(self.by_time.mean)) if by_time else 0.0,
            float(self.by_travel.last),
        )

    def to_dict(self) -> dict[str, Any]:
        """Return both curves as JSON values."""
        curves = {
            name: {"step": curve.step, "mean": curve.mean.tolist(), "spread": curve.spread.tolist()}
            for name, curve in (("by_time", self.by_time), ("by_travel", self.by_travel))
        }
        return {"alignment": self.alignment, **curves}

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """Return the curves that `to_dict` has written; raises ValueError if they are damaged."""
        if values["alignment"] not in ALIGNMENTS:
            raise ValueError(f"a speed course aligned by {values['alignment']}")
        return cls(values["alignment"], _curve_from(values["by_time"]), _curve_from(values["by_travel"]))


def learn_course(
    recordings: Sequence[Recording], direction: int, nominal_speed: float, joint: int, alignment: str
) -> SpeedCourse:
    """Return mean and spread of the measured speed over impact-free runs of one class of motion.

    The spread is that of single samples, noise of the speed included, pooled over neighbours together with the
    deviation of the mean from its smoothed curve.
    """
    courses = []
    for recording in recordings:
        at = stroke_progress(recording, direction, nominal_speed, joint)
        series = recording["speed"]
        use = np.isfinite(at.elapsed) & np.isfinite(series.values[:, joint])
        courses.append((at, direction * series.values[:, joint], use))
    whole = alignment == "time"
    lasting = [float(np.max(at.elapsed[use & (whole | ~at.running)], initial=0.0)) for at, _, use in courses]
    longest = max(lasting, default=0.0) * (1.0 if whole else TIME_RESERVE)
    furthest = max((float(np.nanmax(at.travel[use], initial=0.0)) for at, _, use in courses), default=0.0)
    return SpeedCourse(
        alignment,
        _learned([(at.elapsed[use], speed[use]) for at, speed, use in courses], longest),
        _learned([(at.travel[use], speed[use]) for at, speed, use in courses], furthest),
    )


def stroke_progress(recording: Recording, direction: int, nominal_speed: float, joint: int) -> Progress:
    """Return where in a stroke of that class a recording is, on the clock of its speed.

    Without a position the travel is the integral of the speed.
    """
    speed = recording["speed"]
    if "position" not in recording:
        channels = {**recording.channels, "position": integrate(speed, "")}
        recording = Recording(recording.name, recording.source, recording.joints, channels)
    start, running = START_SHARE * nominal_speed, RUNNING_SHARE * nominal_speed
    return progress(recording, speed.time, direction, start, running, joint)


def fitting_samples(
    recording: Recording, direction: int, nominal_speed: float, joint: int, course: SpeedCourse | None
) -> tuple[BoolArray, BoolArray]:
    """Return for each speed sample (n,) whether a stroke of the class has begun, and whether the speed fits it so far.

    Before it has begun everything fits but a confirmed motion backward. Without a course (a class that was not
    learned) every speed up to the nominal one fits while accelerating, and the nominal one alone from there on. Causal.
    """
    speed = np.ascontiguousarray(recording["speed"].values[:, joint])
    at = stroke_progress(recording, direction, nominal_speed, joint)
    begun, fits = np.empty(len(speed), dtype=np.bool_), np.empty(len(speed), dtype=np.bool_)
    expected = _KernelClass(float(direction), float(nominal_speed), float(TOLERANCE * nominal_speed))
    curves = course.curves if course else _NO_CURVES
    fit_course(speed, at.elapsed, at.travel, at.running, expected, curves, begun, fits)
    return begun, fits


def _learned(runs: Sequence[tuple[FloatArray, FloatArray]], end: float) -> SpeedCurve:
    """Return mean and spread at each grid point up to `end` of runs (axis, speed).

    A run counts with the first sample that reaches the point.
    """
    step = end / _POINTS if end > 0.0 else 1.0
    grid = step * np.arange(_POINTS + 1)
    samples = np.full((len(runs), len(grid)), np.nan)
    for row, (axis, speed) in zip(samples, runs, strict=True):
        reached = np.fmax.accumulate(axis) if len(axis) else axis
        at = np.searchsorted(reached, grid, side="left")
        there = at < len(axis)
        row[there] = speed[at[there]]
    present = np.isfinite(samples)
    count = present.sum(axis=0)
    known = count >= max(1.0, COVERAGE * len(runs))
    mean = np.where(present, samples, 0.0).sum(axis=0) / np.maximum(count, 1)
    squares = np.where(present, (samples - mean) ** 2, 0.0).sum(axis=0)
    variance = squares / np.maximum(count - 1, 1)
    # 1 % of the stroke to either side is pooled.
    smooth = moving_mean(mean[:, np.newaxis], known[:, np.newaxis], 4)[:, 0]
    spread = np.sqrt(moving_mean((variance + (mean - smooth) ** 2)[:, np.newaxis], known[:, np.newaxis], 4)[:, 0])
    last = int(np.flatnonzero(known)[-1]) + 1 if known.any() else 1
    points = np.arange(last)
    inside = known[:last] if known.any() else np.ones(1, dtype=bool)
    return SpeedCurve(
        step,
        np.interp(points, points[inside], smooth[:last][inside]),
        np.interp(points, points[inside], spread[:last][inside]),
    )


def _curve_from(values: Mapping[str, Any]) -> SpeedCurve:
    mean, spread = (np.array(values[name], dtype=np.float64) for name in ("mean", "spread"))
    step = float(values["step"])
    alike = mean.ndim == 1 and len(mean) and mean.shape == spread.shape
    if not (alike and np.isfinite((mean, spread)).all() and spread.min() >= 0.0 and 0.0 < step < math.inf):
        raise ValueError(f"a speed curve of means {mean.shape}, spreads {spread.shape} and step {step}")
    return SpeedCurve(step, mean, spread)


class _KernelCurves(NamedTuple):
    """Mean and spread of the speed over time and over travel; a curve that is not used has no points.

    The points over time are the first `time_points`: a float, the only type of number that `fields_of` has.
    `travel_end`: the last grid point over travel but one.
    """

    grid: FloatArray
    mean: FloatArray
    spread: FloatArray
    time_points: float
    travel_end: float


class _KernelClass(NamedTuple):
    """Direction and nominal speed of a class; a deviation from the mean of at most `least` fits it."""

    direction: float
    nominal_speed: float
    least: float


_NOTHING = read_only(np.empty(0))
_NO_CURVES = _KernelCurves(_NOTHING, _NOTHING, _NOTHING, time_points=0.0, travel_end=0.0)


@kernel(
    f"void({READ_ONLY}, {READ_ONLY}, {READ_ONLY}, Array(bool, 1, 'C', readonly=True), {fields_of(_KernelClass)}, "
    f"{fields_of(_KernelCurves)}, b1[::1], b1[::1])",
    exact=True,
)
def fit_course(  # noqa: C901, PLR0913  a kernel: one loop, arrays one by one
    speed: FloatArray,
    elapsed: FloatArray,
    travel: FloatArray,
    running: BoolArray,
    expected: _KernelClass,
    curves: _KernelCurves,
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
        reach = SPREADS * spread
        if reach < least:
            reach = least
        lowest, highest = mean - reach, mean + reach
        if running[k] and along >= curves.travel_end and mean < SLOW * nominal and lowest > -least:
            lowest = -least
        fits[k] = lowest <= forward <= highest
