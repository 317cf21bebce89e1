"""The speeds between learned classes of motion: which of them a log runs so far, from its measured speed alone.

At each location of the stroke the classes' learned speeds c_i(x) are compared with the measured one v::

    s = n_i + (v - c_i) / (c_{i+1} - c_i) (n_{i+1} - n_i),    n_i: nominal speeds

The exponentially weighted mean of s with a time constant of 2 s, of samples that are at least 0.3 s old, is the speed
that the log runs at: a contact that slows the axis does not change it before its alarm. A sample counts by its
precision, that is by how many of their spreads the two classes are apart there: close classes cannot be told from each
other while both accelerate. It is looked for where the classes run alike, that is where c_i / n_i is the same for all:
not while a faster class still accelerates, or already brakes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.base.derived import SendsFields
from cdtool.base.kernels import READ_ONLY, fields_of, kernel, read_only
from cdtool.recordings.motion.motion_class import MotionClass
from cdtool.recordings.motion.progress import CONFIRM, RUNNING_SHARE, START_SHARE
from cdtool.recordings.motion.speed_course import SLOW, SPREADS, TOLERANCE, stroke_progress
from cdtool.recordings.recording import Recording

# Age of a sample that is learned from, and time for which nothing is learned after a departure [s].
GUARD = 0.3
# A speed, or a level, is the mean over about this time; a speed is known after this much of it [s].
MEMORY, KNOWN = 2.0, 0.1
# A departure that lasts longer is another speed, which is learned again [s].
FORGET = 1.0
# Where one of two classes is below this share of its nominal speed, they do not run.
_MOVING = 0.5

_TABLE = "Array(float64, 2, 'C', readonly=True)"


class _KernelCourses(NamedTuple):
    """Nominal speeds (m,), the step of the grid over travel, and where on it (g,) the classes run `alike` (1, else 0).

    `direction` is +1 or -1.
    """

    nominal: FloatArray
    alike: FloatArray
    step: float
    direction: float


@dataclass(frozen=True)
class SpeedRange(SendsFields):
    """Two or more classes of one direction and joint with their learned speeds, by nominal speed, and all between them.

    It stands where a `MotionClass` does to decide which motion fits.
    """

    classes: tuple[MotionClass, ...]

    @property
    def direction(self) -> int:
        """Return the direction of all of them."""
        return self.classes[0].direction

    @property
    def joint(self) -> int:
        """Return the joint that leads all of them."""
        return self.classes[0].joint

    @cached_property
    def content(self) -> tuple[object, ...]:
        """What decides which motion fits: hashable, equal for equal classes."""
        return "speed range", *(item.content for item in self.classes)

    def running_from(self, number: int) -> float:
        """Return the time since the start [s] from which a class runs at 95 % of its nominal speed."""
        motion = self.classes[number]
        assert motion.course is not None
        curve = motion.course.by_time
        runs = np.flatnonzero(curve.mean >= RUNNING_SHARE * motion.nominal_speed)
        return curve.step * float(runs[0] if len(runs) else len(curve.mean) - 1)

    def fitting(self, recording: Recording) -> tuple[BoolArray, BoolArray]:
        """Return for each speed sample (n,) whether a stroke has begun, and whether its speed is in the range so far.

        Before the speed is known, and where the classes do not run alike, any speed between theirs fits. Causal.
        """
        begun, fits, _ = self._followed(recording)
        return begun, fits

    def speed_so_far(self, recording: Recording, clock: FloatArray) -> FloatArray:
        """Return the speed that selects between the classes at each time of `clock` (n,); NaN while it is not known.

        Also NaN where the classes do not run alike. Within the range of the nominal speeds. Causal.
        """
        time, found = recording["speed"].time, self._followed(recording)[2]
        if clock is time or not len(time):
            return found if len(time) else np.full(len(clock), np.nan)
        at = np.searchsorted(time, clock, side="right") - 1
        speed: FloatArray = np.where(at >= 0, found[np.maximum(at, 0)], np.nan)
        return speed

    def _followed(self, recording: Recording) -> tuple[BoolArray, BoolArray, FloatArray]:
        return recording.derived(("speed followed", self.content), lambda: self._follow(recording))

    def _follow(self, recording: Recording) -> tuple[BoolArray, BoolArray, FloatArray]:
        speed = np.ascontiguousarray(recording["speed"].values[:, self.joint])
        slowest = self.classes[0]
        at = stroke_progress(recording, self.direction, slowest.nominal_speed, self.joint)
        begun, fits = np.empty(len(speed), dtype=np.bool_), np.empty(len(speed), dtype=np.bool_)
        found = np.empty(len(speed))
        follow_speed(recording["speed"].time, speed, at.elapsed, at.travel, *self._courses, begun, fits, found)
        return begun, fits, found

    @cached_property
    def _courses(self) -> tuple[_KernelCourses, FloatArray, FloatArray]:
        """The courses on one grid over travel, their means and their spreads (g, m)."""
        curves = [item.course.by_travel for item in self.classes if item.course is not None]
        step = min(curve.step for curve in curves)
        ends = [curve.step * (len(curve.mean) - 1) for curve in curves]
        grid = step * np.arange(math.ceil(max(ends) / step) + 1)
        own = [curve.step * np.arange(len(curve.mean)) for curve in curves]
        mean, spread = (
            read_only(np.column_stack([np.interp(grid, at, values) for at, values in zip(own, each, strict=True)]))
            for each in ([curve.mean for curve in curves], [curve.spread for curve in curves])
        )
        nominal = np.array([item.nominal_speed for item in self.classes])
        shares = mean / nominal
        # Classes run alike where their shares of the nominal speed differ by at most 0.1, and 0.3 of how far nominal
        # speeds are apart, between the first and the last location where each of them has reached 0.9. Before that,
        # all accelerate, and those that do so alike cannot be told apart.
        most = min(0.1, 0.3 * float(np.diff(nominal).min() / nominal[-1]))
        alike = (np.ptp(shares, axis=1) <= most) & (shares.min(axis=1) >= _MOVING)
        for share in shares.T:
            runs = np.flatnonzero(share >= 0.9)
            first, last = (runs[0], runs[-1]) if len(runs) else (len(share), -1)
            alike[:first] = alike[last + 1 :] = False
        return (
            _KernelCourses(read_only(nominal), read_only(alike.astype(np.float64)), step, float(self.direction)),
            mean,
            spread,
        )


def in_ranges(classes: Sequence[MotionClass]) -> list[list[int]]:
    """Return the numbers of the classes of each direction and joint, by nominal speed, in the order of the first."""
    kinds: dict[tuple[int, int], list[int]] = {}
    for number, item in enumerate(classes):
        kinds.setdefault((item.direction, item.joint), []).append(number)
    return [sorted(numbers, key=lambda number: classes[number].nominal_speed) for numbers in kinds.values()]


@kernel(
    f"void({READ_ONLY}, {READ_ONLY}, {READ_ONLY}, {READ_ONLY}, {fields_of(_KernelCourses)}, {_TABLE}, {_TABLE}, "
    "b1[::1], b1[::1], float64[::1])",
)
def follow_speed(  # noqa: C901, PLR0913  a kernel: one loop, arrays one by one
    time: FloatArray,
    measured: FloatArray,
    elapsed: FloatArray,
    travel: FloatArray,
    courses: _KernelCourses,
    course: FloatArray,
    spread: FloatArray,
    begun: BoolArray,
    fits: BoolArray,
    speed: FloatArray,
) -> None:
    """Fill where a stroke has `begun`, where its speed `fits` the range, and the `speed` that it runs at, all (n,).

    `course` and `spread` (g, m): those of the classes at each location.
    """
    nominal, count, last = courses.nominal, len(courses.nominal), len(courses.alike) - 1
    own = np.empty(len(time))
    slowest, fastest = nominal[0], nominal[count - 1]
    # The speed is known once its standard deviation is below a fifth of how far the fastest and the slowest class are
    # apart, or, of close classes, of a fifth of the slowest speed. Errors of less than `KNOWN` seconds go together.
    most_doubt = 0.2 * max(0.2 * slowest, fastest - slowest)
    precision = np.empty(len(time))
    level = learned = weights = weighed = 0.0
    old = first = backward = 0
    departed, frozen_until = math.nan, -math.inf
    for k in range(len(time)):
        own[k] = math.nan
        speed[k] = math.nan
        forward = courses.direction * measured[k]
        backward = backward + 1 if forward <= -START_SHARE * slowest else 0
        begun[k] = math.isfinite(elapsed[k])
        fits[k] = backward < CONFIRM
        if not begun[k]:
            continue
        while old < k and time[old] <= time[k] - GUARD:
            if old >= first and time[k] > frozen_until and not math.isnan(own[old]):
                # What happened in a gap is unknown: the sample before it counts for the guard at most.
                step = min(time[old + 1] - time[old], GUARD)
                if step > 0.0:
                    learned += step
                    past = math.exp(-step / MEMORY)
                    weighed = past * weighed + step
                    weights = past * weights + step * precision[old]
                    level += step * precision[old] / weights * (own[old] - level)
            old += 1
        at = 0.0 if math.isnan(travel[k]) else min(max(travel[k] / courses.step, 0.0), float(last))
        place = min(int(at), max(last - 1, 0))
        part = at - place
        after = min(place + 1, last)
        alike = courses.alike[place] > 0.0 and courses.alike[after] > 0.0
        doubt = math.sqrt(min(weighed, KNOWN) / weights) if weights > 0.0 else math.inf
        known = learned >= KNOWN and alike and doubt <= most_doubt
        if known:
            speed[k] = min(max(level, slowest), fastest)
        if math.isnan(forward):
            fits[k] = False
            continue
        lowest, highest = math.inf, -math.inf
        mean = wide = before_mean = before_wide = 0.0
        is_found = False
        ordered = True
        for i in range(count):
            here = course[place, i] + part * (course[after, i] - course[place, i])
            around = spread[place, i] + part * (spread[after, i] - spread[place, i])
            reach = max(SPREADS * around, TOLERANCE * nominal[i])
            lowest, highest = min(lowest, here - reach), max(highest, here + reach)
            if at >= last - 1 and here < SLOW * nominal[i]:
                lowest = min(lowest, -TOLERANCE * nominal[i])
            if i > 0:
                gap = nominal[i] - nominal[i - 1]
                ordered = ordered and here - before_mean > 0.5 * _MOVING * gap  # so that dividing by it is safe
                if alike and ordered and (math.isnan(own[k]) or forward > before_mean):
                    share = (forward - before_mean) / (here - before_mean)
                    own[k] = nominal[i - 1] + share * gap
                    noise = before_wide + min(max(share, 0.0), 1.0) * (around - before_wide)
                    # A smaller spread counts as this much: without noise every sample is as precise.
                    noise = max(noise, 1e-3 * nominal[i])
                    precision[k] = ((here - before_mean) / (gap * noise)) ** 2
                if known and not is_found and speed[k] <= nominal[i]:
                    weight = (speed[k] - nominal[i - 1]) / gap
                    mean = before_mean + weight * (here - before_mean)
                    wide = before_wide + weight * (around - before_wide)
                    wide = math.hypot(wide, doubt * (here - before_mean) / gap)
                    is_found = True
            before_mean, before_wide = here, around
        fits[k] = lowest <= forward <= highest
        if known:
            reach = max(SPREADS * wide, TOLERANCE * speed[k])
            inside = (1.0 - TOLERANCE) * slowest <= level <= (1.0 + TOLERANCE) * fastest
            fits[k] = fits[k] and inside and mean - reach <= forward <= mean + reach
        if not (fits[k] and ordered):
            own[k] = math.nan
        if fits[k]:
            departed = math.nan
            continue
        if math.isnan(departed):
            departed = time[k]
        frozen_until = time[k] + GUARD
        if time[k] - departed > FORGET:
            level = learned = weights = weighed = 0.0
            first = k + 1
            departed = math.nan
            frozen_until = -math.inf
