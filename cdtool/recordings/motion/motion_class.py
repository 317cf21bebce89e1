"""The class of a motion: direction, nominal speed, the joint that leads it and, once learned, its speed course."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Self

import numpy as np

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.recordings.motion.speed_course import SpeedCourse, fitting_samples
from cdtool.recordings.recording import Recording, Series

# A speed is averaged over this long [s], and over this many samples at least: noise is no motion, and no rest.
AVERAGED_SECONDS, AVERAGED_SAMPLES = 0.1, 5
# ... but over no more than this share of the time in motion.
_AVERAGED_SHARE = 0.2
# Share of the highest averaged speed above which the axis moves.
_MOVING = 0.1


@dataclass(frozen=True)
class MotionClass:
    """Direction of travel (+1, -1; 0 = no motion), nominal speed [load unit/s] and the joint that leads the motion.

    `course`: speed along the stroke, learned from impact-free runs; None if nothing was learned. `unit`: that of the
    speed, for messages; empty if it is unknown.
    """

    direction: int
    nominal_speed: float
    joint: int = 0
    course: SpeedCourse | None = field(default=None, compare=False, repr=False)
    unit: str = field(default="", compare=False)

    def matches(self, other: MotionClass, tolerance: float) -> bool:
        """Whether joint and direction are equal, and the speeds differ by at most the share `tolerance`."""
        if self.joint != other.joint or self.direction != other.direction:
            return False
        return abs(self.nominal_speed - other.nominal_speed) <= tolerance * max(self.nominal_speed, other.nominal_speed)

    @property
    def without_course(self) -> MotionClass:
        """The class by its name alone: joint, direction and nominal speed."""
        return replace(self, course=None)

    @cached_property
    def content(self) -> tuple[object, ...]:
        """What decides which motion fits the class, its learned speed included: hashable, equal for equal classes."""
        course = self.course.content if self.course else None
        return self.direction, self.nominal_speed, self.joint, course

    def fitting(self, recording: Recording) -> tuple[BoolArray, BoolArray]:
        """Return for each speed sample (n,) whether a stroke has begun, and whether the speed fits it so far; causal.

        See `fitting_samples`.
        """
        return fitting_samples(recording, self.direction, self.nominal_speed, self.joint, self.course)

    @property
    def described(self) -> str:
        """For messages: direction and speed."""
        word = {1: "forward", -1: "backward", 0: "at rest"}[self.direction]
        return f"{word} at {self.speed_in_words(self.nominal_speed)}" if self.direction else word

    def speed_in_words(self, speed: float) -> str:
        """For messages: a speed with the unit of this class."""
        return f"{speed:.3g} {self.unit}" if self.unit else f"{speed:.3g}/s"

    def to_dict(self) -> dict[str, Any]:
        """Return the class as JSON values."""
        course = {"course": self.course.to_dict()} if self.course else {}
        unit = {"speed_unit": self.unit} if self.unit else {}
        return {"direction": self.direction, "nominal_speed": self.nominal_speed, "joint": self.joint, **unit, **course}

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """Return the class that `to_dict` has written; without a course where the file holds none."""
        course = SpeedCourse.from_dict(values["course"]) if values.get("course") else None
        unit = str(values.get("speed_unit", ""))
        return cls(int(values["direction"]), float(values["nominal_speed"]), int(values["joint"]), course, unit)


def motion_class(recording: Recording) -> MotionClass:
    """Return direction, nominal speed and leading joint of a whole recording: at rest if no speed is logged.

    The nominal speed is the median of the averaged speeds above 80 % of the usual one in motion, so that an overshoot
    does not count. Averaged over time, a speed that is noisy, or derived from jittering stamps, is not overestimated.
    The reference speed decides if it is logged: an early contact does not change it. The whole recording is used: for
    names, never for an assessment.
    """
    return _class_by(recording, ("reference_speed", "speed"))


def measured_class(recording: Recording) -> MotionClass:
    """Return the class by the measured speed only: impact-free runs are learned by it, with or without a reference."""
    return _class_by(recording, ("speed",))


def _class_by(recording: Recording, channels: Sequence[str]) -> MotionClass:
    for channel in channels:
        if channel in recording and (found := _class_of_speed(recording[channel])):
            return found
    return MotionClass(0, 0.0)


def _class_of_speed(series: Series) -> MotionClass | None:
    """Return the class of a speed, computed once; None without a sample."""
    return series.derived("class of motion", lambda: _class_over(series))


def _class_over(series: Series) -> MotionClass | None:
    joint = leading_joint(series)
    speed = series.values[:, joint]
    present = np.isfinite(speed)
    if not present.any():
        return None
    if not present.all():
        series = Series(series.time[present], series.values[present], series.unit)
        speed = series.values[:, joint]
    period = series.period if len(series) > 1 else 0.0
    return replace(_class_of(series.time, np.ascontiguousarray(speed), joint, period), unit=series.unit)


def leading_joint(speed: Series) -> int:
    """Return the joint that moves most: largest mean absolute speed."""
    if speed.joint_count == 1:
        return 0
    known = np.isfinite(speed.values)
    total = np.sum(np.abs(speed.values), axis=0, where=known)
    return int(np.argmax(total / np.maximum(known.sum(axis=0), 1)))


def averaged(time: FloatArray, speed: FloatArray, seconds: float) -> FloatArray:
    """Return the mean speed (n,) over `seconds` about each sample: travel by time, so that jitter of stamps cancels."""
    if len(time) < 2:
        return speed
    # The first step is unknown: the second replaces it, so that the first sample counts too.
    steps = np.diff(time)
    ends = np.concatenate(([time[0] - steps[0]], time))
    travel = np.concatenate(([0.0], np.cumsum(np.concatenate((steps[:1], steps)) * speed)))
    before, after = np.maximum(time - 0.5 * seconds, ends[0]), np.minimum(time + 0.5 * seconds, ends[-1])
    return np.asarray((np.interp(after, ends, travel) - np.interp(before, ends, travel)) / (after - before))


def _class_of(time: FloatArray, speed: FloatArray, joint: int, period: float) -> MotionClass:
    seconds = max(AVERAGED_SECONDS, AVERAGED_SAMPLES * period)
    smooth = averaged(time, speed, seconds)
    size = np.abs(smooth)
    in_motion = period * float(np.count_nonzero(size > _MOVING * size.max()))
    if in_motion * _AVERAGED_SHARE < seconds:
        smooth = averaged(time, speed, max(in_motion * _AVERAGED_SHARE, period)) if period else speed
        size = np.abs(smooth)
    # In order of size, the samples above a level are the last ones, and their median is in the middle of these.
    ordered = np.sort(size)
    moving = ordered[int(np.searchsorted(ordered, _MOVING * ordered[-1], side="right")) :]
    if not len(moving):
        return MotionClass(0, 0.0, joint)
    usual, level = _middle(moving), 0.0
    for _ in range(2):
        level = 0.8 * usual  # runs, and does not accelerate
        usual = _middle(ordered[int(np.searchsorted(ordered, level, side="left")) :])
    fast = smooth[size >= level]
    # Equal motion in both directions has the direction of the first: noise must not decide.
    # A motion goes one way where a fifth of its travel at speed is left when there and back cancel.
    lead = float(np.sum(fast)) if abs(float(np.sum(fast))) > 0.2 * float(np.sum(np.abs(fast))) else float(fast[0])
    direction = 1 if lead > 0.0 else -1
    return MotionClass(direction, usual, joint)


def _middle(ordered: FloatArray) -> float:
    """Return the median of values in ascending order."""
    half = len(ordered) // 2
    return float(ordered[half] if len(ordered) % 2 else 0.5 * (ordered[half - 1] + ordered[half]))
