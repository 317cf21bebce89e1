"""Is one detector faster than another, or one build better? Differences with intervals, and exact tests.

Conventions: two detectors on the same impacts are paired: one difference for each impact. Recordings (or test
campaigns) are flipped or exchanged as a whole, since the contacts of one are not independent. All p are two-sided.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable, Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cdtool.errors import UsageError
from cdtool.evaluation.statistics.bootstrap import BATCH, RESAMPLES, bca, bca_bounds, resampled_mean
from cdtool.evaluation.statistics.clusters import Clusters, IntArray, clusters_of
from cdtool.evaluation.statistics.interval import Interval, check_level
from cdtool.evaluation.statistics.rates import check_count
from cdtool.evaluation.statistics.small_sample import FEWEST, too_few
from cdtool.recording import FloatArray

# Up to so many clusters every sign pattern is tried.
MOST_ENUMERATED = 13


@dataclass(frozen=True)
class Difference:
    """A mean difference in the unit of its values, and how easily chance alone would give it.

    `mean` has no interval below ten recordings or campaigns (in each set); the tests are exact with any number.
    `p` of the permutation test of the mean, `wilcoxon_p` of the rank test; NaN with fewer than two clusters (a set).
    """

    mean: Interval
    p: float
    wilcoxon_p: float
    n: int
    clusters: int


def paired_difference(
    differences: npt.ArrayLike, clusters: Iterable[Hashable], level: float = 0.95, seed: int = 0
) -> Difference:
    """Mean of paired differences (n,), its BCa interval, sign-flip test and Wilcoxon's signed-rank test.

    If neither is faster, each recording's differences could as well have the other sign. p: twice the share of the 2^k
    sign patterns of k clusters whose mean is as far out on the same side, all of them up to k = 13, else 9999 drawn
    with the seed, (b + 1) / (m + 1) of them. The least p is 2 / 2^k: below 6 recordings nothing comes under 0.05. The
    rank test takes the mean of each cluster. Raises UsageError for values that are not finite: leave out the impacts
    that one of them missed, and compare the misses with `mcnemar_p`.
    """
    labels = list(clusters)
    groups = clusters_of(differences, labels)
    mean = bca(differences, labels, "mean", level, seed=seed)
    n, k = len(groups.values), len(groups)
    if k < 2:
        return Difference(mean, math.nan, math.nan, n, k)
    from scipy import stats

    sums = groups.sums(groups.values)
    signed_rank = float(stats.wilcoxon(sums / groups.counts).pvalue) if np.any(sums) else 1.0
    return Difference(mean, _flipped_p(sums, seed), signed_rank, n, k)


def unpaired_difference(
    a: npt.ArrayLike,
    b: npt.ArrayLike,
    clusters_a: Iterable[Hashable],
    clusters_b: Iterable[Hashable],
    level: float = 0.95,
    seed: int = 0,
) -> Difference:
    """mean(a) - mean(b) of two independent sets (n_a,), (n_b,): BCa interval, permutation test and Mann-Whitney's test.

    If both are alike, any division of the recordings into k_a and k_b is as likely. p: twice the smaller tail of the
    difference of the means over all divisions up to 9999, else over 9999 drawn with the seed, as (b + 1) / (m + 1).
    The rank test takes the mean of each cluster. Sensitive to unequal spread with unequal numbers. Pair what can be
    paired: impacts differ more than detectors. Raises UsageError as `paired_difference` does.
    """
    check_level(level)
    first, second = clusters_of(a, clusters_a), clusters_of(b, clusters_b)
    n, k = len(first.values) + len(second.values), len(first) + len(second)
    mean_a, mean_b = resampled_mean(first), resampled_mean(second)

    def difference(*drawn: IntArray, axis: int = -1) -> FloatArray:
        return mean_a(drawn[0], axis=axis) - mean_b(drawn[1], axis=axis)

    fewest = min(len(first), len(second))
    value = float(difference(np.arange(len(first)), np.arange(len(second)))) if fewest else math.nan
    low, high = math.nan, math.nan
    if fewest >= FEWEST:
        low, high = bca_bounds((len(first), len(second)), difference, n, level, RESAMPLES, seed)
    mean = Interval(value, low, high, level, too_few(fewest) if fewest else "")
    if fewest < 2:
        return Difference(mean, math.nan, math.nan, n, k)
    from scipy import stats

    ranks = stats.mannwhitneyu(_means(first), _means(second))
    return Difference(mean, _exchanged_p(first, second, seed), float(ranks.pvalue), n, k)


def mcnemar_p(only_first: int, only_second: int) -> float:
    """Exact McNemar test on paired misses: contacts that only the first missed, and that only the second missed.

    If both miss equally often, `only_first` is binomial with share 1/2 of the two together. None: 1. Counts contacts as
    independent. Raises UsageError for negative counts.
    """
    check_count("only_first", only_first)
    check_count("only_second", only_second)
    if only_first + only_second == 0:
        return 1.0
    from scipy import stats

    return float(stats.binomtest(only_first, only_first + only_second, 0.5).pvalue)


def fisher_p(missed_a: int, n_a: int, missed_b: int, n_b: int) -> float:
    """Fisher's exact test of two missed shares on different contacts, `missed_a` of `n_a` against `missed_b` of `n_b`.

    NaN where one of the sets is empty. Counts contacts as independent. Raises UsageError unless 0 <= missed <= n.
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
    """p values (m,) adjusted for making m comparisons at once (Holm 1979), in the same order.

    The i-th smallest becomes the largest of (m - j + 1) p_(j) over j <= i, at most 1. NaN stays NaN and does not count.
    All adjusted values below 0.05 are then right with 95 % together. Raises UsageError for a p outside 0 to 1.
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


def _flipped_p(sums: FloatArray, seed: int) -> float:
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
