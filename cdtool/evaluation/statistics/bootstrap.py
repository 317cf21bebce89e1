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
from cdtool.evaluation.statistics.clusters import Clusters, IntArray, clusters_of
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
    """Mean, standard deviation (n - 1) or median with its BCa interval (Efron 1987), clusters resampled as a whole.

    `values` (n,), finite; `clusters` (n,) the recording or test campaign of each. The bounds are quantiles of the
    statistic of `resamples` resamples, at Phi(z0 + (z0 + z) / (1 - a (z0 + z))): z0 is the bias, a the acceleration
    from leaving one cluster out. Fewer than 10 clusters: no bounds (NaN), with the reason: they would hold the true
    figure too rarely. Nothing varies: the interval is the value.
    Ties can leave the acceleration undefined; then the percentiles of the same resamples stand.
    Still too short for the standard deviation of skewed values (docs/statistics.md has the measured coverage).
    Raises UsageError for an unknown statistic, no resamples, values that are not finite or arrays that do not fit.
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
    low, high = bca_bounds((len(groups),), resampled, len(groups.values), level, resamples, seed)
    return Interval(value, low, high, level)


def bca_bounds(
    clusters: tuple[int, ...], statistic: Resampled, size: int, level: float, resamples: int, seed: int
) -> tuple[float, float]:
    """BCa bounds of a statistic of one or several sets with so many clusters each; `size` numbers a resample in all."""
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
    """Mean of all values of the drawn clusters: c + sum of S_k / sum of n_k, with the clusters' sums S_k about c."""
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
