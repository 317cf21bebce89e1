"""Generalised likelihood ratio of the innovations: a test for a shift of unknown size and time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import FieldsError
from cdtool.base.settings import NOT_A_KEY, Count, check, setting
from cdtool.detectors.detection import Signal
from cdtool.recordings.recording import Recording
from cdtool.thresholds.sections import filtered, section_bounds
from cdtool.thresholds.sequential import FittedSequential, fit_sequential
from cdtool.thresholds.settings import Order, SafetyFactor, SidesOfMachine
from cdtool.thresholds.signature import Signature

#: A shift in octaves of samples: each finds shifts that grew in about so many.
_WINDOWS = (4, 8, 16, 32, 64, 128)


@dataclass(frozen=True)
class Glr:
    """Limits -+ `safety_factor` on the window-limited likelihood ratio for a shift of the innovations.

    Raises
    ------
    UsageError
        A setting is unknown or outside its range.

    Notes
    -----
    Not in the thesis; Willsky and Jones, IEEE Trans. Automatic Control 21, 1976. With nu the innovation of
    `Innovation`:

        Z = sum of the last L innovations / sqrt(L)

    The statistic is the largest Z in size over the windows, or the largest on the monitored side; Z^2 / 2 is the
    log-likelihood ratio of a shift of the mean that began L samples ago. A window extends over a gap of up to 0.15 s or
    20 samples, and never over a longer one. Fails if the normal mean has moved (payload, temperature), and with a shift
    slower than the longest window.

    Examples
    --------
    >>> import numpy as np
    >>> values = np.array([0.0, 0.0, 2.0, 2.0, 2.0, 2.0])[:, np.newaxis]
    >>> innovations = Signal(np.arange(6) * 1e-3, values, np.zeros((6, 1), dtype=np.uint8), "1")
    >>> Glr(windows=(1, 4)).statistic(innovations, side=1, longest_gap=0.15).values[:, 0].tolist()
    [0.0, 0.0, 2.0, 2.0, 3.0, 4.0]
    """

    safety_factor: SafetyFactor = 9.0
    sides: SidesOfMachine = None
    order: Order = 4
    windows: Annotated[tuple[Count, ...], setting("numbers of last samples in which a shift is sought")] = _WINDOWS
    signature: Annotated[Signature | None, NOT_A_KEY] = None

    name: ClassVar[str] = "glr"
    needs: ClassVar[tuple[str, ...]] = ("speed", "position")
    fitted: ClassVar[tuple[type, ...]] = (FittedSequential,)
    by_class: ClassVar[bool] = True
    searched: ClassVar[Mapping[str, tuple[int, ...]]] = {"order": (4, 12)}

    def __post_init__(self) -> None:
        check(self)
        if not self.windows:
            raise FieldsError(("windows",), "are empty", "give numbers of samples, each at least 1")

    def fit(self, pairs: Sequence[tuple[Recording, Signal]]) -> FittedSequential:
        """Learn from impact-free runs of one class of motion; see `Threshold.fit`."""
        return fit_sequential(self, pairs)

    def statistic(self, innovations: Signal, side: int, longest_gap: float) -> Signal:
        """Return Z of the window with the strongest evidence, in standard deviations; 0 until a window is full."""

        def test(values: FloatArray, step: FloatArray) -> FloatArray:
            result = np.zeros(len(values))
            for first, last in section_bounds(step):
                result[first:last] = self._largest(values[first:last], side)
            return result

        return filtered(innovations, test, longest_gap, 0.0, "1")

    def _largest(self, values: FloatArray, side: int) -> FloatArray:
        total = np.concatenate(([0.0], np.cumsum(values)))
        best = np.zeros(len(values))
        for window in self.windows:
            if window > len(values):
                continue
            score = (total[window:] - total[:-window]) / np.sqrt(window)
            size = score * side if side else np.abs(score)
            behind = best[window - 1 :]
            larger = size > (behind * side if side else np.abs(behind))
            best[window - 1 :] = np.where(larger, score, behind)
        return best
