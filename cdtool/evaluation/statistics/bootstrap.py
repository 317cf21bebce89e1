"""Intervals of mean, standard deviation and median: the BCa bootstrap, resampled by recording.

Conventions: whole clusters (recordings, or test campaigns where they are named) are drawn with replacement, and left
out one at a time for the acceleration. Seeded: the same values give the same bytes, whatever their order.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Hashable, Iterable
from typing import Any, Literal, Protocol

import numpy as np
import numpy.typing as npt

from cdtool.errors import UsageError, nearest
from cdtool.evaluation.statistics.clusters import MOST_CLUSTERS, Clusters, IntArray, clusters_of
from cdtool.evaluation.statistics.interval import Interval, check_level
from cdtool.evaluation.statistics.small_sample import FEWEST, too_few
from cdtool.recording import FloatArray

RESAMPLES = 9999
# Resampled numbers held at a time: some ten megabytes, whatever the number of values.
BATCH = 2**20


class Resampled(Protocol):
    """A statistic of every resample: cluster numbers (..., k), drawn along the last axis -> (...)."""

    def __call__(self, *drawn: IntArray, axis: int = -1) -> FloatArray:
        """The statistic, `axis` being the last one."""


def bca(
    values: npt.ArrayLike,
    clusters: Iterable[Hashable],
    statistic: Literal["mean", "std", "median"],
    level: float = 0.95,
    resamples: int = RESAMPLES,
    seed: int = 0,
) -> Interval:
    """Return a mean, standard deviation (n - 1) or median with its BCa bootstrap interval.

    Parameters
    ----------
    values : array_like of float, shape (n,)
        Finite values.
    clusters : iterable of hashable, length n
        The recording or test campaign of each value; it is resampled as a whole.
    statistic : {"mean", "std", "median"}
        The statistic.
    level : float
        Confidence level.
    resamples : int
        Number of resamples.
    seed : int
        Seed; equal values give equal bounds, in any order.

    Returns
    -------
    Interval
        In the unit of the values. Fewer than 10 clusters: bounds NaN, with the reason, because such an interval would
        contain the true value too rarely. Without variation the bounds are the value.

    Raises
    ------
    UsageError
        The statistic is unknown, `resamples` is below 1, a value is not finite, or the lengths differ.

    Notes
    -----
    Efron, "Better bootstrap confidence intervals", JASA 82, 1987. The bounds are quantiles of the resampled statistic
    at

        Phi(z0 + (z0 + z) / (1 - a (z0 + z)))

    with the bias z0, and the acceleration a from leaving one cluster out at a time. If ties leave the acceleration
    undefined, the percentiles of the same resamples are used. For the standard deviation of skewed values the interval
    is still too short (docs/statistics.md has the measured coverage). More than 500 clusters are put together at
    random into 500 first.

    Examples
    --------
    >>> latencies = [31.0, 33.0, 30.0, 35.0, 32.0, 34.0, 31.0, 36.0, 33.0, 35.0]      # ms, one per recording
    >>> mean = bca(latencies, range(10), "mean")
    >>> mean.value, bool(31.0 < mean.low < 33.0 < mean.high < 35.0)
    (33.0, True)
    >>> bca(latencies[:4], range(4), "mean").reason
    'an interval needs 10 recordings or campaigns; there are 4'
    """
    check_level(level)
    if statistic not in _STATISTICS:
        raise UsageError(f"unknown statistic '{statistic}'", nearest(statistic, _STATISTICS))
    if resamples < 1:
        raise UsageError(f"resamples is {resamples}", f"give at least 1; {RESAMPLES} is usual")
    groups = clusters_of(values, clusters)
    resampled = _STATISTICS[statistic](groups)
    fewest = 2 if statistic == "std" else 1
    value = float(resampled(np.arange(len(groups)))) if len(groups.values) >= fewest else math.nan
    if len(groups) < FEWEST:
        return Interval(value, math.nan, math.nan, level, too_few(len(groups)) if groups.values.size else "")
    drawn = groups.merged(MOST_CLUSTERS, seed)
    resampled = _STATISTICS[statistic](drawn)
    low, high = bca_bounds((len(drawn),), resampled, len(groups.values), level, resamples, seed)
    return Interval(value, low, high, level)


def bca_bounds(
    clusters: tuple[int, ...], statistic: Resampled, size: int, level: float, resamples: int, seed: int
) -> tuple[float, float]:
    """Return the BCa bounds of a statistic of one or several sets of clusters.

    Parameters
    ----------
    clusters : tuple of int
        Number of clusters of each set.
    statistic : Resampled
        The statistic of drawn cluster numbers.
    size : int
        Number of values per resample, in all sets; it limits the memory used.
    level : float
        Confidence level.
    resamples : int
        Number of resamples.
    seed : int
        Seed.

    Returns
    -------
    low, high : float
        The bounds, in the unit of the statistic.

    Notes
    -----
    See `bca`.

    Examples
    --------
    >>> groups = clusters_of([float(i) for i in range(20)], range(20))
    >>> low, high = bca_bounds((20,), resampled_mean(groups), 20, level=0.95, resamples=999, seed=1)
    >>> bool(5.0 < low < 9.5 < high < 14.0)
    True
    """
    from scipy import stats

    data: Any = tuple(np.arange(count) for count in clusters)
    options: dict[str, Any] = {"vectorized": True, "axis": -1, "confidence_level": level}
    # Undefined bounds are dealt with here, so neither numpy nor scipy needs to warn of them.
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore", RuntimeWarning)
        drawn: Any = stats.bootstrap(
            data,
            statistic,
            n_resamples=resamples,
            batch=max(1, BATCH // size),
            method="BCa",
            rng=np.random.default_rng(seed),
            **options,
        )
        bounds = drawn.confidence_interval
        if math.isnan(bounds.low) or math.isnan(bounds.high):
            bounds = stats.bootstrap(
                data, statistic, n_resamples=0, bootstrap_result=drawn, method="percentile", **options
            ).confidence_interval
    return float(bounds.low), float(bounds.high)


def resampled_mean(groups: Clusters) -> Resampled:
    """Return the function that computes the mean of all values of drawn clusters.

    Parameters
    ----------
    groups : Clusters
        The values.

    Returns
    -------
    Resampled
        Takes cluster numbers (..., k), returns means (...).

    Notes
    -----
    c + sum of S_k / sum of n_k, where c is the median, and S_k is the sum of cluster k about c.

    Examples
    --------
    >>> import numpy as np
    >>> mean = resampled_mean(clusters_of([1.0, 2.0, 6.0], ["a", "a", "b"]))
    >>> mean(np.array([[0, 1], [0, 0]])).tolist()
    [3.0, 1.5]
    """
    centre, about = _centred(groups)
    sums, counts = groups.sums(about), groups.counts

    def mean(*drawn: IntArray, axis: int = -1) -> FloatArray:
        return np.asarray(centre + sums[drawn[0]].sum(axis) / counts[drawn[0]].sum(axis))

    return mean


def _resampled_std(groups: Clusters) -> Resampled:
    """Standard deviation of the same: sqrt((Q - S^2 / N) / (N - 1)), with sums S and sums of squares Q about c."""
    _, about = _centred(groups)
    sums, squares, counts = groups.sums(about), groups.sums(about**2), groups.counts

    def std(*drawn: IntArray, axis: int = -1) -> FloatArray:
        number = counts[drawn[0]].sum(axis)
        spread = squares[drawn[0]].sum(axis) - sums[drawn[0]].sum(axis) ** 2 / number
        return np.asarray(np.sqrt(np.maximum(spread, 0.0) / (number - 1)))

    return std


def _resampled_median(groups: Clusters) -> Resampled:
    """Median: the sorted values, each as often as its cluster was drawn; the middle one, or the mean of the two."""
    order = np.argsort(groups.values, kind="stable")
    values, number, clusters = groups.values[order], groups.number[order], len(groups)

    def median(*drawn: IntArray, axis: int = -1) -> FloatArray:
        rows = drawn[0].reshape(-1, drawn[0].shape[axis])
        shifted = rows + clusters * np.arange(len(rows))[:, np.newaxis]
        times = np.bincount(shifted.ravel(), minlength=clusters * len(rows)).reshape(len(rows), clusters)
        up_to = np.cumsum(times.astype(np.int32)[:, number], axis=1, dtype=np.int32)
        total = up_to[:, -1:]
        lower = values[np.argmax(up_to >= (total + 1) // 2, axis=1)]
        upper = values[np.argmax(up_to >= total // 2 + 1, axis=1)]
        return np.asarray(0.5 * (lower + upper)).reshape(drawn[0].shape[:-1])

    return median


def _centred(groups: Clusters) -> tuple[float, FloatArray]:
    """The median and the values about it: sums of squares then lose no digits, and equal values give exact zeros."""
    if not len(groups):
        return math.nan, groups.values
    centre = float(np.median(groups.values))
    return centre, groups.values - centre


_STATISTICS: dict[str, Callable[[Clusters], Resampled]] = {
    "mean": resampled_mean,
    "std": _resampled_std,
    "median": _resampled_median,
}
