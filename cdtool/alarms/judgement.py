"""Compare a detector's signal with thresholds over a whole log: statistic, band and activation.

With several classes of motion, the threshold that applies is selected sample by sample, from earlier samples only.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.base.kernels import kernel
from cdtool.detectors.detection import Band, Signal, Status, StatusArray, contiguous
from cdtool.recordings.motion import MotionClass
from cdtool.recordings.motion.applicable import GRACE, Motion, applicable_classes, speed_is_recent
from cdtool.recordings.motion.evident_motion import evident_speed
from cdtool.recordings.motion.strokes import Stroke, strokes_so_far
from cdtool.recordings.recording import Recording
from cdtool.thresholds.base import Evaluable, FittedThreshold, is_per_run
from cdtool.thresholds.contract import checked_evaluation, checked_exceedance, checked_factor
from cdtool.thresholds.speed_range import over_speeds

_MATRIX = "Array(float64, 2, 'C', readonly=True)"
_STATUS = "Array(uint8, 2, 'C', readonly=True)"
_ROWS = "Array(bool, 1, 'C', readonly=True)"
# Marks of a sample: on which sides a class leaves it unlimited, and whether a class limits it.
OPEN_BELOW, OPEN_ABOVE, LIMITED = 1, 2, 4


@dataclass(frozen=True)
class _Evaluation:
    """The `rows` of a log on which a threshold is evaluated, and where it `applies` (rows,)."""

    threshold: Evaluable
    recording: Recording
    signal: Signal
    rows: slice
    applies: BoolArray

    @cached_property
    def evaluated(self) -> tuple[Signal, Band]:
        """Return the statistic and its band on these rows; raises RecordingError if the threshold fails."""
        return checked_evaluation(self.threshold, self.recording, self.signal)

    def at_share(self, factor_share: float) -> tuple[Signal, Band]:
        """Return `evaluated` at a share of the safety factor."""
        changed = checked_factor(self.threshold, factor_share * self.threshold.safety_factor)
        return checked_evaluation(changed, self.recording, self.signal)

    @cached_property
    def exceedance(self) -> tuple[Signal, FloatArray]:
        """Return the statistic, and for each sample (rows, J) the safety factor at which its limit would be met."""
        return checked_exceedance(self.threshold, self.recording, self.signal, self.evaluated)


@dataclass(frozen=True)
class Judgement:
    """A signal with its thresholds over a whole log; `recording` has no ground truth.

    If several classes of motion apply, a sample is outside only if it is outside all of their bands. If no threshold
    has a class, the first one applies everywhere; otherwise those without a class are not used. `strokes` are those of
    a log that is cut, as they were known while it ran.
    """

    recording: Recording
    signal: Signal
    thresholds: tuple[FittedThreshold, ...]
    strokes: tuple[Stroke, ...]
    grace: float = GRACE

    @property
    def classes(self) -> tuple[MotionClass, ...]:
        """Return the classes of motion that were learned."""
        return classes_of(self.thresholds)

    @cached_property
    def evaluated(self) -> tuple[Signal, Band]:
        """Return the statistic and its band; raises RecordingError if a threshold fails."""
        return self._merged([part.evaluated for part in self._evaluations])

    def narrower(self, factor_share: float) -> Band:
        """Return the band at a share of the safety factor."""
        return self._merged([item.at_share(factor_share) for item in self._evaluations])[1]

    @cached_property
    def met_at(self) -> FloatArray:
        """Return (n, J) the safety factor at which each sample's limit would be met; -inf without a limit."""
        met = np.full(self.signal.values.shape, np.inf)
        applied = np.zeros(met.shape, dtype=bool)
        for part in self._evaluations:
            statistic, own = part.exceedance
            valid = part.applies[:, np.newaxis] & (statistic.status == Status.VALID)
            rows = slice(part.rows.start, part.rows.start + len(own))
            met[rows] = np.where(valid & ((own < met[rows]) | np.isnan(own)), own, met[rows])
            applied[rows] |= valid
        met[~applied] = -np.inf
        return met

    @cached_property
    def _evaluations(self) -> tuple[_Evaluation, ...]:
        if not self.classes and self.thresholds and is_per_run(self.thresholds[0]) and len(self.strokes) > 1:
            return tuple(self._of_stroke(number) for number in range(len(self.strokes)))
        if not self.classes:
            n = len(self.signal.time)
            log = self.recording, self.signal, slice(0, n), np.ones(n, dtype=bool)
            return tuple(_Evaluation(item, *log) for item in self.thresholds[:1])
        applied = over_speeds([item for item in self.thresholds if class_of(item) is not None])
        motions: list[Motion] = [getattr(item, "motion") for item in applied]  # noqa: B009
        applicable = applicable_classes(self.recording, motions, self.strokes, self.signal.time, self.grace)
        return tuple(self._evaluation(applied[item.motion], item.stroke, item.where) for item in applicable)

    def _of_stroke(self, number: int) -> _Evaluation:
        """Evaluate the threshold in one stroke alone, and at rest after it: a contact that halts it ends the stroke."""
        applies = self.signal.time >= self.strokes[number].applies
        if number + 1 < len(self.strokes):
            applies &= self.signal.time < self._moves_after(self.strokes[number + 1].applies)
        return self._evaluation(self.thresholds[0], number, applies)

    def _moves_after(self, applies: float) -> float:
        """Return when a joint moves again after `applies` [s], at most `grace` later."""
        speed = self.recording["speed"]
        moves = speed.derived("any joint moves", lambda: speed.time[evident_speed(speed).any(axis=1)])
        after = int(np.searchsorted(moves, applies, side="right"))
        return min(float(moves[after]) if after < len(moves) else np.inf, applies + self.grace)

    def _evaluation(self, threshold: Evaluable, number: int, applies: BoolArray) -> _Evaluation:
        """Evaluate a class in a stroke, without other motions before it, so that its filters start there."""
        stroke = self.strokes[number]
        after = self.strokes[number + 1].applies + self.grace if number + 1 < len(self.strokes) else np.inf
        whole = len(self.strokes) == 1
        rows = slice(0, len(self.signal.time)) if whole else self.signal.rows(stroke.start, after)
        recording = self.recording if whole else self.recording.section(stroke.start, after)
        part = self.signal.part(rows)
        applies = applies[rows]
        if not applies.all():
            elsewhere = part.valid & ~applies[:, np.newaxis]
            part = part.changed(status=np.where(elsewhere, np.uint8(Status.OTHER_SPEED), part.status))
        return _Evaluation(threshold, recording, part, rows, applies)

    def _merged(self, evaluated: Sequence[tuple[Signal, Band]]) -> tuple[Signal, Band]:
        """Merge several classes: the band that a sample exceeds least applies, so it is outside only if outside all."""
        evaluations = self._evaluations
        if len(evaluations) == 1 and evaluations[0].applies.all():
            return evaluated[0]
        signal, shape = self.signal, self.signal.values.shape
        recent = speed_is_recent(self.recording, self.classes, signal.time, self.grace)
        values, unit = np.array(signal.values, order="C"), signal.unit
        elsewhere = np.where(recent, np.uint8(Status.OTHER_SPEED), np.uint8(Status.GAP))[:, np.newaxis]
        status = np.ascontiguousarray(np.where(signal.valid, elsewhere, signal.status))
        lower, upper, least = (np.full(shape, start) for start in (np.nan, np.nan, np.inf))
        marks = np.zeros(shape, dtype=np.uint8)
        for part, (statistic, band) in zip(evaluations, evaluated, strict=True):
            own, unit = contiguous(statistic, band), statistic.unit
            merge_evaluation(*own, part.applies, part.rows.start, values, status, lower, upper, least, marks)
        # If each class monitors a different side, together they monitor none.
        status[marks == (OPEN_BELOW | OPEN_ABOVE | LIMITED)] = Status.NO_LIMIT
        return signal.changed(values=values, status=status, unit=unit), Band(lower, upper)


def judgement_of(
    recording: Recording,
    signal: Signal,
    thresholds: Sequence[FittedThreshold],
    cut: str = "whole",
    grace: float = GRACE,
) -> Judgement:
    """Return the judgement of a log, cut into strokes by `cut`; `grace` [s]: see `recordings.motion.applicable`."""
    seen = recording.without_ground_truth()
    strokes = strokes_so_far(seen, cut, classes_of(thresholds))
    return Judgement(seen, signal, tuple(thresholds), tuple(strokes), grace)


def classes_of(thresholds: Sequence[FittedThreshold]) -> tuple[MotionClass, ...]:
    """Return the classes of motion that thresholds were learned for; a threshold without one applies to any motion."""
    classes = (class_of(item) for item in thresholds)
    return tuple(item for item in classes if item is not None)


def class_of(threshold: FittedThreshold) -> MotionClass | None:
    """Return the class of motion that a threshold was learned for; None if it applies to any motion."""
    motion: MotionClass | None = getattr(threshold, "motion", None)
    return motion


@kernel(
    f"void({_MATRIX}, {_STATUS}, {_MATRIX}, {_MATRIX}, {_ROWS}, int64, "
    "float64[:,::1], uint8[:,::1], float64[:,::1], float64[:,::1], float64[:,::1], uint8[:,::1])",
)
def merge_evaluation(  # noqa: PLR0913  a kernel: one loop, arrays one by one
    own_values: FloatArray,
    own_status: StatusArray,
    own_lower: FloatArray,
    own_upper: FloatArray,
    applies: BoolArray,
    first: int,
    values: FloatArray,
    status: StatusArray,
    lower: FloatArray,
    upper: FloatArray,
    least: FloatArray,
    marks: StatusArray,
) -> None:
    """Take a class's statistic and limits where it is exceeded `least` so far; its own arrays begin at row `first`."""
    for j in range(own_values.shape[1]):
        for i in range(own_values.shape[0]):
            if not applies[i]:
                continue
            k = first + i
            if own_status[i, j] != Status.VALID:
                if status[k, j] == Status.OTHER_SPEED:
                    status[k, j] = own_status[i, j]
                continue
            value, low, high = own_values[i, j], own_lower[i, j], own_upper[i, j]
            above, below = value - high, low - value
            outside = above if above >= below or math.isnan(below) else below
            if outside < least[k, j] or status[k, j] != Status.VALID:
                values[k, j], lower[k, j], upper[k, j], least[k, j] = value, low, high, outside
                status[k, j] = Status.VALID
            if low == -math.inf:
                marks[k, j] |= OPEN_BELOW
            if high == math.inf:
                marks[k, j] |= OPEN_ABOVE
            if math.isfinite(low) or math.isfinite(high):
                marks[k, j] |= LIMITED
