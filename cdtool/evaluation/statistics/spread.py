"""How far the mean of clustered values can be trusted, as the spread that independent recordings would have."""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cdtool.evaluation.statistics.clusters import clusters_of


@dataclass(frozen=True)
class Spread:
    """`n` values in `clusters` recordings or campaigns: their `mean`, and `std` in their unit.

    `std` is that of `clusters` independent values with the same standard error of the mean: the plain standard
    deviation where each recording holds one value, that of the recordings' means where each holds as many.
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
    """Spread of values (n,) whose recording or campaign is given by labels (n,).

    std^2 = k^2 / (k - 1) sum over the k clusters of (S_c - n_c m)^2 / n^2, with the mean m and the clusters' sums S_c
    of n_c values. NaN with fewer than two clusters. Raises UsageError for values that are not finite.
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
