"""Compare a detector's signal with thresholds over a whole log: statistic, band and activation.

With several classes of motion, the threshold that applies is selected sample by sample, from earlier samples only.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cdtool.detection import Band, Signal, Status
from cdtool.motion import MotionClass
from cdtool.motion.applicable import HOLD, judging_classes, speed_is_recent
from cdtool.motion.strokes import Stroke, strokes_so_far
from cdtool.recording import BoolArray, FloatArray, Recording
from cdtool.thresholds.base import FittedThreshold
from cdtool.thresholds.contract import checked_evaluation, checked_exceedance, checked_factor


@dataclass(frozen=True)
class _Share:
    """The rows of a log on which a threshold is evaluated, and those to which it applies, (rows,)."""

    threshold: FittedThreshold
    recording: Recording
    signal: Signal
    rows: slice
    judges: BoolArray


@dataclass(frozen=True)
class Judgement:
    """A signal with its thresholds over a whole log; `recording` has no ground truth.

    If several classes of motion apply, a sample is outside only if it is outside all of their bands. `strokes` are
    those of a log that is cut, as they were known while it ran.
    """

    recording: Recording
    signal: Signal
    thresholds: tuple[FittedThreshold, ...]
    strokes: tuple[Stroke, ...]
    hold: float = HOLD

    @property
    def classes(self) -> tuple[MotionClass, ...]:
        """Return the classes of motion that were learned."""
        return classes_of(self.thresholds)

    @cached_property
    def evaluated(self) -> tuple[Signal, Band]:
        """Return the statistic and its band; raises RecordingError if a threshold fails."""
        return self._with(lambda threshold: threshold)

    def narrower(self, share: float) -> Band:
        """Return the band at that share of the safety factor."""
        return self._with(lambda threshold: checked_factor(threshold, share * threshold.safety_factor))[1]

    @cached_property
    def met_at(self) -> FloatArray:
        """Return (n, J) the safety factor at which each sample's limit would be met; -inf without a limit."""
        met = np.full(self.signal.values.shape, np.inf)
        judged = np.zeros(met.shape, dtype=bool)
        for share in self._shares:
            statistic, exceeded = checked_exceedance(share.threshold, share.recording, share.signal)
            use = statistic.valid & share.judges[:, np.newaxis]
            met[share.rows] = np.where(use, np.minimum(met[share.rows], exceeded), met[share.rows])
            judged[share.rows] |= use
        return np.where(judged, met, -np.inf)

    @cached_property
    def _shares(self) -> tuple[_Share, ...]:
        if not self.classes:
            everywhere = np.ones(len(self.signal.time), dtype=bool)
            rows = slice(0, len(self.signal.time))
            return tuple(_Share(item, self.recording, self.signal, rows, everywhere) for item in self.thresholds[:1])
        judging = judging_classes(self.recording, self.classes, self.strokes, self.signal.time, self.hold)
        learned = [item for item in self.thresholds if class_of(item) is not None]
        return tuple(self._share(learned[item.motion], item.stroke, item.where) for item in judging)

    def _share(self, threshold: FittedThreshold, number: int, judges: BoolArray) -> _Share:
        """Evaluate a class in a stroke, without other motions before it, so that its filters start there."""
        stroke = self.strokes[number]
        after = self.strokes[number + 1].applies + self.hold if number + 1 < len(self.strokes) else np.inf
        whole = len(self.strokes) == 1
        rows = slice(0, len(self.signal.time)) if whole else self.signal.rows(stroke.start, after)
        recording = self.recording if whole else self.recording.section(stroke.start, after)
        part = self.signal.part(rows)
        elsewhere = ~judges[rows, np.newaxis] & part.valid
        status = np.where(elsewhere, Status.OTHER_SPEED, part.status).astype(np.uint8)
        return _Share(threshold, recording, replace(part, status=status), rows, judges[rows])

    def _with(self, changed: Callable[[FittedThreshold], FittedThreshold]) -> tuple[Signal, Band]:
        """Merge several classes: the band that a sample exceeds least applies, so it is outside only if outside all."""
        shares = self._shares
        if len(shares) == 1 and shares[0].judges.all():
            return checked_evaluation(changed(shares[0].threshold), shares[0].recording, shares[0].signal)
        shape = self.signal.values.shape
        values, unit = self.signal.values.copy(), self.signal.unit
        recent = speed_is_recent(self.recording, self.classes, self.signal.time, self.hold)[:, np.newaxis]
        unjudged = np.where(recent, Status.OTHER_SPEED, Status.GAP)
        status = np.where(self.signal.valid, unjudged, self.signal.status).astype(np.uint8)
        lower, upper, least = (np.full(shape, start) for start in (np.nan, np.nan, np.inf))
        open_below, open_above, limited = (np.zeros(shape, dtype=bool) for _ in range(3))
        for share in shares:
            statistic, band = checked_evaluation(changed(share.threshold), share.recording, share.signal)
            rows, judges, unit = share.rows, share.judges[:, np.newaxis], statistic.unit
            valid = statistic.valid & judges
            outside = np.where(valid, np.fmax(statistic.values - band.upper, band.lower - statistic.values), np.inf)
            taken = valid & ((outside < least[rows]) | (status[rows] != Status.VALID))
            unknown = judges & ~statistic.valid & (status[rows] == Status.OTHER_SPEED)
            sources = ((values, statistic.values), (lower, band.lower), (upper, band.upper), (least, outside))
            for target, source in sources:
                target[rows] = np.where(taken, source, target[rows])
            status[rows] = np.where(taken, Status.VALID, np.where(unknown, statistic.status, status[rows]))
            open_below[rows] |= valid & np.isneginf(band.lower)
            open_above[rows] |= valid & np.isposinf(band.upper)
            limited[rows] |= valid & (np.isfinite(band.lower) | np.isfinite(band.upper))
        # If each class monitors a different side, together they monitor none.
        status[open_below & open_above & limited] = Status.NO_LIMIT
        return replace(self.signal, values=values, status=status, unit=unit), Band(lower, upper)


def judged(
    recording: Recording,
    signal: Signal,
    thresholds: Sequence[FittedThreshold],
    cut: str = "whole",
    hold: float = HOLD,
) -> Judgement:
    """Return the judgement of a whole log that is cut into strokes by `cut`; `hold` [s]: see `motion.applicable`."""
    seen = recording.without_ground_truth()
    strokes = strokes_so_far(seen, cut, classes_of(thresholds))
    return Judgement(seen, signal, tuple(thresholds), tuple(strokes), hold)


def classes_of(thresholds: Sequence[FittedThreshold]) -> tuple[MotionClass, ...]:
    """Return the classes of motion that thresholds were learned for; a threshold without one applies to any motion."""
    classes = (class_of(item) for item in thresholds)
    return tuple(item for item in classes if item is not None)


def class_of(threshold: FittedThreshold) -> MotionClass | None:
    """Return the class of motion that a threshold was learned for; None if it applies to any motion."""
    motion: MotionClass | None = getattr(threshold, "motion", None)
    return motion
