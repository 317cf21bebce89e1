"""Absolute limits, one a joint: the plainest threshold (thesis 2.3.1)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np

from cdtool.detection import Band, Signal
from cdtool.errors import NothingValidError, SignatureError, UsageError
from cdtool.recording import Recording
from cdtool.thresholds.base import with_limits


@dataclass(frozen=True)
class FittedLimit:
    """lower < i < upper, the same at every sample; one value for all joints or one a joint, infinite = no limit."""

    lower: tuple[float, ...]
    upper: tuple[float, ...]

    def evaluate(self, recording: Recording, signal: Signal) -> tuple[Signal, Band]:
        """The signal and its constant band; raises UsageError where the number of joints differs."""
        joints = signal.values.shape[1]
        if len(self.lower) not in (1, joints):
            raise UsageError(
                f"{recording.name}: {len(self.lower)} limits for {joints} joints",
                "give one limit, or one a joint",
            )
        shape = signal.values.shape
        return with_limits(signal, np.broadcast_to(self.lower, shape), np.broadcast_to(self.upper, shape))

    def to_dict(self) -> dict[str, Any]:
        """As JSON values; an absent limit is null."""
        return {side: [None if np.isinf(x) else x for x in getattr(self, side)] for side in ("lower", "upper")}

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """The inverse of `to_dict`."""
        lower = tuple(-np.inf if x is None else float(x) for x in values["lower"])
        return cls(lower, tuple(np.inf if x is None else float(x) for x in values["upper"]))


@dataclass(frozen=True)
class Limit:
    """Constant limits: the mean of the runs' extremes, `safety_factor` of their standard deviations further out.

    Fails where friction or gravity vary along the path, where a sensor drifts, or where the speed changes.
    """

    safety_factor: float = 5.5

    name: ClassVar[str] = "limit"
    needs: ClassVar[tuple[str, ...]] = ()

    def fit(self, pairs: Sequence[tuple[Recording, Signal]]) -> FittedLimit:
        """Limits from impact-free runs; raises SignatureError with fewer than two runs or without valid samples."""
        if len(pairs) < 2:
            raise SignatureError(f"a limit needs at least 2 impact-free runs, {len(pairs)} given", "add runs")
        highest, lowest = [], []
        for recording, signal in pairs:
            if not signal.valid.any(axis=0).all():
                kind = SignatureError if signal.valid.any() else NothingValidError
                raise kind(f"{recording.name}: a joint has no valid sample ({signal.why_not()})", "leave the run out")
            highest.append(np.max(np.where(signal.valid, signal.values, -np.inf), axis=0))
            lowest.append(np.min(np.where(signal.valid, signal.values, np.inf), axis=0))
        upper = np.mean(highest, axis=0) + self.safety_factor * np.std(highest, axis=0, ddof=1)
        lower = np.mean(lowest, axis=0) - self.safety_factor * np.std(lowest, axis=0, ddof=1)
        return FittedLimit(tuple(map(float, lower)), tuple(map(float, upper)))

    @staticmethod
    def given(limits: Sequence[float]) -> FittedLimit:
        """Hand-set limits |i| < limit: one for all joints or one a joint (infinite: that joint is not watched)."""
        values = tuple(limits)
        if not all(value > 0.0 for value in values):
            raise UsageError(f"limits are {list(values)}", "numbers above 0 are needed (inf: not watched)")
        return FittedLimit(tuple(-value for value in values), values)
