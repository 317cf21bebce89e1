"""A stated number of false alarms, and the safety factor that meets it on impact-free operations."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from cdtool.activation import Activation
from cdtool.errors import UsageError
from cdtool.evaluation.sweep import critical_factor, sweep
from cdtool.pipeline import Detection
from cdtool.plain_text import counted, digits

_FORM = re.compile(r"\s*([0-9.eE+-]+)\s*/\s*([0-9.eE+-]*)\s*(op|operation|operations|h|hour|hours)\s*")
# Where a count has to be looked for, factors are tried that many to an octave.
_STEPS = 32


@dataclass(frozen=True)
class Budget:
    """At most `rate` false alarms per operation or per hour.

    Examples
    --------
    >>> budget = Budget.parse("1/1000op")
    >>> budget.rate, budget.per, budget.needed
    (0.001, 'operation', 1000.0)
    """

    rate: float
    per: Literal["operation", "hour"]

    @classmethod
    def parse(cls, text: str) -> Budget:
        """Return the budget written as 1/1000op, 0.002/op, 1/8h or 0.1/h; raises UsageError."""
        found = _FORM.fullmatch(text)
        try:
            count, exposure = float(found[1]), float(found[2] or 1.0)  # type: ignore[index]
        except (TypeError, ValueError):
            count = exposure = math.nan
        rate = count / exposure if exposure else math.nan
        if found is None or not (0.0 < count < math.inf and 0.0 < exposure < math.inf and 1e-12 < rate < 1e12):
            raise UsageError(f"false-alarm budget is '{text}'", "give 1/1000op (operations) or 0.1/h (hours)")
        return cls(count / exposure, "hour" if found[3].startswith("h") else "operation")

    def __str__(self) -> str:
        short = "op" if self.per == "operation" else "h"
        return f"1/{digits(1.0 / self.rate)}{short}" if self.rate < 1.0 else f"{digits(self.rate)}/{short}"

    @property
    def needed(self) -> float:
        """The smallest exposure on which it can be set: one false alarm must be allowed in it."""
        return 1.0 / self.rate

    def check(self, exposure: float, detector: str) -> None:
        """Raise UsageError, with what is missing, if the exposure is too small to set the factor."""
        if exposure * self.rate < 1.0 - 1e-9:
            raise UsageError(
                f"{detector}: false-alarm budget {self} needs {counted(self.needed, f'impact-free {self.per}')} "
                f"to be set, {digits(exposure, 4)} were assessable",
                f"add {digits(self.needed - exposure, 4)} to the runs learned from, or choose a larger budget",
            )


@dataclass(frozen=True)
class Calibrated:
    """The safety factor that meets a budget, and the number of alarms on the operations used to set it."""

    factor: float
    operations: int
    hours: float
    alarms: int


def set_factor(budget: Budget, detector: str, detections: Sequence[Detection], activation: Activation) -> Calibrated:
    """Return the smallest safety factor that is expected to meet the budget, from impact-free operations.

    Parameters
    ----------
    budget : Budget
        False alarms per operation or hour.
    detector : str
        Name of the detector, for messages.
    detections : sequence of Detection
        Impact-free operations; each one's threshold must not have been learned from it. An operation that was nowhere
        assessable does not count.
    activation : Activation
        What raises an alarm.

    Returns
    -------
    Calibrated
        The factor, and the number of alarms with it on these operations.

    Raises
    ------
    UsageError
        The exposure is smaller than `budget.needed`, with what is missing.

    Notes
    -----
    Just above the c-th largest of n operations' critical factors the probability of an alarm is c / (n + 1) on average,
    so c - 1 alarms are allowed in them, c = floor(budget (n + 1)); by hours likewise, one fewer than the budget allows.

    Examples
    --------
    `cdtool.learn_signature` sets a factor with `false_alarm_budget`.
    """
    judged = [item for item in detections if item.assessed_seconds > 0.0]
    hours = sum(item.assessed_seconds for item in judged) / 3600.0
    exposure = float(len(judged)) if budget.per == "operation" else hours
    budget.check(exposure, detector)
    exchangeable = exposure + 1.0 if budget.per == "operation" else exposure
    allowed = math.floor(budget.rate * exchangeable + 1e-9) - 1
    if budget.per == "operation":
        factor, alarms = _by_operation(judged, activation, allowed)
    else:
        factor, alarms = _by_count(judged, activation, allowed)
    return Calibrated(factor, len(judged), hours, alarms)


def _by_operation(detections: Sequence[Detection], activation: Activation, allowed: int) -> tuple[float, int]:
    """Return the factor at which at most `allowed` operations alarm: the next one just does not."""
    critical = np.sort([critical_factor(item, activation) for item in detections])[::-1]
    factor = _just_above(float(critical[min(allowed, len(critical) - 1)]))
    return factor, int(np.count_nonzero(critical > factor))


def _by_count(detections: Sequence[Detection], activation: Activation, allowed: int) -> tuple[float, int]:
    """Return the smallest factor of a fine grid from which all alarms together are no more than allowed."""
    critical = [critical_factor(item, activation) for item in detections]
    top = _just_above(max(critical))
    factors = top * 2.0 ** (-np.arange(6 * _STEPS) / _STEPS)
    total = np.zeros(len(factors), dtype=np.int64)
    for item, highest in zip(detections, critical, strict=True):
        if highest > factors[-1]:
            total += sweep(item, (), activation, 0.0, factors).false_alarms
    enough = np.flatnonzero(total > allowed)
    last = int(enough[0]) - 1 if len(enough) else len(factors) - 1
    return float(factors[last]), int(total[last])


def _just_above(factor: float) -> float:
    if factor == math.inf:
        raise UsageError("no safety factor meets the budget: the limits have no spread", "learn from more runs")
    # Below 0 no sample left even the middle of the band: any factor keeps the budget.
    return max(factor * (1.0 + 1e-9), 1e-3)
