"""Mean and spread of one quantity over time since motion start and along the travel, and how far runs go from it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from cdtool.detection import Signal, Status
from cdtool.motion.progress import Progress
from cdtool.recording import FloatArray
from cdtool.thresholds.signature_curve import Curve, resample

_SUCCESSION = 3


@dataclass(frozen=True)
class NormalCurves:
    """Statistics of one quantity (g, J): over time since motion start, and along the travel (None: over time alone).

    `farthest_by_time` and `farthest_by_travel` (J,): the largest distance from the mean that a run keeps to for 3
    samples, in spreads: over time while accelerating, and along the travel after it. Four of five runs stay within it.
    """

    by_time: Curve
    by_travel: Curve | None
    farthest_by_time: FloatArray
    farthest_by_travel: FloatArray

    def at(self, where: Progress, least: float) -> tuple[FloatArray, FloatArray]:
        """Mean and spread (n, J) at each place of a run; NaN where too few runs have been.

        No spread is below the share `least` of the joint's largest mean.
        """
        mean, spread = self._looked_up(where)
        largest = np.abs(self.by_time.mean).max(axis=0)
        if self.by_travel is not None:
            largest = np.maximum(largest, np.abs(self.by_travel.mean).max(axis=0))
        return mean, np.maximum(spread, least * largest)

    def _looked_up(self, where: Progress) -> tuple[FloatArray, FloatArray]:
        mean, spread = _looked_up(self.by_time, np.minimum(where.elapsed, self.by_time.end))
        if self.by_travel is None:
            beyond = (where.elapsed > self.by_time.end)[:, np.newaxis]
            return np.where(beyond, np.nan, mean), np.where(beyond, np.nan, spread)
        along = _looked_up(self.by_travel, where.travel)
        running = where.running[:, np.newaxis]
        return np.where(running, along[0], mean), np.where(running, along[1], spread)

    def updated(self, values: FloatArray, clock: FloatArray, where: Progress, cap: float, forget: float | None) -> Self:
        """With one more run (n, J), no further than `cap` spreads from the mean; see `Curve.updated`.

        How far runs go from the mean stays as first learned.
        """
        signal = signal_of(clock, values)

        def one(curve: Curve, axis: FloatArray) -> Curve:
            return curve.updated(curve.clipped(resample(signal, where, curve, axis), cap, pooled=True), forget)

        by_travel = one(self.by_travel, where.travel) if self.by_travel is not None else None
        return replace(self, by_time=one(self.by_time, where.elapsed), by_travel=by_travel)

    def distances(self, values: FloatArray, where: Progress) -> tuple[FloatArray, FloatArray]:
        """How far (J,) a run is from the mean at most for 3 samples [spreads]: while accelerating, and after it."""
        mean, spread = self._looked_up(where)
        with np.errstate(invalid="ignore", divide="ignore"):
            off = np.abs(values - mean) / spread
        off = np.where(np.isfinite(off), off, 0.0)
        kept = np.zeros_like(off)
        if len(off) >= _SUCCESSION:
            kept[_SUCCESSION - 1 :] = np.lib.stride_tricks.sliding_window_view(off, _SUCCESSION, axis=0).min(axis=-1)
        running = where.running if self.by_travel is not None else np.zeros(len(off), dtype=bool)
        parts = kept[~running], kept[running]
        by_time, along = (part.max(axis=0, initial=0.0) for part in parts)
        return by_time, along

    def reach(self, where: Progress) -> FloatArray:
        """(n, J): the largest distance [spreads] that impact-free runs kept to, at each place of a run."""
        running = where.running if self.by_travel is not None else np.zeros(len(where.running), dtype=bool)
        reach: FloatArray = np.where(running[:, np.newaxis], self.farthest_by_travel, self.farthest_by_time)
        return reach

    def to_dict(self) -> dict[str, Any]:
        """As JSON values."""
        along = self.by_travel.to_dict() if self.by_travel is not None else None
        return {
            "by_time": self.by_time.to_dict(),
            "by_travel": along,
            "farthest_by_time": self.farthest_by_time.tolist(),
            "farthest_by_travel": self.farthest_by_travel.tolist(),
        }

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """The inverse of `to_dict`."""
        along = values["by_travel"]
        by_time, by_travel = Curve.from_dict(values["by_time"]), None if along is None else Curve.from_dict(along)
        farthest = [np.array(values[name], dtype=np.float64) for name in ("farthest_by_time", "farthest_by_travel")]
        if any(item.shape != by_time.mean.shape[1:] or not np.isfinite(item).all() for item in farthest):
            raise ValueError("distances of other joints than the curves'")
        return cls(by_time, by_travel, *farthest)


def _looked_up(curve: Curve, axis: FloatArray) -> tuple[FloatArray, FloatArray]:
    mean, spread = curve.band(pooled=True)
    columns = range(mean.shape[1])
    means, spreads = (np.column_stack([curve.at(part[:, j], axis) for j in columns]) for part in (mean, spread))
    return means, spreads


def signal_of(clock: FloatArray, values: FloatArray) -> Signal:
    """Return values (n, J) as a signal whose missing ones are gaps."""
    status = np.where(np.isfinite(values), Status.VALID, Status.GAP).astype(np.uint8)
    return Signal(clock, values, status, "")
