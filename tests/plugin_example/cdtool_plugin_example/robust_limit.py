"""Robust limits: constant, and not moved by one odd run among those learned from."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from cdtool.detection import Signal
from cdtool.errors import SignatureError
from cdtool.recording import Recording
from cdtool.thresholds.limit import FittedLimit

# Median absolute deviation -> standard deviation, for normally distributed values.
_AS_DEVIATION = 1.4826


@dataclass(frozen=True)
class RobustLimit:
    """Constant limits: the median of the runs' extremes, `safety_factor` robust deviations further out.

    Fails where friction or gravity vary along the path, and with few runs: half of them give the spread.
    """

    safety_factor: float = 5.5

    name: ClassVar[str] = "robust_limit"
    needs: ClassVar[tuple[str, ...]] = ()
    fitted: ClassVar[tuple[type, ...]] = (FittedLimit,)

    def fit(self, pairs: Sequence[tuple[Recording, Signal]]) -> FittedLimit:
        """Limits from impact-free runs; raises SignatureError with fewer than three or without valid samples."""
        if len(pairs) < 3:
            raise SignatureError(f"a robust limit needs at least 3 impact-free runs, {len(pairs)} given", "add runs")
        for recording, signal in pairs:
            if not signal.valid.any(axis=0).all():
                raise SignatureError(f"{recording.name}: a joint has no valid sample ({signal.why_not()})")
        highest = np.array([np.max(signal.values, axis=0, initial=-np.inf, where=signal.valid) for _, signal in pairs])
        lowest = np.array([np.min(signal.values, axis=0, initial=np.inf, where=signal.valid) for _, signal in pairs])
        return FittedLimit(
            least=tuple(np.median(lowest, axis=0).tolist()),
            greatest=tuple(np.median(highest, axis=0).tolist()),
            spread_below=tuple(_deviation(lowest)),
            spread_above=tuple(_deviation(highest)),
            safety_factor=self.safety_factor,
        )


def _deviation(extremes: np.ndarray) -> list[float]:
    distance = np.abs(extremes - np.median(extremes, axis=0))
    return [float(value) for value in _AS_DEVIATION * np.median(distance, axis=0)]
