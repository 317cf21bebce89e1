"""How certain the mean of clustered values is, as the spread that independent recordings would have."""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cdtool.evaluation.statistics.clusters import clusters_of


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
