"""Rare events: false alarms per hour or operation (Poisson), and the share of missed contacts (binomial), exactly.

Conventions: there are two kinds of bounds. An `Interval` contains the true value with at least 95 %, whatever it is.
"At most" is one-sided: all 5 % are spent on one bound, so it is lower than that of the interval. 0 events in T hours
are "at most 3.0 / T", the interval extends to 3.7 / T; 0 of 30 are "at most 9.5 %", the interval extends to 11.6 %.
With the one-sided bound as the end of the interval if the count is 0, the coverage would be below 95 %
(docs/statistics.md).
"""

from __future__ import annotations

import math
from numbers import Integral

from cdtool.base.errors import UsageError
from cdtool.statistics.interval import Interval, check_level


def poisson_rate(count: int, exposure: float, level: float = 0.95) -> Interval:
    """Return a rate of events with its exact interval.

    Parameters
    ----------
    count : int
        Number of events x.
    exposure : float
        T, in hours or operations.
    level : float
        Confidence level.

    Returns
    -------
    Interval
        Events per unit of exposure. Exposure 0: value NaN, interval 0 to infinity.

    Raises
    ------
    UsageError
        The count or the exposure is negative.

    Notes
    -----
    Garwood, "Fiducial limits for the Poisson distribution", Biometrika 28, 1936. Low: chi2((1 - level) / 2; 2 x) / (2
    T), 0 for x = 0. High: chi2((1 + level) / 2; 2 x + 2) / (2 T). chi2(p; f) is the quantile with f degrees of freedom.
    Events are assumed to be independent, at a constant rate: several with one cause are too many.

    Examples
    --------
    >>> rate = poisson_rate(2, 100.0)
    >>> rate.value, round(rate.low, 5), round(rate.high, 5)
    (0.02, 0.00242, 0.07225)
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
    """Return the one-sided upper bound of a rate.

    Parameters
    ----------
    count : int
        Number of events x.
    exposure : float
        T, in hours or operations.
    level : float
        Confidence level.

    Returns
    -------
    float
        Events per unit of exposure; infinite for exposure 0.

    Raises
    ------
    UsageError
        The count or the exposure is negative.

    Notes
    -----
    chi2(level; 2 x + 2) / (2 T), 3.0 / T for 0 events; see `poisson_rate`.

    Examples
    --------
    >>> round(poisson_at_most(0, 100.0), 5)
    0.02996
    """
    check_level(level)
    _check_exposure(count, exposure)
    if exposure == 0.0:
        return math.inf
    from scipy import stats

    return 0.5 * float(stats.chi2.ppf(level, 2 * count + 2)) / exposure


def binomial_share(count: int, n: int, level: float = 0.95) -> Interval:
    """Return a share with its exact interval.

    Parameters
    ----------
    count : int
        Number of events x.
    n : int
        Number of cases.
    level : float
        Confidence level.

    Returns
    -------
    Interval
        The share. n = 0: value NaN, interval 0 to 1.

    Raises
    ------
    UsageError
        Not 0 <= count <= n.

    Notes
    -----
    Clopper and Pearson, "The use of confidence or fiducial limits illustrated in the case of the binomial", Biometrika
    26, 1934. Low: beta((1 - level) / 2; x, n - x + 1), 0 for x = 0. High: beta((1 + level) / 2; x + 1, n - x), 1 for x
    = n. Contacts are assumed to be independent, with one probability: if those of one recording are detected or missed
    together, the interval is too short.

    Examples
    --------
    >>> share = binomial_share(0, 30)
    >>> share.value, share.low, round(share.high, 4)
    (0.0, 0.0, 0.1157)
    """
    check_level(level)
    _check_share(count, n)
    if n == 0:
        return Interval(math.nan, 0.0, 1.0, level)
    from scipy import stats

    bounds = stats.binomtest(count, n).proportion_ci(level, method="exact")
    return Interval(count / n, float(bounds.low), float(bounds.high), level)


def binomial_at_most(count: int, n: int, level: float = 0.95) -> float:
    """Return the one-sided upper bound of a share.

    Parameters
    ----------
    count : int
        Number of events x.
    n : int
        Number of cases.
    level : float
        Confidence level.

    Returns
    -------
    float
        The bound; 1 for n = 0. "At least", for what succeeded, is 1 minus the bound of what did not.

    Raises
    ------
    UsageError
        Not 0 <= count <= n.

    Notes
    -----
    beta(level; x + 1, n - x), 9.5 % for 0 of 30; see `binomial_share`.

    Examples
    --------
    >>> round(binomial_at_most(0, 30), 4)
    0.095
    """
    check_level(level)
    _check_share(count, n)
    if count == n:
        return 1.0
    from scipy import stats

    return float(stats.beta.ppf(level, count + 1, n - count))


def binomial_increase_at_most(count_a: int, n_a: int, count_b: int, n_b: int, level: float = 0.95) -> float:
    """Return the one-sided upper bound of the difference of two shares, a minus b.

    Parameters
    ----------
    count_a, n_a : int
        Number of events and of cases of a.
    count_b, n_b : int
        Number of events and of cases of b.
    level : float
        Confidence level.

    Returns
    -------
    float
        The bound, at most 1; 1 if a set is empty.

    Raises
    ------
    UsageError
        Not 0 <= count <= n.

    Notes
    -----
    Hybrid of the two exact one-sided bounds, after Newcombe, "Interval estimation for the difference between
    independent proportions", Statistics in Medicine 17, 1998: d + sqrt((u_a - p_a)^2 + (p_b - l_b)^2) with d = p_a -
    p_b. For 0 of 30 after 0 of n it is the bound of 0 of 30, 9.5 %.

    Examples
    --------
    >>> round(binomial_increase_at_most(0, 30, 0, 50), 4)
    0.095
    """
    _check_share(count_a, n_a)
    _check_share(count_b, n_b)
    if not n_a or not n_b:
        return 1.0
    above = binomial_at_most(count_a, n_a, level) - count_a / n_a
    below = count_b / n_b - (1.0 - binomial_at_most(n_b - count_b, n_b, level))
    return min(1.0, count_a / n_a - count_b / n_b + math.hypot(above, below))


def poisson_increase_at_most(
    count_a: int, exposure_a: float, count_b: int, exposure_b: float, level: float = 0.95
) -> float:
    """Return the one-sided upper bound of the difference of two rates, a minus b.

    Parameters
    ----------
    count_a : int
        Number of events of a.
    exposure_a : float
        Hours or operations of a.
    count_b : int
        Number of events of b.
    exposure_b : float
        Hours or operations of b.
    level : float
        Confidence level.

    Returns
    -------
    float
        Events per unit of exposure; infinite without exposure.

    Raises
    ------
    UsageError
        A count or an exposure is negative.

    Notes
    -----
    As `binomial_increase_at_most`; without events -ln(1 - level) / T_a, 3.0 / T_a.

    Examples
    --------
    >>> round(poisson_increase_at_most(0, 100.0, 0, 50.0), 5)
    0.02996
    """
    _check_exposure(count_a, exposure_a)
    _check_exposure(count_b, exposure_b)
    if not exposure_a or not exposure_b:
        return math.inf
    from scipy import stats

    check_level(level)
    above = poisson_at_most(count_a, exposure_a, level) - count_a / exposure_a
    least = 0.5 * float(stats.chi2.ppf(1.0 - level, 2 * count_b)) / exposure_b if count_b else 0.0
    return count_a / exposure_a - count_b / exposure_b + math.hypot(above, count_b / exposure_b - least)


def poisson_difference_p(count_a: int, exposure_a: float, count_b: int, exposure_b: float) -> float:
    """Return the exact two-sided p of two equal rates, such as the false alarms per hour of two builds.

    Parameters
    ----------
    count_a : int
        Number of events of a.
    exposure_a : float
        Hours or operations of a.
    count_b : int
        Number of events of b.
    exposure_b : float
        Hours or operations of b.

    Returns
    -------
    float
        p; 1 without events, NaN if an exposure is 0.

    Raises
    ------
    UsageError
        A count or an exposure is negative.

    Notes
    -----
    Given their sum, `count_a` is binomial with the share T_a / (T_a + T_b): Przyborowski and Wilenski, "Homogeneity of
    results in testing samples from Poisson series", Biometrika 31, 1940.

    Examples
    --------
    >>> poisson_difference_p(0, 10.0, 6, 10.0)
    0.03125
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
    """Check a number of events.

    Parameters
    ----------
    name : str
        What is counted, for the message.
    count : int
        The number.

    Raises
    ------
    UsageError
        It is not a whole number from 0 to 10^15, beyond which float64 does not count.

    Examples
    --------
    >>> check_count("number of events", 3)
    """
    if not isinstance(count, Integral) or not 0 <= count <= 10**15:  # float64 counts to there
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
