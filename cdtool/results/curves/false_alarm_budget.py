"""A stated number of false alarms, and the safety factor that meets it on impact-free operations."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Literal

import numpy as np
import numpy.typing as npt

from cdtool.alarms.activation import Activation
from cdtool.alarms.pipeline import Detection
from cdtool.base.arrays import FloatArray
from cdtool.base.errors import UsageError
from cdtool.base.plain_text import counted, digits
from cdtool.results.curves.sweep import critical_factors, sweep

_FORM = re.compile(
    r"\s*([0-9.eE+-]+)\s*/\s*([0-9.eE+-]*)\s*(op|operation|operations|h|hour|hours)(?:\s+at\s+([0-9.]+)\s*%)?\s*"
)
# Where a count has to be looked for, factors are tried that many to an octave.
_STEPS = 32


@dataclass(frozen=True)
class Budget:
    """At most `rate` false alarms per operation or per hour: on average, or with a `confidence` such as 0.95.

    Examples
    --------
    >>> budget = Budget.parse("1/1000op")
    >>> budget.rate, budget.per, budget.needed
    (0.001, 'operation', 999.0)
    >>> Budget.parse("1/100op at 95%").needed
    299.0
    """

    rate: float
    per: Literal["operation", "hour"]
    confidence: float | None = None

    @classmethod
    def parse(cls, text: str) -> Budget:
        """Return the budget written as 1/1000op, 0.002/op, 1/8h, 0.1/h or 1/100op at 95%; raises UsageError."""
        found = _FORM.fullmatch(text)
        try:
            count, exposure = float(found[1]), float(found[2] or 1.0)  # type: ignore[index]
            confidence = float(found[4]) / 100.0 if found and found[4] else None
        except (TypeError, ValueError):
            count = exposure = math.nan
            confidence = None
        rate = count / exposure if exposure else math.nan
        if found is None or not (0.0 < count < math.inf and 0.0 < exposure < math.inf and 1e-12 < rate < 1e12):
            raise UsageError(f"false-alarm budget is '{text}'", "give 1/1000op (operations) or 0.1/h (hours)")
        if confidence is not None and not 0.5 <= confidence <= 0.9999:
            raise UsageError(f"false-alarm budget is '{text}'", "give a confidence from 50% to 99.99%, as 'at 95%'")
        if found[3].startswith("o") and rate > 1.0 and confidence is not None:
            raise UsageError(f"false-alarm budget is '{text}'", "with a confidence, give at most one per operation")
        return cls(count / exposure, "hour" if found[3].startswith("h") else "operation", confidence)

    def __str__(self) -> str:
        short = "op" if self.per == "operation" else "h"
        inverse = 1.0 / self.rate
        is_whole = self.rate < 1.0 and abs(inverse - round(inverse)) < 1e-9 * inverse
        rate = f"1/{digits(round(inverse))}{short}" if is_whole else f"{self.rate:.15g}/{short}"
        return rate if self.confidence is None else f"{rate} at {digits(100.0 * self.confidence)}%"

    @property
    def needed(self) -> float:
        """The smallest exposure on which it can be set: the limit is above everything seen in it.

        The probability of an alarm above the largest of n operations is 1/(n + 1) on average, and at most b with the
        confidence 1 - (1 - b)^n.
        """
        if self.per == "operation":
            if self.confidence is None or self.rate >= 1.0:
                return float(max(math.ceil(1.0 / self.rate - 1.0 - 1e-6), 1))
            return float(math.ceil(math.log1p(-self.confidence) / math.log1p(-self.rate) - 1e-9))
        return (1.0 if self.confidence is None else -math.log1p(-self.confidence)) / self.rate

    def allowed(self, exposure: float) -> int:
        """Return how many operations (alarms, by hours) of those that set the limit may be above it; -1: too few.

        With c - 1 of n operations above the limit, the probability of an alarm has the beta distribution of c and
        n + 1 - c, with the mean c / (n + 1). By hours, it is the gamma distribution of c.
        """
        if self.confidence is None:
            exchangeable = exposure + 1.0 if self.per == "operation" else exposure
            return math.floor(self.rate * exchangeable + 1e-9) - 1
        from scipy.stats import beta, gamma

        most = int(self.rate * exposure) + 1
        counts = np.arange(1, most + 1)
        if self.per == "operation":
            counts = counts[counts <= exposure]
            sure = beta.cdf(self.rate, counts, exposure + 1.0 - counts)
        else:
            sure = gamma.cdf(self.rate * exposure, counts)
        return int(np.count_nonzero(sure >= self.confidence - 1e-12)) - 1

    def excess(self, operations: tuple[int, int], hours: tuple[int, float] = (0, 0.0)) -> str:
        """Return by how much runs that did not set the factor exceed the budget, in words; empty if they do not.

        `operations`: how many alarm, and how many there are; `hours`: false alarms, and the hours they are from. The
        words state the chance of at least this excess at exactly the budget (binomial, by hours Poisson).
        """
        from scipy import stats

        count, of = operations if self.per == "operation" else hours
        allowed = self.rate * of
        if count <= allowed:
            return ""
        by_operation = self.per == "operation"
        p = float(stats.binom.sf(count - 1, of, self.rate) if by_operation else stats.poisson.sf(count - 1, allowed))
        chance = digits(100.0 * p, 2) if p >= 1e-3 else "below 0.1"
        what = f"{count} of {of} runs alarm" if by_operation else f"{counted(count, 'false alarm')} in {of:.3g} h"
        return f"{what} where {self} allows {digits(allowed, 2)} (chance {chance} %)"

    def check(self, exposure: float, detector: str) -> None:
        """Raise UsageError, with what is missing, if the exposure is too small to set the factor."""
        if exposure < self.needed * (1.0 - 1e-9):
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


@dataclass(frozen=True)
class MonitoredRun:
    """What an impact-free operation contributes to a limit: its `critical` factor, and the `seconds` monitored.

    An operation alarms below its critical factor; `alarms` returns their number for several factors.
    """

    critical: float
    seconds: float
    alarms: Callable[[FloatArray], npt.NDArray[np.int64]]

    @classmethod
    def of_each(cls, detection: Detection, activations: Sequence[Activation]) -> list[MonitoredRun]:
        """Return it for an operation and each of several activations; the threshold was not learned from it."""
        seconds, critical = detection.assessed_seconds, critical_factors(detection, activations)
        return [
            cls(factor, seconds, partial(_alarms, detection, activation))
            for factor, activation in zip(critical, activations, strict=True)
        ]


def _alarms(detection: Detection, activation: Activation, factors: FloatArray) -> npt.NDArray[np.int64]:
    return sweep(detection, (), activation, 0.0, factors).false_alarms


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
    With a confidence, fewer are allowed: see `Budget.allowed`.

    Examples
    --------
    `cdtool.learn_signature` sets a factor with `false_alarm_budget`.
    """
    judged = [item for item in detections if item.assessed_seconds > 0.0]
    return factor_for(budget, detector, [MonitoredRun.of_each(item, [activation])[0] for item in judged])


def factor_for(budget: Budget, detector: str, runs: Sequence[MonitoredRun]) -> Calibrated:
    """Return the smallest safety factor that meets the budget, from runs that were monitored.

    Parameters
    ----------
    budget : Budget
        False alarms per operation or hour.
    detector : str
        Name of the detector, for messages.
    runs : sequence of MonitoredRun
        Impact-free operations; those that were nowhere assessable do not count.

    Returns
    -------
    Calibrated
        The factor, and the number of alarms with it on these runs.

    Raises
    ------
    UsageError
        The exposure is smaller than `budget.needed`, with what is missing.

    Examples
    --------
    Of 19 runs, the largest critical factor sets a limit for one alarm in 20.

    >>> runs = [MonitoredRun(float(i), 60.0, lambda factors: np.zeros(len(factors), dtype=np.int64)) for i in range(19)]
    >>> made = factor_for(Budget.parse("1/20op"), "momentum", runs)
    >>> round(made.factor, 3), made.alarms
    (18.0, 0)
    """
    runs = [item for item in runs if item.seconds > 0.0]
    hours = sum(item.seconds for item in runs) / 3600.0
    exposure = float(len(runs)) if budget.per == "operation" else hours
    budget.check(exposure, detector)
    allowed = max(budget.allowed(exposure), 0)
    factor, alarms = (_by_operation if budget.per == "operation" else _by_count)(runs, allowed)
    return Calibrated(factor, len(runs), hours, alarms)


def _by_operation(runs: Sequence[MonitoredRun], allowed: int) -> tuple[float, int]:
    """Return the factor at which at most `allowed` operations alarm: the next one just does not."""
    critical = np.sort([item.critical for item in runs])[::-1]
    factor = _just_above(float(critical[min(allowed, len(critical) - 1)]))
    return factor, int(np.count_nonzero(critical > factor))


def _by_count(runs: Sequence[MonitoredRun], allowed: int) -> tuple[float, int]:
    """Return the smallest factor of a fine grid from which all alarms together are no more than allowed."""
    top = _just_above(max(item.critical for item in runs))
    factors = top * 2.0 ** (-np.arange(6 * _STEPS) / _STEPS)
    total = np.zeros(len(factors), dtype=np.int64)
    for item in runs:
        if item.critical > factors[-1]:
            total += item.alarms(factors)
    enough = np.flatnonzero(total > allowed)
    last = int(enough[0]) - 1 if len(enough) else len(factors) - 1
    return float(factors[last]), int(total[last])


def _just_above(factor: float) -> float:
    if factor == math.inf:
        raise UsageError("no safety factor meets the budget: the limits have no spread", "learn from more runs")
    # Below 0 no sample left even the middle of the band: any factor keeps the budget.
    return max(factor * (1.0 + 1e-9), 1e-3)
