"""Limits on how fast the signal changes (thesis 2.3.2)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

from cdtool.base.arrays import FloatArray
from cdtool.base.settings import Positive, check, setting
from cdtool.detectors.detection import Signal
from cdtool.detectors.filters import SETTLED
from cdtool.recordings.recording import Recording
from cdtool.thresholds.first_order import filtered_slope
from cdtool.thresholds.sections import filtered
from cdtool.thresholds.settings import SafetyFactor, SidesOfMachine
from cdtool.thresholds.statistic_limit import FittedStatisticLimit, fit_statistic_limit


@dataclass(frozen=True)
class Trend:
    """Constant limits on the trend of the signal, s / (1 + s `time_constant`) i.

    Raises
    ------
    UsageError
        A setting is unknown or outside its range.

    Notes
    -----
    Thesis 2.3.2: |di/dt| > limit, the derivative low-passed, in the signal's unit per s; exact for any step. Limits are
    learned as those of `Limit`. A gap above 3 time constants restarts the trend. Fails in soft impacts, in which the
    force rises slowly, and with a noisy signal such as pure torque.

    Examples
    --------
    >>> import numpy as np
    >>> time = np.arange(500) * 1e-3
    >>> ramp = Signal(time, 100.0 * time[:, np.newaxis], np.zeros((500, 1), dtype=np.uint8), "N")
    >>> trend = Trend(time_constant=0.02).statistic(ramp, 1e-3)
    >>> trend.values[-1, 0].round(3).item(), trend.unit
    (100.0, 'N/s')
    """

    safety_factor: SafetyFactor = 5.5
    sides: SidesOfMachine = None
    time_constant: Annotated[Positive, setting("of the low-pass of the derivative", unit="s")] = 0.02

    name: ClassVar[str] = "trend"
    needs: ClassVar[tuple[str, ...]] = ()
    fitted: ClassVar[tuple[type, ...]] = (FittedStatisticLimit,)
    searched: ClassVar[Mapping[str, tuple[float, ...]]] = {"time_constant": (0.005, 0.01, 0.02, 0.04)}

    def __post_init__(self) -> None:
        check(self)

    @property
    def by_class(self) -> bool:
        """True if one side is monitored: which side opposes the motion depends on its class."""
        return self.sides == "one"

    def fit(self, pairs: Sequence[tuple[Recording, Signal]]) -> FittedStatisticLimit:
        """Learn limits of the trend from at least 2 impact-free runs; see `Threshold.fit`."""
        return fit_statistic_limit(self, pairs)

    def statistic(self, signal: Signal, period: float) -> Signal:  # noqa: ARG002 - steps are measured
        """Return the trend, in the signal's unit per s."""
        return trend_of(signal, self.time_constant)


def trend_of(signal: Signal, time_constant: float) -> Signal:
    """Return the filtered trend of a signal, in its unit per s; its first 3 time constants are START_UP."""

    def slope(values: FloatArray, step: FloatArray) -> FloatArray:
        return filtered_slope(values, step, time_constant)

    return filtered(signal, slope, SETTLED * time_constant, SETTLED * time_constant, f"{signal.unit}/s")
