"""A value with its confidence interval: the result of most statistics of the evaluation."""

from __future__ import annotations

import math
from dataclasses import dataclass

from cdtool.base.errors import UsageError


@dataclass(frozen=True)
class Interval:
    """A value with its confidence interval, all in one unit.

    Parameters
    ----------
    value : float
        NaN if undefined, infinite if a quantile was not reached.
    low, high : float
        The bounds; NaN if there are too few values for an interval, infinite if the interval is open.
    level : float
        The confidence level requested.
    reason : str
        Why there is no interval.

    Examples
    --------
    >>> Interval(12.0, 10.5, 14.0).known, Interval(float("nan"), 0.0, 1.0).known
    (True, False)
    """

    value: float
    low: float
    high: float
    level: float = 0.95
    reason: str = ""

    @property
    def known(self) -> bool:
        """Whether there is a value; "not reached" (infinite) is one."""
        return not math.isnan(self.value)


def check_level(level: float) -> None:
    """Check a confidence level.

    Parameters
    ----------
    level : float
        The confidence level.

    Raises
    ------
    UsageError
        The level is not between 0 and 1.

    Examples
    --------
    >>> check_level(0.95)
    """
    if not 0.0 < level < 1.0:
        raise UsageError(f"confidence level is {level:g}", "give a share between 0 and 1, such as 0.95")
