"""Is one detector faster than another, or one build better? Differences with intervals, and exact tests.

Conventions: two detectors on the same impacts are paired: one difference per impact. Recordings (or test campaigns) are
flipped or exchanged as a whole, because the contacts of one are not independent. All p are two-sided.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable, Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import UsageError
from cdtool.statistics.clusters import MOST_CLUSTERS, Clusters, IntArray, clusters_of
from cdtool.statistics.interval import Interval
from cdtool.statistics.rates import check_count
from cdtool.statistics.spread import difference_interval, mean_interval, spread_of

# Sign patterns or divisions drawn if there are too many to try all.
RESAMPLES = 9999
# Drawn numbers held at a time: some ten megabytes, whatever the number of values.
BATCH = 2**20
# Up to so many clusters every sign pattern is tried.
MOST_ENUMERATED = 13


@dataclass(frozen=True)
class Difference:
    """A mean difference in the unit of its values, and the chance of one as large without a true difference.

    Attributes
    ----------
    mean : Interval
        The mean; it has no interval with fewer than ten recordings or campaigns (in each set).
    p : float
        Of the permutation test of the mean, exact for any number; NaN with fewer than two clusters (in a set).
    wilcoxon_p : float
        Of the rank test; NaN with fewer than two clusters (in a set).
    n : int
        Number of values.
    clusters : int
        Number of recordings or campaigns; of both sets together if there are two.
    """

    mean: Interval
    p: float
    wilcoxon_p: float
    n: int
    clusters: int


def paired_difference(
    differences: npt.ArrayLike, clusters: Iterable[Hashable], level: float = 0.95, seed: int = 0
) -> Difference:
    """Return the mean of paired differences with Student's interval, a sign-flip test and Wilcoxon's signed-rank test.

    Parameters
    ----------
    differences : array_like of float, shape (n,)
        One difference per impact, in any unit. Leave out the impacts that one of the two missed, and compare the misses
        with `mcnemar_p`.
    clusters : iterable of hashable, length n
        The recording or test campaign of each.
    level : float
        Confidence level.
    seed : int
        Seed of the test with more than 13 clusters.

    Returns
    -------
    Difference
        The mean, its interval and both p.

    Raises
    ------
    UsageError
        A value is not finite, or the lengths differ.

    Notes
    -----
    If neither is faster, the differences of each recording could as well have the other sign. p is twice the share of
    the 2^k sign patterns of k clusters whose mean is at least as far out on the same side: all of them up to k = 13,
    else 9999 drawn ones, (b + 1) / (m + 1). The smallest p is 2 / 2^k: below 6 recordings none is under 0.05. The rank
    test uses the mean of each cluster.

    Examples
    --------
    The first detector is 4 to 6 ms faster in each of six recordings.

    >>> difference = paired_difference([-5.0, -4.0, -6.0, -5.0, -4.0, -6.0], range(6))
    >>> difference.mean.value, difference.p
    (-5.0, 0.03125)
    """
    labels = list(clusters)
    groups = clusters_of(differences, labels)
    mean = mean_interval(differences, labels, level)
    n, k = len(groups.values), len(groups)
    if k < 2:
        return Difference(mean, math.nan, math.nan, n, k)
    drawn = groups.merged(MOST_CLUSTERS, seed)
    return Difference(mean, _flipped_p(drawn.sums(drawn.values), seed), _signed_rank_p(_means(groups)), n, k)


def unpaired_difference(
    a: npt.ArrayLike,
    b: npt.ArrayLike,
    clusters_a: Iterable[Hashable],
    clusters_b: Iterable[Hashable],
    level: float = 0.95,
    seed: int = 0,
) -> Difference:
    """Return mean(a) - mean(b) of two independent sets: Welch's interval, permutation test, Mann-Whitney's test.

    Parameters
    ----------
    a, b : array_like of float, shapes (n_a,) and (n_b,)
        The values, in any unit.
    clusters_a, clusters_b : iterable of hashable, lengths n_a and n_b
        The recording or test campaign of each.
    level : float
        Confidence level.
    seed : int
        Seed of the test if there are more than 9999 divisions.

    Returns
    -------
    Difference
        The difference of the means, its interval and both p.

    Raises
    ------
    UsageError
        A value is not finite, or the lengths differ.

    Notes
    -----
    If both are equal, every division of the recordings into k_a and k_b is equally likely. p is twice the smaller tail
    of the difference of the means over all divisions up to 9999, else over 9999 drawn ones, as (b + 1) / (m + 1). The
    rank test uses the mean of each cluster. The tests are sensitive to unequal spread with unequal numbers. Pair what
    can be paired: impacts differ more than detectors.

    Examples
    --------
    >>> difference = unpaired_difference([31.0, 32.0, 33.0, 34.0], [41.0, 42.0, 43.0, 44.0], range(4), range(4))
    >>> difference.mean.value, round(difference.p, 4)
    (-10.0, 0.0286)
    """
    labels_a, labels_b = list(clusters_a), list(clusters_b)
    all_of_a, all_of_b = clusters_of(a, labels_a), clusters_of(b, labels_b)
    n, k = len(all_of_a.values) + len(all_of_b.values), len(all_of_a) + len(all_of_b)
    mean = difference_interval(spread_of(a, labels_a), spread_of(b, labels_b), level)
    if min(len(all_of_a), len(all_of_b)) < 2:
        return Difference(mean, math.nan, math.nan, n, k)
    first, second = (side.merged(MOST_CLUSTERS, seed) for side in (all_of_a, all_of_b))
    from scipy import stats

    means = _means(all_of_a), _means(all_of_b)
    # With all means equal, SciPy returns 1 before version 1.18 and NaN from then on.
    ranks_p = float(stats.mannwhitneyu(*means).pvalue) if np.ptp(np.concatenate(means)) else 1.0
    return Difference(mean, _exchanged_p(first, second, seed), ranks_p, n, k)


def mcnemar_p(only_first: int, only_second: int) -> float:
    """Return the exact two-sided p of McNemar's test on paired misses.

    Parameters
    ----------
    only_first : int
        Contacts that only the first detector missed.
    only_second : int
        Contacts that only the second detector missed.

    Returns
    -------
    float
        p; 1 without such contacts.

    Raises
    ------
    UsageError
        A count is negative or not a whole number.

    Notes
    -----
    If both miss equally often, `only_first` is binomial with share 1/2 of the two together. Contacts count as
    independent.

    Examples
    --------
    >>> mcnemar_p(0, 6)
    0.03125
    """
    check_count("only_first", only_first)
    check_count("only_second", only_second)
    if only_first + only_second == 0:
        return 1.0
    from scipy import stats

    return float(stats.binomtest(only_first, only_first + only_second, 0.5).pvalue)


def fisher_p(missed_a: int, n_a: int, missed_b: int, n_b: int) -> float:
    """Return the two-sided p of Fisher's exact test of two missed shares on different contacts.

    Parameters
    ----------
    missed_a, n_a : int
        Missed contacts and all contacts of the first set.
    missed_b, n_b : int
        Missed contacts and all contacts of the second set.

    Returns
    -------
    float
        p; NaN if a set is empty.

    Raises
    ------
    UsageError
        Not 0 <= missed <= n.

    Notes
    -----
    Contacts count as independent.

    Examples
    --------
    >>> round(fisher_p(0, 10, 5, 10), 4)
    0.0325
    """
    for missed, n in ((missed_a, n_a), (missed_b, n_b)):
        check_count("missed", missed)
        if missed > n:
            raise UsageError(f"{missed} of {n} is more than all", "the missed ones are at most n")
    if n_a == 0 or n_b == 0:
        return math.nan
    from scipy import stats

    table = np.array([[missed_a, n_a - missed_a], [missed_b, n_b - missed_b]])
    return float(stats.fisher_exact(table).pvalue)


def holm(p_values: npt.ArrayLike) -> FloatArray:
    """Return p values adjusted for several comparisons.

    Parameters
    ----------
    p_values : array_like of float, shape (m,)
        p values; NaN does not count as a comparison.

    Returns
    -------
    ndarray of float, shape (m,)
        The adjusted p values in the same order; NaN stays NaN.

    Raises
    ------
    UsageError
        A p value is outside 0 to 1.

    Notes
    -----
    Holm, "A simple sequentially rejective multiple test procedure", Scandinavian Journal of Statistics 6, 1979: the
    i-th smallest becomes the largest of (m - j + 1) p_(j) over j <= i, at most 1. The family-wise error rate of all
    adjusted values below 0.05 is at most 5 %.

    Examples
    --------
    >>> holm([0.01, 0.04, 0.03]).tolist()
    [0.03, 0.06, 0.06]
    """
    p = np.asarray(p_values, dtype=np.float64)
    if np.any((p < 0.0) | (p > 1.0)):
        raise UsageError("a p value is outside 0 to 1", "give p values, not statistics")
    adjusted = np.full(p.shape, math.nan)
    known = np.flatnonzero(~np.isnan(p))
    in_order = known[np.argsort(p[known], kind="stable")]
    times = np.arange(len(in_order), 0, -1)
    adjusted[in_order] = np.minimum(1.0, np.maximum.accumulate(times * p[in_order]))
    return adjusted


def _exchanged_p(first: Clusters, second: Clusters, seed: int) -> float:
    """Permutation test: clusters change sides with all their values, so that the statistic stays the same."""
    from scipy import stats

    centre = float(np.median(np.concatenate((first.values, second.values))))
    sums = np.concatenate([side.sums(side.values - centre) for side in (first, second)])
    counts = np.concatenate((first.counts, second.counts))

    def difference(a: IntArray, b: IntArray, axis: int) -> FloatArray:
        return np.asarray(sums[a].sum(axis) / counts[a].sum(axis) - sums[b].sum(axis) / counts[b].sum(axis))

    number = np.arange(len(sums))
    exchanged = stats.permutation_test(
        (number[: len(first)], number[len(first) :]),
        difference,
        permutation_type="independent",
        vectorized=True,
        n_resamples=RESAMPLES,
        batch=max(1, BATCH // len(sums)),
        axis=-1,
        rng=np.random.default_rng(seed),
    )
    return float(exchanged.pvalue)


def _means(groups: Clusters) -> FloatArray:
    return np.asarray(groups.sums(groups.values) / groups.counts)


def _signed_rank_p(means: FloatArray) -> float:
    """Wilcoxon's signed-rank test of means (k,) by cluster, two-sided; zeros are left out, ties have their mean rank.

    Exact up to k = 13, with ties and zeros too, where scipy's general permutation test takes a hundred times as long.
    """
    from scipy import stats

    different = means[means != 0.0]
    if not len(different):
        return 1.0
    if len(means) > MOST_ENUMERATED:
        return float(stats.wilcoxon(means).pvalue)
    return _flipped_p(np.sign(different) * stats.rankdata(np.abs(different)))


def _flipped_p(sums: FloatArray, seed: int = 0) -> float:
    """Sign-flip test of sums (k,) by cluster, two-sided.

    By itself rather than scipy's permutation test: a product with signs is ten times as fast with thousands of them.
    """
    k, observed = len(sums), float(sums.sum())
    # Equal sums come out in another order of addition: what differs by rounding alone is as far out.
    slack = 1e-12 * float(np.abs(sums).sum())
    below = above = 0
    for signs in _all_signs(k) if k <= MOST_ENUMERATED else _drawn_signs(k, seed):
        flipped = signs @ sums
        below += int(np.count_nonzero(flipped <= observed + slack))
        above += int(np.count_nonzero(flipped >= observed - slack))
    least = min(below, above)
    share = least / 2**k if k <= MOST_ENUMERATED else (least + 1) / (RESAMPLES + 1)
    return min(1.0, 2.0 * share)


def _all_signs(k: int) -> Iterator[FloatArray]:
    bits = (np.arange(2**k)[:, np.newaxis] >> np.arange(k)) & 1
    yield (1 - 2 * bits).astype(np.float64)


def _drawn_signs(k: int, seed: int) -> Iterator[FloatArray]:
    rng = np.random.default_rng(seed)
    batch = max(1, BATCH // k)
    for first in range(0, RESAMPLES, batch):
        bits = rng.integers(0, 2, (min(batch, RESAMPLES - first), k), dtype=np.int8)
        yield (1 - 2 * bits).astype(np.float64)
