"""Constant limits on a statistic that a causal filter derives from the signal, learned like `limit`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol, Self

import numpy as np

from cdtool.base.errors import SignatureError
from cdtool.detectors.detection import Band, Signal
from cdtool.recordings.motion import MotionClass
from cdtool.recordings.recording import Recording
from cdtool.thresholds.base import Threshold
from cdtool.thresholds.common_class import common_class
from cdtool.thresholds.limit import FittedLimit, Limit
from cdtool.thresholds.settings import on_side, watched_side
from cdtool.thresholds.stored import rule_from_dict, rule_to_dict


class StatisticRule(Threshold, Protocol):
    """A threshold that derives a statistic from a signal."""

    @property
    def safety_factor(self) -> float:
        """Number of standard deviations from the mean extreme of the runs to the limit."""
        ...

    @property
    def sides(self) -> str | None:
        """One or two; None, not filled in by `with_context`, is two."""
        ...

    def statistic(self, signal: Signal, period: float) -> Signal:
        """Return the statistic, causal; `period` is the sample period of the runs learned from [s]."""
        ...


@dataclass(frozen=True)
class FittedStatisticLimit:
    """A rule's statistic and its constant limits; `motion`: the class it was learned for, None: any.

    `period` [s] is the sample period of the runs.
    """

    rule: StatisticRule
    limit: FittedLimit
    period: float
    motion: MotionClass | None

    @property
    def safety_factor(self) -> float:
        """Number of standard deviations from the mean extreme of the runs to the limit."""
        return self.limit.safety_factor

    def with_safety_factor(self, factor: float) -> FittedStatisticLimit:
        """Return the threshold with its limits at `factor` standard deviations."""
        return replace(self, limit=self.limit.with_safety_factor(factor))

    def evaluate(self, recording: Recording, signal: Signal) -> tuple[Signal, Band]:
        """Return the statistic and its band; raises UsageError if the number of joints differs."""
        return self.limit.evaluate(recording, self.rule.statistic(signal, self.period))

    def band_of(self, recording: Recording, statistic: Signal) -> Band:
        """Return the band of a statistic that was evaluated before."""
        return self.limit.evaluate(recording, statistic)[1]

    def to_dict(self) -> dict[str, Any]:
        """Return the threshold as JSON values."""
        return {
            **rule_to_dict(self.rule),
            "limit": self.limit.to_dict(),
            "period": self.period,
            "motion": self.motion.to_dict() if self.motion else None,
        }

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """Return the threshold that `to_dict` has written."""
        return cls(
            rule=rule_from_dict(values),
            limit=FittedLimit.from_dict(values["limit"]),
            period=float(values["period"]),
            motion=MotionClass.from_dict(values["motion"]) if values["motion"] else None,
        )


def fit_statistic_limit(rule: StatisticRule, pairs: Sequence[tuple[Recording, Signal]]) -> FittedStatisticLimit:
    """Learn limits from the mean extremes of the statistic over the runs and their standard deviation.

    A rule that monitors one side belongs to a class of motion: its runs must be of one. Raises SignatureError as
    `Limit`.
    """
    period = common_period(pairs)
    limit = Limit(rule.safety_factor).fit([(recording, rule.statistic(signal, period)) for recording, signal in pairs])
    motion = common_class([recording for recording, _ in pairs]) if rule.sides == "one" else None
    side = watched_side(rule.sides, motion, pairs[0][1].signed)
    return FittedStatisticLimit(rule, on_side(limit, side), period, motion)


def common_period(pairs: Sequence[tuple[Recording, Signal]]) -> float:
    """Return the median of the runs' sample periods [s]; raises SignatureError if no run has two samples."""
    periods = [signal.period for _, signal in pairs if signal.period > 0.0]
    if not periods:
        raise SignatureError("no run has two samples", "add runs")
    return float(np.median(periods))
