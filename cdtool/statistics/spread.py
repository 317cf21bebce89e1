"""How certain the mean of clustered values is: Student's interval, from the spread that independent recordings have.

Conventions: whole clusters (recordings, or test campaigns where they are named) count as one observation each.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cdtool.statistics.clusters import clusters_of
from cdtool.statistics.interval import Interval, check_level
from cdtool.statistics.small_sample import FEWEST, too_few

# A standard deviation from the median absolute deviation of Gaussian noise.
MAD_TO_STD = 1.4826


@dataclass(frozen=True)
class Spread:
    """Mean and standard deviation of clustered values.

    Attributes
    ----------
    mean : float
        The mean.
    std : float
        The standard deviation of as many independent values as there are clusters, with the same standard error of the
        mean: the plain standard deviation if each recording has one value, that of the recordings' means if all have
        equally many.
    n : int
        Number of values.
    clusters : int
        Number of recordings or campaigns.
    """

    mean: float
    std: float
    n: int
    clusters: int

    @property
    def error(self) -> float:
        """Standard error of the mean."""
        return self.std / math.sqrt(self.clusters) if self.clusters else math.nan


def spread_of(values: npt.ArrayLike, labels: Iterable[Hashable]) -> Spread:
    """Return mean and standard deviation of clustered values.

    Parameters
    ----------
    values : array_like of float, shape (n,)
        Finite values, in any unit.
    labels : iterable of hashable, length n
        The recording or test campaign of each.

    Returns
    -------
    Spread
        In the unit of the values; the standard deviation is NaN with fewer than two clusters.

    Raises
    ------
    UsageError
        A value is not finite, or the lengths differ.

    Notes
    -----
    std^2 = k^2 / (k - 1) sum over the k clusters of (S_c - n_c m)^2 / n^2, with the mean m and the clusters' sums S_c
    of n_c values.

    Examples
    --------
    Two recordings with two contacts each: the standard deviation is that of their means, 2 and 4.

    >>> spread = spread_of([1.0, 3.0, 3.0, 5.0], ["a", "a", "b", "b"])
    >>> spread.mean, round(spread.std, 6)
    (3.0, 1.414214)
    """
    groups = clusters_of(values, labels)
    n, k = len(groups.values), len(groups)
    if not n:
        return Spread(math.nan, math.nan, 0, 0)
    # About a value of their own, equal values have exactly no spread.
    about = groups.values - groups.values[0]
    rest = float(about.mean())
    mean = float(groups.values[0]) + rest
    if k < 2:
        return Spread(mean, math.nan, n, k)
    sums = groups.sums(about) - groups.counts * rest
    equal = bool(np.all(about == 0.0))
    std = 0.0 if equal else k * math.sqrt(float(np.sum(sums**2)) / (k - 1)) / n
    return Spread(mean, std, n, k)


def mean_interval(values: npt.ArrayLike, labels: Iterable[Hashable], level: float = 0.95) -> Interval:
    """Return the mean of clustered values with Student's interval.

    Parameters
    ----------
    values : array_like of float, shape (n,)
        Finite values, in any unit.
    labels : iterable of hashable, length n
        The recording or test campaign of each.
    level : float
        Confidence level.

    Returns
    -------
    Interval
        In the unit of the values. Fewer than 10 clusters: bounds NaN, with the reason.

    Raises
    ------
    UsageError
        A value is not finite, the lengths differ, or the level is not between 0 and 1.

    Notes
    -----
    mean +- t((1 + level) / 2; k - 1) std / sqrt(k), with the std of `spread_of` and k clusters. No interval of ten or
    twenty contacts covers if a few of all contacts are much slower than the others: see docs/statistics.md.

    Examples
    --------
    >>> latencies = [31.0, 33.0, 30.0, 35.0, 32.0, 34.0, 31.0, 36.0, 33.0, 35.0]      # ms, one per recording
    >>> mean = mean_interval(latencies, range(10))
    >>> mean.value, round(mean.low, 2), round(mean.high, 2)
    (33.0, 31.57, 34.43)
    >>> mean_interval(latencies[:4], range(4)).reason
    'an interval needs 10 recordings or campaigns; there are 4'
    """
    spread = spread_of(values, labels)
    return _student_interval(spread.mean, spread.error, spread.clusters - 1.0, spread.clusters, level)


def difference_interval(a: Spread, b: Spread, level: float = 0.95) -> Interval:
    """Return the difference of two independent means with Welch's interval.

    Parameters
    ----------
    a, b : Spread
        Mean and standard error of both, in one unit.
    level : float
        Confidence level.

    Returns
    -------
    Interval
        a minus b. Fewer than 10 clusters in one of them: bounds NaN, with the reason.

    Raises
    ------
    UsageError
        The level is not between 0 and 1.

    Notes
    -----
    Welch, "The generalization of 'Student's' problem", Biometrika 34, 1947: e^4 / (e_a^4 / (k_a - 1) + e_b^4 / (k_b -
    1)) degrees of freedom, with the standard errors e_a, e_b and e^2 = e_a^2 + e_b^2.

    Examples
    --------
    >>> old, new = (spread_of([base + i for i in range(10)], range(10)) for base in (30.0, 40.0))
    >>> difference = difference_interval(new, old)
    >>> difference.value, round(difference.low, 2), round(difference.high, 2)
    (10.0, 7.16, 12.84)
    """
    error = math.hypot(a.error, b.error)
    parts = sum(item.error**4 / (item.clusters - 1) for item in (a, b) if item.clusters > 1)
    return _student_interval(
        a.mean - b.mean, error, error**4 / parts if parts else 1.0, min(a.clusters, b.clusters), level
    )


def _student_interval(value: float, error: float, freedom: float, clusters: int, level: float) -> Interval:
    """Return a value with Student's interval of its standard error; without bounds below 10 clusters."""
    from scipy import stats

    check_level(level)
    if clusters < FEWEST:
        return Interval(value, math.nan, math.nan, level, too_few(clusters) if clusters else "")
    half = float(stats.t.ppf(0.5 + 0.5 * level, freedom)) * error
    return Interval(value, value - half, value + half, level)
