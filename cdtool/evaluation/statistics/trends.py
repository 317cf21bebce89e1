"""Does a figure drift from run to run, or does it step at one of them? Rank tests and robust slopes.

Conventions: values are in order of time, one a run, NaN where a run has none; runs count from 0. The tests take runs as
independent of one another: a figure that wanders (a temperature over the day, read every few minutes) looks like a
drift to them. All p are two-sided.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from cdtool.evaluation.statistics.interval import Interval
from cdtool.recording import FloatArray

# With fewer runs only the coarsest drift could be told from chance.
LEAST_RUNS = 10
# What is shown has at most this chance where nothing changes, all comparisons together.
SIGNIFICANT = 0.01


@dataclass(frozen=True)
class Trend:
    """A steady change: `slope` a run in the unit of the values, `intercept` at run 0, and p of Mann and Kendall."""

    slope: Interval
    intercept: float
    p: float

    def at(self, run: float) -> float:
        """The line's value at a run."""
        return self.intercept + self.slope.value * run


@dataclass(frozen=True)
class Step:
    """A change at once: the first run after it, the medians `before` and `after`, and p of Pettitt."""

    run: int
    before: float
    after: float
    p: float

    @property
    def height(self) -> float:
        """From before to after."""
        return self.after - self.before


@dataclass(frozen=True)
class Course:
    """What a figure did over `n` runs: "drift" or "step", whichever is shown and fits better, else "steady".

    `trend` and `step` are what was found, shown or not; None below `LEAST_RUNS` runs with a value.
    """

    kind: Literal["steady", "drift", "step"]
    n: int
    trend: Trend | None = None
    step: Step | None = None

    @property
    def change(self) -> float:
        """By how much the figure rose over the runs, as told by what is shown; 0 where it is steady."""
        if self.kind == "drift" and self.trend is not None:
            return self.trend.slope.value * (self.n - 1)
        return self.step.height if self.kind == "step" and self.step is not None else 0.0


def course_of(values: npt.ArrayLike, comparisons: int = 1, level: float = 0.95) -> Course:
    """Drift, step or neither of values (n,), where that many `comparisons` are made at once (Bonferroni's correction).

    Each comparison is two tests, so that something is shown where p of Mann and Kendall's or of Pettitt's test is at
    most 0.01 / (2 comparisons). A drift gives Pettitt's test a small p too, a step Mann and Kendall's: where both are
    shown, told is what leaves the smaller sum of absolute deviations, the line or the two medians.
    """
    given = np.asarray(values, dtype=np.float64)
    runs = np.flatnonzero(np.isfinite(given))
    present = given[runs]
    if len(runs) < LEAST_RUNS:
        return Course("steady", len(runs))
    trend, step = trend_of(present, runs, level), step_of(present, runs)
    allowed = SIGNIFICANT / (2 * comparisons)
    drifts, steps = trend.p <= allowed, step.p <= allowed
    if drifts and steps:
        line = trend.intercept + trend.slope.value * runs
        stairs = np.where(runs < step.run, step.before, step.after)
        drifts = float(np.abs(present - line).sum()) <= float(np.abs(present - stairs).sum())
    kind: Literal["steady", "drift", "step"] = "drift" if drifts else "step" if steps else "steady"
    return Course(kind, len(runs), trend, step)


def may_change(values: npt.ArrayLike, comparisons: int = 1) -> bool:
    """Whether `course_of` would show anything: its tests without slope and step, which take n^2 steps."""
    given = np.asarray(values, dtype=np.float64)
    runs = np.flatnonzero(np.isfinite(given))
    if len(runs) < LEAST_RUNS:
        return False
    present = given[runs]
    least = min(rank_p(present, runs), pettitt_p(present))
    return least <= SIGNIFICANT / (2 * comparisons)


def trend_of(values: FloatArray, runs: npt.NDArray[np.int_], level: float = 0.95) -> Trend:
    """Theil and Sen's slope (median of all pairs' slopes) with Sen's interval, and p of Mann and Kendall's test.

    The test is Kendall's rank correlation with the order of the runs: no slope of any shape is assumed. Equal values
    all along: slope 0, p 1.
    """
    if np.all(values == values[0]):
        return Trend(Interval(0.0, 0.0, 0.0, level), float(values[0]), 1.0)
    from scipy import stats

    found = stats.theilslopes(values, runs, alpha=level)
    slope = Interval(float(found.slope), float(found.low_slope), float(found.high_slope), level)
    return Trend(slope, float(np.median(values - slope.value * runs)), rank_p(values, runs))


def rank_p(values: FloatArray, runs: npt.NDArray[np.int_]) -> float:
    """Two-sided p of Kendall's rank correlation with the order of the runs; 1 for equal values."""
    from scipy import stats

    p = float(stats.kendalltau(runs, values).pvalue)
    return 1.0 if math.isnan(p) else p


def step_of(values: FloatArray, runs: npt.NDArray[np.int_]) -> Step:
    """The split into two medians that leaves the smallest sum of absolute deviations, with Pettitt's p."""
    sums = [_deviations(values[:first]) + _deviations(values[first:]) for first in range(1, len(values))]
    first = int(np.argmin(sums)) + 1
    before, after = float(np.median(values[:first])), float(np.median(values[first:]))
    return Step(int(runs[first]), before, after, pettitt_p(values))


def pettitt_p(values: FloatArray) -> float:
    """Pettitt's test (1979) of one step at an unknown run: K = max |U_t|, U_t = 2 (first t ranks) - t (n + 1).

    p = min(1, 2 exp(-6 K^2 / (n^3 + n^2))), on the safe side for few runs. The t of K is not where the step is: chance
    draws it towards the middle of the runs.
    """
    from scipy import stats

    n = len(values)
    lead = 2.0 * np.cumsum(stats.rankdata(values))[:-1] - np.arange(1, n) * (n + 1.0)
    largest = float(np.abs(lead).max())
    return min(1.0, 2.0 * math.exp(-6.0 * largest**2 / (n**3 + n**2)))


def _deviations(values: FloatArray) -> float:
    return float(np.abs(values - np.median(values)).sum())
