"""Page's cumulative sum of the innovations: the quickest test for a shift of known size."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.settings import NOT_A_KEY, Positive, check, setting
from cdtool.detectors.detection import Signal
from cdtool.recordings.recording import Recording
from cdtool.thresholds.sections import filtered, section_bounds
from cdtool.thresholds.sequential import FittedSequential, fit_sequential
from cdtool.thresholds.settings import Order, SafetyFactor, SidesOfMachine
from cdtool.thresholds.signature import Signature


@dataclass(frozen=True)
class Cusum:
    """Limits -+ `safety_factor` on the cumulative sum of the innovations beyond a drift.

    Raises
    ------
    UsageError
        A setting is unknown or outside its range.

    Notes
    -----
    Not in the thesis; Page, "Continuous inspection schemes", Biometrika 41, 1954. With nu the innovation of
    `Innovation`:

        g+_k = max(0, g+_{k-1} + nu_k - drift),   g-_k = max(0, g-_{k-1} - nu_k - drift)

    The statistic is g+, or -g- if that is larger; with one side monitored, only the sum of that side. The sum is kept
    over a gap of up to 0.15 s or 20 samples and restarts after a longer one. A constant shift F of the signal moves the
    innovations by (1 - sum a_i) F / (s(x) sd(nu)). Fails if the normal mean has moved (payload, temperature): the sum
    grows without limit; it clears slowly after an alarm.

    Examples
    --------
    >>> import numpy as np
    >>> values = np.array([0.0, 0.0, 3.0, 3.0, 3.0])[:, np.newaxis]
    >>> innovations = Signal(np.arange(5) * 1e-3, values, np.zeros((5, 1), dtype=np.uint8), "1")
    >>> Cusum(drift=1.0).statistic(innovations, side=1, longest_gap=0.15).values[:, 0].tolist()
    [0.0, 0.0, 2.0, 4.0, 6.0]
    """

    safety_factor: SafetyFactor = 15.0
    sides: SidesOfMachine = None
    order: Order = 4
    drift: Annotated[Positive, setting("what each sample takes off the sum, in standard deviations")] = 1.0
    signature: Annotated[Signature | None, NOT_A_KEY] = None

    name: ClassVar[str] = "cusum"
    needs: ClassVar[tuple[str, ...]] = ("speed", "position")
    fitted: ClassVar[tuple[type, ...]] = (FittedSequential,)
    by_class: ClassVar[bool] = True
    searched: ClassVar[Mapping[str, tuple[float, ...]]] = {"order": (4, 12), "drift": (0.25, 0.5, 1.0, 2.0)}

    def __post_init__(self) -> None:
        check(self)

    def fit(self, pairs: Sequence[tuple[Recording, Signal]]) -> FittedSequential:
        """Learn from impact-free runs of one class of motion; see `Threshold.fit`."""
        return fit_sequential(self, pairs)

    def statistic(self, innovations: Signal, side: int, longest_gap: float) -> Signal:
        """Return the sum of the monitored side, or the larger of both with its sign, in standard deviations."""

        def test(values: FloatArray, step: FloatArray) -> FloatArray:
            result = np.zeros(len(values))
            for first, last in section_bounds(step):
                above = _sum(values[first:last] - self.drift) if side >= 0 else np.zeros(last - first)
                below = _sum(-values[first:last] - self.drift) if side <= 0 else np.zeros(last - first)
                result[first:last] = np.where(above >= below, above, -below)
            return result

        return filtered(innovations, test, longest_gap, 0.0, "1")


def _sum(values: FloatArray) -> FloatArray:
    """Return max(0, g + values) sample by sample, from g = 0: the sum minus its lowest value so far."""
    total = np.cumsum(values)
    result: FloatArray = total - np.minimum.accumulate(np.minimum(total, 0.0))
    return result
