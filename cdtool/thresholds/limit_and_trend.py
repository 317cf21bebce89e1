"""Limits on the value that depend on its trend (thesis 2.3.2, figure 2.5)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np
from msgspec import Meta

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.base.errors import UsageError
from cdtool.base.settings import Positive, check, setting
from cdtool.detectors.detection import Band, Signal
from cdtool.recordings.motion import MotionClass
from cdtool.recordings.motion.speed_course import COVERAGE
from cdtool.recordings.recording import Recording
from cdtool.thresholds.base import with_limits
from cdtool.thresholds.common_class import common_class
from cdtool.thresholds.limit import FittedLimit, Limit
from cdtool.thresholds.settings import SafetyFactor, SidesOfMachine, on_side, watched_side
from cdtool.thresholds.statistic_limit import FittedStatisticLimit, fit_statistic_limit
from cdtool.thresholds.trend import trend_of

SHAPES = ("line", "table")


@dataclass(frozen=True)
class FittedTrendTable:
    """Limits on i at each level of its trend: `levels` (s, J) per s as shares of the runs' extremes, with s `limits`.

    Level 0 is any trend; at level m the upper limit applies to trends of at least `rising[m]`, the lower one to those
    of at most `falling[m]`. A trend above the highest level that most runs reach has the limit of that level.
    """

    rising: FloatArray
    falling: FloatArray
    limits: tuple[FittedLimit, ...]
    time_constant: float
    motion: MotionClass | None

    @property
    def safety_factor(self) -> float:
        """Number of standard deviations from the mean extreme of the runs to the limit."""
        return self.limits[0].safety_factor

    def with_safety_factor(self, factor: float) -> FittedTrendTable:
        """Return the threshold with its limits at `factor` standard deviations."""
        return replace(self, limits=tuple(item.with_safety_factor(factor) for item in self.limits))

    def evaluate(self, recording: Recording, signal: Signal) -> tuple[Signal, Band]:
        """Return the signal and the band of its trend; raises UsageError if the number of joints differs."""
        joints = signal.values.shape[1]
        if self.rising.shape[1] != joints:
            raise UsageError(
                f"{recording.name}: learned for {self.rising.shape[1]} joints, not for {joints}", "learn for these"
            )
        trend = trend_of(signal, self.time_constant)
        lower, upper = np.empty(signal.values.shape), np.empty(signal.values.shape)
        for level, limit in enumerate(self.limits):
            upper[:] = np.where(trend.values >= self.rising[level], limit.upper, upper) if level else limit.upper
            lower[:] = np.where(trend.values <= self.falling[level], limit.lower, lower) if level else limit.lower
        return with_limits(replace(signal, status=trend.status), lower, upper)

    def to_dict(self) -> dict[str, Any]:
        """Return the threshold as JSON values."""
        return {
            "rising": self.rising.tolist(),
            "falling": self.falling.tolist(),
            "limits": [item.to_dict() for item in self.limits],
            "time_constant": self.time_constant,
            "motion": self.motion.to_dict() if self.motion else None,
        }

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """Return the threshold that `to_dict` has written."""
        return cls(
            rising=np.array(values["rising"], dtype=np.float64),
            falling=np.array(values["falling"], dtype=np.float64),
            limits=tuple(FittedLimit.from_dict(item) for item in values["limits"]),
            time_constant=float(values["time_constant"]),
            motion=MotionClass.from_dict(values["motion"]) if values["motion"] else None,
        )


@dataclass(frozen=True)
class LimitAndTrend:
    """Limits on the value that depend on its trend: early for a fast rise, wide otherwise.

    Raises
    ------
    UsageError
        A setting is unknown or outside its range.

    Notes
    -----
    Thesis 2.3.2 and figure 2.5; the text has I_max = f(dI_max/dt) for I_max = f(di/dt) (docs/errata.md). In the
    signal's unit; limits are learned as those of `Limit`. A gap above 3 time constants restarts the trend. Fails if the
    normal signal rises as fast as a contact makes it rise, and with a noisy signal.

    Examples
    --------
    A ramp of 100 N/s, at 49.9 N, is 2 N higher 20 ms later.

    >>> import numpy as np
    >>> time = np.arange(500) * 1e-3
    >>> ramp = Signal(time, 100.0 * time[:, np.newaxis], np.zeros((500, 1), dtype=np.uint8), "N")
    >>> LimitAndTrend(lead=0.02).statistic(ramp, 1e-3).values[-1, 0].round(3).item()
    51.9
    """

    safety_factor: SafetyFactor = 5.5
    sides: SidesOfMachine = None
    shape: Annotated[
        Literal["line", "table"],
        setting(
            "line: i + `lead` di/dt, a straight line in the plane of value and trend; table: a limit on i for each of "
            "`steps` levels of the trend"
        ),
    ] = "line"
    lead: Annotated[Positive, setting("how far ahead the line extrapolates", unit="s")] = 0.02
    time_constant: Annotated[Positive, setting("of the low-pass of the trend", unit="s")] = 0.02
    steps: Annotated[
        Annotated[int, Meta(ge=2)],
        setting(
            "levels of the table; the limit at each is learned from the extremes of i where the trend is at least that"
        ),
    ] = 5

    name: ClassVar[str] = "limit_and_trend"
    needs: ClassVar[tuple[str, ...]] = ()
    fitted: ClassVar[tuple[type, ...]] = (FittedStatisticLimit, FittedTrendTable)
    searched: ClassVar[Mapping[str, tuple[float, ...]]] = {"time_constant": (0.005, 0.01, 0.02, 0.04)}

    def __post_init__(self) -> None:
        check(self)

    @property
    def by_class(self) -> bool:
        """True if one side is monitored: which side opposes the motion depends on its class."""
        return self.sides == "one"

    def fit(self, pairs: Sequence[tuple[Recording, Signal]]) -> FittedStatisticLimit | FittedTrendTable:
        """Learn limits of the line or the table from at least 2 impact-free runs; see `Threshold.fit`."""
        if self.shape == "line":
            return fit_statistic_limit(self, pairs)
        return _fit_trend_table(pairs, self.safety_factor, self.sides, self.time_constant, self.steps)

    def statistic(self, signal: Signal, period: float) -> Signal:  # noqa: ARG002 - steps are measured
        """Return i + lead di/dt, in the signal's unit."""
        trend = trend_of(signal, self.time_constant)
        return replace(trend, values=signal.values + self.lead * trend.values, unit=signal.unit)


def _fit_trend_table(
    pairs: Sequence[tuple[Recording, Signal]],
    safety_factor: float,
    sides: str | None,
    time_constant: float,
    steps: int,
) -> FittedTrendTable:
    """Return levels at equal shares of the runs' mean extreme trend, and limits of i at each; raises SignatureError."""
    trends = [trend_of(signal, time_constant) for _, signal in pairs]
    tops = Limit().fit([(recording, trend) for (recording, _), trend in zip(pairs, trends, strict=True)])
    shares = (np.arange(steps) / steps)[:, np.newaxis]
    rising = shares * np.maximum(tops.greatest, 0.0)
    falling = shares * np.minimum(tops.least, 0.0)
    signals = [replace(signal, status=trend.status) for (_, signal), trend in zip(pairs, trends, strict=True)]
    limits = [Limit(safety_factor).fit([(pair[0], signal) for pair, signal in zip(pairs, signals, strict=True)])]
    for level in range(1, steps):
        highest = [_highest(s, s.values, t.values >= rising[level]) for s, t in zip(signals, trends, strict=True)]
        lowest = [_highest(s, -s.values, t.values <= falling[level]) for s, t in zip(signals, trends, strict=True)]
        greatest, spread_above = _level(highest, limits[-1].greatest, limits[-1].spread_above)
        least, spread_below = _level(lowest, tuple(-x for x in limits[-1].least), limits[-1].spread_below)
        limits.append(FittedLimit(tuple(-x for x in least), greatest, spread_below, spread_above, safety_factor))
    motion = common_class([recording for recording, _ in pairs]) if sides == "one" else None
    side = watched_side(sides, motion, pairs[0][1].signed)
    return FittedTrendTable(rising, falling, tuple(on_side(item, side) for item in limits), time_constant, motion)


def _highest(signal: Signal, values: FloatArray, there: BoolArray) -> FloatArray:
    """Return the largest value (J,) of a run among the valid samples `there`; -inf without one."""
    highest: FloatArray = np.max(np.where(signal.valid & there, values, -np.inf), axis=0)
    return highest


def _level(runs: Sequence[FloatArray], before: Sequence[float], spread_before: Sequence[float]) -> tuple[Any, Any]:
    """Return mean and standard deviation of the runs' extremes per joint; of the level below if few runs reach it."""
    extremes = np.array(runs)
    mean, spread = list(before), list(spread_before)
    for j in range(extremes.shape[1]):
        reached = extremes[np.isfinite(extremes[:, j]), j]
        if len(reached) >= max(2.0, COVERAGE * len(extremes)):
            mean[j], spread[j] = float(np.mean(reached)), float(np.std(reached, ddof=1))
    return tuple(mean), tuple(spread)
