"""Rare events: false alarms per hour or operation (Poisson), and the share of missed contacts (binomial), exactly.

Conventions: two questions have two answers. An `Interval` holds the true figure with at least 95 %, whatever it is. "At
most" is one-sided: all 5 % are spent on one bound, so it is lower than the interval's: 0 events in T hours are "at most
3.0 / T", the interval goes to 3.7 / T; 0 of 30 are "at most 9.5 %", the interval goes to 11.6 %. To take the one-sided
bound into the interval where the count is 0 would cover less than 95 % (docs/statistics.md).
"""

from __future__ import annotations

import math
from numbers import Integral

from cdtool.errors import UsageError
from cdtool.evaluation.statistics.interval import Interval, check_level

_MOST_COUNT = 10**15


def poisson_rate(count: int, exposure: float, level: float = 0.95) -> Interval:
    """Events per unit of exposure with the exact interval of Garwood (1936).

    Low: chi2((1 - level) / 2; 2 x) / (2 T), 0 for x = 0; high: chi2((1 + level) / 2; 2 x + 2) / (2 T); x = `count`
    events in T = `exposure` (hours, operations), chi2(p; f) the quantile with f degrees of freedom. Exposure 0: value
    NaN, [0, inf). Assumes that events come independently at a steady rate: several from one cause are too many.
    Raises UsageError for a negative count or exposure.
    """
    check_level(level)
    _check_exposure(count, exposure)
    if exposure == 0.0:
        return Interval(math.nan, 0.0, math.inf, level)
    from scipy import stats

    tail = 0.5 - 0.5 * level
    low = 0.5 * float(stats.chi2.ppf(tail, 2 * count)) / exposure if count else 0.0
    high = 0.5 * float(stats.chi2.isf(tail, 2 * count + 2)) / exposure
    return Interval(count / exposure, low, high, level)


def poisson_at_most(count: int, exposure: float, level: float = 0.95) -> float:
    """The rate that is not exceeded, one-sided: chi2(level; 2 x + 2) / (2 T), 3.0 / T for 0 events; see `poisson_rate`.

    Infinite for exposure 0. Raises UsageError as `poisson_rate` does.
    """
    check_level(level)
    _check_exposure(count, exposure)
    if exposure == 0.0:
        return math.inf
    from scipy import stats

    return 0.5 * float(stats.chi2.ppf(level, 2 * count + 2)) / exposure


def binomial_share(count: int, n: int, level: float = 0.95) -> Interval:
    """Share `count` of `n` with the exact interval of Clopper and Pearson (1934).

    Low: beta((1 - level) / 2; x, n - x + 1), 0 for x = 0; high: beta((1 + level) / 2; x + 1, n - x), 1 for x = n.
    n = 0: value NaN, [0, 1]. Assumes independent contacts with one probability: contacts of one recording that stand
    or fall together make it too short. Raises UsageError unless 0 <= count <= n.
    """
    check_level(level)
    _check_share(count, n)
    if n == 0:
        return Interval(math.nan, 0.0, 1.0, level)
    from scipy import stats

    bounds = stats.binomtest(count, n).proportion_ci(level, method="exact")
    return Interval(count / n, float(bounds.low), float(bounds.high), level)


def binomial_at_most(count: int, n: int, level: float = 0.95) -> float:
    """The share that is not exceeded, one-sided: beta(level; x + 1, n - x), 9.5 % for 0 of 30; see `binomial_share`.

    "At least" for what went well is 1 less this of what did not. 1 for n = 0. Raises UsageError as `binomial_share`.
    """
    check_level(level)
    _check_share(count, n)
    if count == n:
        return 1.0
    from scipy import stats

    return float(stats.beta.ppf(level, count + 1, n - count))


def binomial_increase_at_most(count_a: int, n_a: int, count_b: int, n_b: int, level: float = 0.95) -> float:
    """How much larger the share behind a may be than that behind b, one-sided.

    Newcombe's (1998) hybrid of the two exact one-sided bounds: d + sqrt((u_a - p_a)^2 + (p_b - l_b)^2) with d = p_a -
    p_b. 0 of 30 after 0 of n: the bound of 0 of 30 alone, 9.5 %. At most 1; 1 where a set is empty. Raises UsageError
    as `binomial_share`.
    """
    if not n_a or not n_b:
        return 1.0
    above = binomial_at_most(count_a, n_a, level) - count_a / n_a
    below = count_b / n_b - (1.0 - binomial_at_most(n_b - count_b, n_b, level))
    return min(1.0, count_a / n_a - count_b / n_b + math.hypot(above, below))


def poisson_increase_at_most(
    count_a: int, exposure_a: float, count_b: int, exposure_b: float, level: float = 0.95
) -> float:
    """How much larger the rate behind a may be than that behind b, one-sided: as `binomial_increase_at_most`.

    None in either: -ln(1 - level) / T_a, 3.0 / T_a. Infinite without exposure. Raises UsageError as `poisson_rate`.
    """
    if not exposure_a or not exposure_b:
        return math.inf
    from scipy import stats

    check_level(level)
    above = poisson_at_most(count_a, exposure_a, level) - count_a / exposure_a
    least = 0.5 * float(stats.chi2.ppf(1.0 - level, 2 * count_b)) / exposure_b if count_b else 0.0
    return count_a / exposure_a - count_b / exposure_b + math.hypot(above, count_b / exposure_b - least)


def poisson_difference_p(count_a: int, exposure_a: float, count_b: int, exposure_b: float) -> float:
    """Exact two-sided p of two equal rates, such as false alarms per hour of two builds.

    Given their sum, `count_a` is binomial with the share T_a / (T_a + T_b) (Przyborowski and Wilenski 1940). No events
    at all: 1. An exposure of 0: NaN. Raises UsageError as `poisson_rate` does.
    """
    _check_exposure(count_a, exposure_a)
    _check_exposure(count_b, exposure_b)
    if exposure_a == 0.0 or exposure_b == 0.0:
        return math.nan
    if count_a + count_b == 0:
        return 1.0
    from scipy import stats

    return float(stats.binomtest(count_a, count_a + count_b, exposure_a / (exposure_a + exposure_b)).pvalue)


def check_count(name: str, count: int) -> None:
    """Raise UsageError unless `count` is a whole number from 0 to 10^15: beyond, float64 does not count."""
    if not isinstance(count, Integral) or not 0 <= count <= _MOST_COUNT:
        raise UsageError(f"{name} is {count}", "give a whole number, 0 or more, at most 10^15")


def _check_exposure(count: int, exposure: float) -> None:
    check_count("number of events", count)
    if not (exposure >= 0.0 and math.isfinite(exposure)):
        raise UsageError(f"exposure is {exposure:g}", "give hours or operations, 0 or more")


def _check_share(count: int, n: int) -> None:
    check_count("count", count)
    check_count("n", n)
    if count > n:
        raise UsageError(f"{count} of {n} is more than all", "the count is at most n")
