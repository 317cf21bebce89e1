"""Limits on how fast the signal changes (thesis 2.3.2)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from cdtool.detection import Signal
from cdtool.recording import FloatArray, Recording
from cdtool.thresholds.first_order import filtered_slope
from cdtool.thresholds.sections import filtered
from cdtool.thresholds.settings import check_above, check_sides
from cdtool.thresholds.statistic_limit import FittedStatisticLimit, fit_statistic_limit

# Time constants until a first-order filter has settled to 5 %.
SETTLE = 3.0


@dataclass(frozen=True)
class Trend:
    """Constant limits on the signal's filtered trend, s / (1 + s `time_constant`) i (thesis 2.3.2).

    In the signal's unit per s; time constant in s, 0.01 to 0.03 is usual; exact for any step. Limits as those of
    `limit`, learned on the trend. A gap above 3 time constants restarts it. Fails against a soft impact, whose
    force rises slowly, and with a noisy signal such as pure torque.
    """

    safety_factor: float = 5.5
    sides: str | None = None
    time_constant: float = 0.02

    name: ClassVar[str] = "trend"
    needs: ClassVar[tuple[str, ...]] = ()
    fitted: ClassVar[tuple[type, ...]] = (FittedStatisticLimit,)

    def __post_init__(self) -> None:
        check_sides(self.safety_factor, self.sides)
        check_above(self.time_constant, 0.0, "time_constant")

    @property
    def by_class(self) -> bool:
        """Which side opposes the motion depends on its class."""
        return self.sides == "one"

    def fit(self, pairs: Sequence[tuple[Recording, Signal]]) -> FittedStatisticLimit:
        """Limits of the trend; raises SignatureError with fewer than two runs or without valid samples."""
        return fit_statistic_limit(self, pairs)

    def statistic(self, signal: Signal, period: float) -> Signal:  # noqa: ARG002 - steps are measured
        """The trend, in the signal's unit per s."""
        return trend_of(signal, self.time_constant)


def trend_of(signal: Signal, time_constant: float) -> Signal:
    """The filtered trend of a signal, per s; its first 3 time constants are START_UP."""

    def slope(values: FloatArray, step: FloatArray) -> FloatArray:
        return filtered_slope(values, step, time_constant)

    return filtered(signal, slope, SETTLE * time_constant, SETTLE * time_constant, f"{signal.unit}/s")
