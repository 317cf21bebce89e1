"""A learned signature: curves along the stroke and the rule that derives limits from them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal, NamedTuple, Self, get_args

import numpy as np
import numpy.typing as npt

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.base.derived import SendsFields
from cdtool.base.errors import SignatureError, UsageError, nearest
from cdtool.base.kernels import READ_ONLY, fields_of, kernel, read_only
from cdtool.base.value_words import value_in_words
from cdtool.detectors.detection import Band, Signal, Status, StatusArray
from cdtool.recordings.motion import MotionClass
from cdtool.recordings.motion.progress import ALIGNMENTS, RUNNING_SHARE, START_SHARE, Progress, progress
from cdtool.recordings.motion.speed_course import SpeedCourse
from cdtool.recordings.recording import Recording
from cdtool.thresholds.running_level_kernel import follow_level
from cdtool.thresholds.settings import SIDES, watched_side
from cdtool.thresholds.signature_curve import Curve, resample

PlaceArray = npt.NDArray[np.int32]
# A location of so many grid steps, 2^63, has no number that an int64 can represent.
_TOO_MANY_STEPS = 2.0**63
_PLACES = "Array(int32, 1, 'C', readonly=True)"
_TABLE = "Array(float64, 2, 'C', readonly=True)"


SpreadRule = Literal["pooled", "thesis"]
SPREAD_RULES: tuple[SpreadRule, ...] = get_args(SpreadRule)


@dataclass(frozen=True)
class FittedSignature(SendsFields):
    """Statistics of the runs along the stroke, for one class of motion, and the rule that derives limits from them.

    `evaluate` uses the time since the motion began while accelerating, and the travel afterwards (or only one of them).
    Status NO_LIMIT before the motion begins and where there are too few runs.
    """

    motion: MotionClass
    alignment: str
    rule: str
    sides: str
    safety_factor: float
    signed: bool
    joints: tuple[str, ...]
    by_time: Curve
    by_travel: Curve
    adaptive_level: float = 0.0
    speed_range: bool = False

    def evaluate(self, recording: Recording, signal: Signal) -> tuple[Signal, Band]:
        """Return the signal and its band on the signal's clock; raises RecordingError without speed and position.

        With `adaptive_level` the band follows the run, by at most so many spreads, see `follow_level`. Raises
        SignatureError if the signal is of other joints than those learned. `speed_range`: for the speeds between this
        class and others see `thresholds.speed_range`.
        """
        self.check_joints(signal)
        places = self._places(recording, signal.time)
        lower, upper = np.empty(signal.values.shape), np.empty(signal.values.shape)
        status = np.empty(signal.values.shape, dtype=np.uint8)
        flat = np.ascontiguousarray(signal.status).reshape(-1)
        limits_at(*places, *self._lower, *self._upper, flat, lower, upper, status.reshape(-1))
        if self.adaptive_level > 0.0:
            mean, spread = np.empty(signal.values.shape), np.empty(signal.values.shape)
            limits_at(*places, *self._mean, *self._spread, flat, mean, spread, np.empty_like(flat))
            values = np.ascontiguousarray(signal.values)
            follow_level(signal.time, values, mean, spread, status, self.adaptive_level, lower, upper)
        return signal.changed(status=status), Band(lower, upper)

    def check_joints(self, signal: Signal) -> None:
        """Raise SignatureError if the signal is of other joints than those learned."""
        if signal.joints != self.joints:
            learned, given = (", ".join(names) or "none" for names in (self.joints, signal.joints))
            raise SignatureError(f"learned for the joints {learned}, not for {given}", "learn a signature for these")
        if signal.values.shape[1] != self.by_time.count.shape[1]:
            learned, given = (str(item.shape[1]) for item in (self.by_time.count, signal.values))
            raise SignatureError(f"learned for {learned} joints, not for {given}", "learn a signature for these")

    def normal(self, at: Progress, status: StatusArray) -> tuple[FloatArray, FloatArray]:
        """Return mean and spread (n, J) at each location; NaN where too few runs were. `status` (n J,) is not changed.

        The location is the time until `at.running`, and the travel from there on.
        """
        shape = len(at.elapsed), self.by_time.count.shape[1]
        mean, spread = np.empty(shape), np.empty(shape)
        limits_at(*self._located(at), *self._mean, *self._spread, status, mean, spread, np.empty_like(status))
        return mean, spread

    def _places(self, recording: Recording, clock: FloatArray) -> tuple[PlaceArray, PlaceArray, FloatArray]:
        """Return where each sample is on the grids, see `locate`; found once for all signatures with these grids."""
        own = recording.own_clock(clock)
        if own is None:
            return self._located(self.progress(recording, clock))
        return recording.derived(self._content_of_grids, lambda: self._located(self.progress(recording, own)), own)

    @cached_property
    def _content_of_grids(self) -> tuple[object, ...]:
        """What decides where a sample is on the grids: the motion and the grids themselves."""
        motion, time, travel = self.motion, self.by_time, self.by_travel
        grids = (self.alignment, time.step, len(time.count), time.end, travel.step, len(travel.count))
        return "places", motion.direction, motion.nominal_speed, motion.joint, *grids

    def _located(self, at: Progress) -> tuple[PlaceArray, PlaceArray, FloatArray]:
        place, nearest = (np.empty(len(at.elapsed), dtype=np.int32) for _ in range(2))
        beyond = np.empty(len(at.elapsed))
        locate(at.elapsed, at.travel, at.running, self._grids, place, nearest, beyond)
        return place, nearest, beyond

    @cached_property
    def _used(self) -> tuple[Curve, ...]:
        """The curves that the alignment uses, that over time first."""
        curves = {"time": (self.by_time,), "position": (self.by_travel,)}
        return curves.get(self.alignment, (self.by_time, self.by_travel))

    @cached_property
    def _grids(self) -> _KernelGrids:
        time, travel = self.by_time, self.by_travel
        points = read_only(np.concatenate([curve.grid for curve in self._used]))
        time_points = float(len(time.count)) if self.alignment != "position" else 0.0
        return _KernelGrids(points, time_points, float(time.step), float(time.end), float(travel.step))

    @cached_property
    def _lower(self) -> tuple[FloatArray, FloatArray, bool]:
        return self._table([self.limits(curve)[0] for curve in self._used])

    @cached_property
    def _upper(self) -> tuple[FloatArray, FloatArray, bool]:
        return self._table([self.limits(curve)[1] for curve in self._used])

    @cached_property
    def _mean(self) -> tuple[FloatArray, FloatArray, bool]:
        return self._table([curve.band(self.pooled)[0] for curve in self._used])

    @cached_property
    def _spread(self) -> tuple[FloatArray, FloatArray, bool]:
        return self._table([curve.band(self.pooled)[1] for curve in self._used])

    def _table(self, limits: Sequence[FloatArray]) -> tuple[FloatArray, FloatArray, bool]:
        """Return values at the grid points of the curves, their slopes to the next one, and if one is infinite there.

        A last row is NaN, for samples outside the grids.
        """
        slopes = []
        for curve, limit in zip(self._used, limits, strict=True):
            with np.errstate(invalid="ignore"):
                slopes += [np.diff(limit, axis=0) / np.diff(curve.grid)[:, np.newaxis], np.zeros((1, limit.shape[1]))]
        unknown = np.full((1, limits[0].shape[1]), np.nan)
        table = np.concatenate((*limits, unknown))
        return table, np.concatenate((*slopes, unknown)), bool(np.isinf(table).any())

    def limits(self, curve: Curve) -> tuple[FloatArray, FloatArray]:
        """Return lower and upper limit (g, J) on the grid of a curve: mean -+ k s, infinite without a limit."""
        mean, spread = curve.band(self.pooled)
        reach = self.safety_factor * spread
        lower, upper = mean - reach, mean + reach
        if self.side < 0:
            upper = np.where(np.isnan(upper), np.nan, np.inf)
        elif self.side > 0:
            lower = np.where(np.isnan(lower), np.nan, -np.inf)
        return lower, upper

    def with_run(
        self, recording: Recording, signal: Signal, effective_runs: float | None = None, cap: float | None = None
    ) -> FittedSignature:
        """Return the signature with one more impact-free run: Welford's update, or one of weight 1 / `effective_runs`.

        `cap`: at each grid point the run counts as no further than that many spreads from the mean (see `guarded`).
        """
        by_time, by_travel = self.samples(recording, signal)
        if cap is not None:
            by_time = self.by_time.clipped(by_time, cap, self.pooled)
            by_travel = self.by_travel.clipped(by_travel, cap, self.pooled)
        return replace(
            self,
            by_time=self.by_time.updated(by_time, effective_runs),
            by_travel=self.by_travel.updated(by_travel, effective_runs),
        )

    def without_run(self, recording: Recording, signal: Signal) -> FittedSignature:
        """Return the signature as learned from all its runs except this one, on the same grid; not after forgetting."""
        by_time, by_travel = self.samples(recording, signal)
        return replace(self, by_time=self.by_time.without(by_time), by_travel=self.by_travel.without(by_travel))

    def samples(self, recording: Recording, signal: Signal) -> tuple[FloatArray, FloatArray]:
        """Return the values of one run on the grids of `by_time` and `by_travel`, each (g, J); NaN without a value"""
        at = self.progress(recording, signal.time)
        by_time, by_travel = (
            resample(signal, at, curve, axis) for curve, axis in axes_of(self.by_time, self.by_travel, at)
        )
        return by_time, by_travel

    def with_safety_factor(self, factor: float) -> FittedSignature:
        """Return the signature with its limits at `factor` spreads from the mean."""
        return self._doubled if factor == 2.0 * self.safety_factor else replace(self, safety_factor=factor)

    @cached_property
    def _doubled(self) -> FittedSignature:
        """With twice the safety factor: `exceedance` compares every log with it, its limits are computed once."""
        return replace(self, safety_factor=2.0 * self.safety_factor)

    @property
    def side(self) -> int:
        """The side with a limit: +1 above, -1 below, 0 both."""
        return watched_side(self.sides, self.motion, self.signed)

    @property
    def pooled(self) -> bool:
        """Whether mean and spread are those of the neighbours within the window."""
        return self.rule == "pooled"

    @property
    def runs(self) -> int:
        """The largest number of runs at any grid point."""
        return int(max(self.by_time.count.max(initial=0), self.by_travel.count.max(initial=0)))

    def changes_curve(self, recording: Recording, clock: FloatArray) -> BoolArray:
        """Return True (n,) at the sample from which travel counts instead of time: mean and spread may jump there."""
        changes = np.zeros(len(clock), dtype=bool)
        if self.alignment == "time_then_position":
            running = self.progress(recording, clock).running
            changes[1:] = running[1:] & ~running[:-1]
        return changes

    def to_dict(self) -> dict[str, Any]:
        """Return the signature as JSON values."""
        return {
            "direction": self.motion.direction,
            "nominal_speed": self.motion.nominal_speed,
            "leading_joint": self.motion.joint,
            "speed_unit": self.motion.unit,
            "speed_course": self.motion.course.to_dict() if self.motion.course else None,
            "alignment": self.alignment,
            "rule": self.rule,
            "sides": self.sides,
            "safety_factor": self.safety_factor,
            "signed": self.signed,
            "joints": list(self.joints),
            "by_time": self.by_time.to_dict(),
            "by_position": self.by_travel.to_dict(),
            "adaptive_level": self.adaptive_level,
            "speed_range": self.speed_range,
        }

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """Return the signature that `to_dict` has written."""
        return cls(
            motion=MotionClass(
                int(values["direction"]),
                float(values["nominal_speed"]),
                int(values["leading_joint"]),
                SpeedCourse.from_dict(values["speed_course"]) if values.get("speed_course") else None,
                str(values.get("speed_unit", "")),
            ),
            alignment=known("alignment", values["alignment"], ALIGNMENTS),
            rule=known("rule", values["rule"], SPREAD_RULES),
            sides=known("sides", values["sides"], SIDES),
            safety_factor=float(values["safety_factor"]),
            signed=bool(values["signed"]),
            joints=tuple(map(str, values["joints"])),
            by_time=Curve.from_dict(values["by_time"]),
            by_travel=Curve.from_dict(values["by_position"]),
            adaptive_level=float(values.get("adaptive_level", 0.0)),
            speed_range=bool(values.get("speed_range", False)),
        )

    def progress(self, recording: Recording, clock: FloatArray) -> Progress:
        """Return where in its stroke a recording is at each time of `clock`; raises RecordingError."""
        return progress_of(recording, clock, self.motion)


def progress_of(recording: Recording, clock: FloatArray, motion: MotionClass) -> Progress:
    """Return where in a stroke of a class a recording is at each time of `clock` [s]; raises RecordingError."""
    start, running = START_SHARE * motion.nominal_speed, RUNNING_SHARE * motion.nominal_speed
    return progress(recording, clock, motion.direction, start, running, motion.joint)


def axes_of(by_time: Curve, by_travel: Curve, at: Progress) -> tuple[tuple[Curve, FloatArray], ...]:
    """Return each curve with its axis."""
    return ((by_time, at.elapsed), (by_travel, at.travel))


def known(what: str, value: Any, allowed: Sequence[str]) -> str:
    """Return a value if it is one of those allowed.

    Parameters
    ----------
    what : str
        Name of the setting, for the message.
    value : object
        The value.
    allowed : sequence of str
        The values allowed.

    Returns
    -------
    str
        The value.

    Raises
    ------
    UsageError
        The value is not allowed; the hint names the nearest that is.

    Examples
    --------
    >>> known("sides", "one", SIDES)
    'one'
    """
    if value not in allowed:
        raise UsageError(f"unknown {what} {value_in_words(value)}", nearest(str(value), allowed))
    return str(value)


class _KernelGrids(NamedTuple):
    """The grids of a signature's curves over time and over travel; a curve that is not used has no `points`.

    The points over time are the first `time_points`: a float, the only type of number that `fields_of` has.
    `time_end`: the last one that enough runs have reached.
    """

    points: FloatArray
    time_points: float
    time_step: float
    time_end: float
    travel_step: float


@kernel(
    f"void({READ_ONLY}, {READ_ONLY}, Array(bool, 1, 'C', readonly=True), {fields_of(_KernelGrids)}, int32[::1], "
    "int32[::1], float64[::1])",
    exact=True,
)
def locate(  # noqa: C901  a kernel: one loop, arrays one by one
    elapsed: FloatArray,
    travel: FloatArray,
    running: BoolArray,
    grids: _KernelGrids,
    place: PlaceArray,
    nearest: PlaceArray,
    beyond: FloatArray,
) -> None:
    """Fill each sample's last grid point, how far `beyond` it the sample is, and the nearest grid point.

    Without one, one past the last: before the motion begins, or outside the grid, which still has a nearest point.
    If both time and travel are used, the time counts until the axis runs, and at most up to `time_end`.
    """
    grid, time_points, points = grids.points, int(grids.time_points), len(grids.points)
    uses_time, uses_travel = time_points > 0, points > time_points
    time_place = 0
    travel_place = time_points
    for k in range(len(elapsed)):
        place[k] = points
        nearest[k] = points
        beyond[k] = 0.0
        if not math.isfinite(elapsed[k]):
            continue
        by_travel = uses_travel and (running[k] or not uses_time)
        if by_travel:
            location, step, at, first, last = travel[k], grids.travel_step, travel_place, time_points, points - 1
        else:
            location, step, at, first, last = elapsed[k], grids.time_step, time_place, 0, time_points - 1
            if uses_travel and location > grids.time_end:
                location = grids.time_end
        if math.isnan(location):
            nearest[k] = first
            if last == first:  # as numpy: a grid of a single point has its value there
                place[k] = first
            continue
        steps = np.rint(location / step)
        nearest[k] = first + (min(max(int(steps), 0), last - first) if abs(steps) < _TOO_MANY_STEPS else 0)
        if location < grid[first] or location > grid[last]:
            continue
        while at < last and grid[at + 1] <= location:
            at += 1
        while grid[at] > location:
            at -= 1
        place[k] = at
        beyond[k] = location - grid[at]
        if by_travel:
            travel_place = at
        else:
            time_place = at


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
def limits_at(  # noqa: PLR0913  a kernel: one loop, arrays one by one
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
    new_status: StatusArray,
) -> None:
    """Fill both limits (n, J), and `new_status` (n J,): `status`, NO_LIMIT where a valid sample's limit is unknown."""
    _limit_at(place, nearest, beyond, lower_table, lower_slope, lower_has_infinite, lower)
    _limit_at(place, nearest, beyond, upper_table, upper_slope, upper_has_infinite, upper)
    low, high = lower.reshape(lower.size), upper.reshape(upper.size)
    for i in range(len(status)):
        unknown = (status[i] == Status.VALID) & ((low[i] != low[i]) | (high[i] != high[i]))
        new_status[i] = Status.NO_LIMIT.value if unknown else status[i]
