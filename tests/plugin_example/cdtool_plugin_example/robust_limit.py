"""Robust limits: constant limits that a single unusual run does not change much."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from cdtool.base.errors import SignatureError
from cdtool.detectors.detection import Signal
from cdtool.recordings.recording import Recording
from cdtool.thresholds.limit import FittedLimit

# Ratio of the standard deviation to the median absolute deviation of normally distributed values.
_AS_DEVIATION = 1.4826


@dataclass(frozen=True)
class RobustLimit:
    """Constant limits: the medians of the runs' extremes, extended by `safety_factor` robust standard deviations.

    Parameters
    ----------
    safety_factor : float
        Number of robust standard deviations from the median extremes to the limits.

    Notes
    -----
    upper = median(max i) + safety_factor s, and likewise lower, for each joint; s = 1.4826 times the median absolute
    deviation of the extremes, over runs. Fails if friction or gravity vary along the travel, and with few runs, as half
    of them determine s.

    Examples
    --------
    One of four runs with an unusual peak does not move the limit far.

    >>> from cdtool.recordings.recording import Recording
    >>> def pair(peak):
    ...     values = np.array([[-1.0], [peak]])
    ...     signal = Signal(np.array([0.0, 0.1]), values, np.zeros((2, 1), np.uint8), "N", signed=True)
    ...     return Recording("run", "", ("axis",), {}), signal
    >>> fitted = RobustLimit(safety_factor=5.0).fit([pair(9.0), pair(10.0), pair(11.0), pair(90.0)])
    >>> np.round(fitted.upper, 1).tolist()
    [17.9]
    """

    safety_factor: float = 5.5

    name: ClassVar[str] = "robust_limit"
    needs: ClassVar[tuple[str, ...]] = ()
    fitted: ClassVar[tuple[type, ...]] = (FittedLimit,)

    def fit(self, pairs: Sequence[tuple[Recording, Signal]]) -> FittedLimit:
        """Return limits from impact-free runs.

        Raises SignatureError with fewer than three runs, or if a joint has no valid sample.
        """
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
