"""A figure and the interval that goes with it: what every statistic of the evaluation gives back."""

from __future__ import annotations

import math
from dataclasses import dataclass

from cdtool.errors import UsageError


@dataclass(frozen=True)
class Interval:
    """A figure with its confidence interval, all in the unit of the figure.

    `value` is NaN where the figure is undefined, infinite where a quantile was not reached. A bound is NaN where there
    is too little data for an interval, infinite where it is open. `level` is the confidence that was asked for.
    `reason` says why there is no interval.
    """

    value: float
    low: float
    high: float
    level: float = 0.95
    reason: str = ""

    @property
    def known(self) -> bool:
        """Whether there is a figure at all; "not reached" (infinite) is one."""
        return not math.isnan(self.value)


def check_level(level: float) -> None:
    """Raise UsageError unless `level` is a confidence level between 0 and 1."""
    if not 0.0 < level < 1.0:
        raise UsageError(f"confidence level is {level:g}", "give a share between 0 and 1, such as 0.95")
