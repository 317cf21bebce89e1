"""Does a value drift from run to run, or does it step at one of them? Rank tests and robust slopes.

Conventions: values are in order of time, one per run, NaN where a run has none; runs count from 0. The tests treat runs
as independent of one another: a value that wanders (a temperature over the day, read every few minutes) looks like a
drift to them. All p are two-sided.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from cdtool.base.arrays import FloatArray
from cdtool.statistics.interval import Interval

# With fewer runs only a very large drift could be distinguished from chance.
LEAST_RUNS = 10
# Largest probability that any of all comparisons shows a change if nothing changes.
SIGNIFICANT = 0.01


@dataclass(frozen=True)
class LinearTrend:
    """A steady change: `slope` per run in the unit of the values, `intercept` at run 0, and p of Mann and Kendall."""

    slope: Interval
    intercept: float
    p: float

    def at(self, run: float) -> float:
        """Return the value of the line at a run."""
        return self.intercept + self.slope.value * run


@dataclass(frozen=True)
class Step:
    """A sudden change: the first run after it, the medians `before` and `after`, and p of Pettitt."""

    run: int
    before: float
    after: float
    p: float

    @property
    def height(self) -> float:
        """Return the change from before to after."""
        return self.after - self.before


@dataclass(frozen=True)
class ChangeOverRuns:
    """How a value changed over `n` runs: "drift" or "step", whichever is shown and fits better, otherwise "steady".

    `span`: from the first to the last run with a value. `trend` and `step` are the estimates, shown or not; None below
    `LEAST_RUNS` runs with a value.
    """

    kind: Literal["steady", "drift", "step"]
    n: int
    span: int = 0
    trend: LinearTrend | None = None
    step: Step | None = None

    @property
    def change(self) -> float:
        """Return the increase of the value over the runs by the trend or step that is shown; 0 if it is steady."""
        if self.kind == "drift" and self.trend is not None:
            return self.trend.slope.value * self.span
        return self.step.height if self.kind == "step" and self.step is not None else 0.0


def change_over_runs(values: npt.ArrayLike, comparisons: int = 1, level: float = 0.95) -> ChangeOverRuns:
    """Decide between drift, step and neither.

    Parameters
    ----------
    values : array_like of float, shape (n,)
        One value per run, in order of time; NaN if a run has none.
    comparisons : int
        Number of comparisons made together (Bonferroni's correction).
    level : float
        Confidence level of the slope's interval.

    Returns
    -------
    ChangeOverRuns
        "steady", "drift" or "step", with the estimates.

    Notes
    -----
    Each comparison is two tests: a change is shown if p of Mann and Kendall's or of Pettitt's test is at most 0.01 / (2
    comparisons). A drift makes p of Pettitt's test small too, and a step that of Mann and Kendall's: if both are shown,
    the model with the smaller sum of absolute deviations is chosen, the line or the two medians.

    Examples
    --------
    >>> import numpy as np
    >>> runs, noise = np.arange(40), np.tile([0.0, 0.1], 20)
    >>> [change_over_runs(values).kind for values in (noise, noise + runs, noise + 5.0 * (runs >= 20))]
    ['steady', 'drift', 'step']
    """
    given = np.asarray(values, dtype=np.float64)
    runs = np.flatnonzero(np.isfinite(given))
    present = given[runs]
    if len(runs) < LEAST_RUNS:
        return ChangeOverRuns("steady", len(runs))
    trend, step = linear_trend(present, runs, level), step_of(present, runs)
    allowed = SIGNIFICANT / (2 * comparisons)
    drifts, steps = trend.p <= allowed, step.p <= allowed
    if drifts and steps:
        line = trend.intercept + trend.slope.value * runs
        stairs = np.where(runs < step.run, step.before, step.after)
        drifts = float(np.abs(present - line).sum()) <= float(np.abs(present - stairs).sum())
    kind: Literal["steady", "drift", "step"] = "drift" if drifts else "step" if steps else "steady"
    return ChangeOverRuns(kind, len(runs), int(runs[-1] - runs[0]), trend, step)


def may_change(values: npt.ArrayLike, comparisons: int = 1) -> bool:
    """Return whether `change_over_runs` would show a change.

    Parameters
    ----------
    values : array_like of float, shape (n,)
        One value per run, in order of time; NaN if a run has none.
    comparisons : int
        Number of comparisons made together (Bonferroni's correction).

    Returns
    -------
    bool
        Its two tests, without the estimates of slope and step, which need n^2 operations.

    Examples
    --------
    >>> may_change([float(run) for run in range(20)]), may_change([0.0, 1.0] * 10)
    (True, False)
    """
    given = np.asarray(values, dtype=np.float64)
    runs = np.flatnonzero(np.isfinite(given))
    if len(runs) < LEAST_RUNS:
        return False
    present = given[runs]
    least = min(rank_p(present, runs), pettitt_p(present))
    return least <= SIGNIFICANT / (2 * comparisons)


def linear_trend(values: FloatArray, runs: npt.NDArray[np.int_], level: float = 0.95) -> LinearTrend:
    """Return Theil and Sen's slope with its interval, and p of Mann and Kendall's test.

    Parameters
    ----------
    values : ndarray of float, shape (n,)
        Finite values, in order of time.
    runs : ndarray of int, shape (n,)
        The number of each run.
    level : float
        Confidence level.

    Returns
    -------
    LinearTrend
        The slope per run; 0 with p = 1 if all values are equal.

    Notes
    -----
    The slope is the median of the slopes of all pairs, with Sen's interval. The test is Kendall's rank correlation with
    the order of the runs: no shape of the trend is assumed.

    Examples
    --------
    >>> import numpy as np
    >>> trend = linear_trend(2.0 * np.arange(10), np.arange(10))
    >>> trend.slope.value, trend.intercept
    (2.0, 0.0)
    """
    if np.all(values == values[0]):
        return LinearTrend(Interval(0.0, 0.0, 0.0, level), float(values[0]), 1.0)
    from scipy import stats

    found = stats.theilslopes(values, runs, alpha=level)
    slope = Interval(float(found.slope), float(found.low_slope), float(found.high_slope), level)
    return LinearTrend(slope, float(np.median(values - slope.value * runs)), rank_p(values, runs))


def rank_p(values: FloatArray, runs: npt.NDArray[np.int_]) -> float:
    """Return the two-sided p of Kendall's rank correlation with the order of the runs.

    Parameters
    ----------
    values : ndarray of float, shape (n,)
        Finite values, in order of time.
    runs : ndarray of int, shape (n,)
        The number of each run.

    Returns
    -------
    float
        p; 1 for equal values.

    Examples
    --------
    >>> import numpy as np
    >>> rank_p(np.zeros(5), np.arange(5))
    1.0
    """
    from scipy import stats

    p = float(stats.kendalltau(runs, values).pvalue)
    return 1.0 if math.isnan(p) else p


def step_of(values: FloatArray, runs: npt.NDArray[np.int_]) -> Step:
    """Return the split into two medians with the smallest sum of absolute deviations, with Pettitt's p.

    Parameters
    ----------
    values : ndarray of float, shape (n,)
        Finite values, in order of time.
    runs : ndarray of int, shape (n,)
        The number of each run.

    Returns
    -------
    Step
        The first run after the step, and the medians before and after.

    Examples
    --------
    >>> import numpy as np
    >>> step = step_of(np.repeat([1.0, 4.0], 6), np.arange(12))
    >>> step.run, step.height
    (6, 3.0)
    """
    sums = [_deviations(values[:first]) + _deviations(values[first:]) for first in range(1, len(values))]
    first = int(np.argmin(sums)) + 1
    before, after = float(np.median(values[:first])), float(np.median(values[first:]))
    return Step(int(runs[first]), before, after, pettitt_p(values))


def pettitt_p(values: FloatArray) -> float:
    """Return p of Pettitt's test of one step at an unknown run.

    Parameters
    ----------
    values : ndarray of float, shape (n,)
        Finite values, in order of time.

    Returns
    -------
    float
        p, approximate and conservative for few runs.

    Notes
    -----
    Pettitt, "A non-parametric approach to the change-point problem", Applied Statistics 28, 1979:

        K = max |U_t|,   U_t = 2 (sum of the first t ranks) - t (n + 1),   p = min(1, 2 exp(-6 K^2 / (n^3 + n^2)))

    The t of K is not the location of the step: chance draws it towards the middle of the runs.

    Examples
    --------
    >>> import numpy as np
    >>> round(pettitt_p(np.repeat([1.0, 4.0], 6)), 4)
    0.0314
    """
    from scipy import stats

    n = len(values)
    lead = 2.0 * np.cumsum(stats.rankdata(values))[:-1] - np.arange(1, n) * (n + 1.0)
    largest = float(np.abs(lead).max())
    return min(1.0, 2.0 * math.exp(-6.0 * largest**2 / (n**3 + n**2)))


def _deviations(values: FloatArray) -> float:
    return float(np.abs(values - np.median(values)).sum())
