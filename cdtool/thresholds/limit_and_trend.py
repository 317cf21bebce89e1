"""Limits on the value that depend on its trend (thesis 2.3.2, figure 2.5)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

from cdtool.detection import Signal
from cdtool.recording import Recording
from cdtool.thresholds.fitted_signature import known
from cdtool.thresholds.settings import check_above, check_sides
from cdtool.thresholds.statistic_limit import FittedStatisticLimit, fit_statistic_limit
from cdtool.thresholds.trend import trend_of
from cdtool.thresholds.trend_table import FittedTrendTable, fit_trend_table

SHAPES = ("line", "table")


@dataclass(frozen=True)
class LimitAndTrend:
    """Limits on the value that its trend moves: early for what rises fast, wide for what does not (figure 2.5).

    `shape` "line": statistic = i + `lead` di/dt, a straight line in the plane of value and trend: it sees the value
    `lead` [s] ahead. "table": I_max = f(di/dt), a limit on i for each of `steps` levels of the trend: the runs' extreme
    of i where the trend is at or above that level. The trend is filtered with `time_constant` [s]; limits as those of
    `limit`, in the signal's unit. A gap above 3 time constants restarts the trend. Fails where the normal signal
    rises as fast as a contact makes it rise, and with a noisy signal.
    """

    safety_factor: float = 5.5
    sides: str | None = None
    shape: str = "line"
    lead: float = 0.02
    time_constant: float = 0.02
    steps: int = 5

    name: ClassVar[str] = "limit_and_trend"
    needs: ClassVar[tuple[str, ...]] = ()
    fitted: ClassVar[tuple[type, ...]] = (FittedStatisticLimit, FittedTrendTable)

    def __post_init__(self) -> None:
        check_sides(self.safety_factor, self.sides)
        known("shape", self.shape, SHAPES)
        check_above(self.lead, 0.0, "lead")
        check_above(self.time_constant, 0.0, "time_constant")
        check_above(self.steps, 1, "steps")

    @property
    def by_class(self) -> bool:
        """Which side opposes the motion depends on its class."""
        return self.sides == "one"

    def fit(self, pairs: Sequence[tuple[Recording, Signal]]) -> FittedStatisticLimit | FittedTrendTable:
        """Limits of the line or the table; raises SignatureError with fewer than two runs or without valid samples."""
        if self.shape == "line":
            return fit_statistic_limit(self, pairs)
        return fit_trend_table(pairs, self.safety_factor, self.sides, self.time_constant, self.steps)

    def statistic(self, signal: Signal, period: float) -> Signal:  # noqa: ARG002 - steps are measured
        """i + lead di/dt, in the signal's unit."""
        trend = trend_of(signal, self.time_constant)
        return replace(trend, values=signal.values + self.lead * trend.values, unit=signal.unit)
