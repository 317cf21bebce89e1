"""Values that belong together: contacts of one recording (or test campaign) are not independent of each other.

Conventions: a cluster is resampled, flipped or exchanged as a whole. Clusters and the values in them are sorted, so
that nothing depends on the order in which recordings were read.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import UsageError

IntArray = npt.NDArray[np.intp]
# More clusters than this are put together before they are resampled, flipped or exchanged.
MOST_CLUSTERS = 500


@dataclass(frozen=True)
class Clusters:
    """Values grouped by recording or test campaign.

    Attributes
    ----------
    values : ndarray of float, shape (n,)
        The values, cluster by cluster.
    number : ndarray of int, shape (n,)
        The number of each value's cluster, 0 to k - 1.
    counts : ndarray of int, shape (k,)
        The number of values in each cluster.
    """

    values: FloatArray
    number: IntArray
    counts: IntArray

    def __len__(self) -> int:
        return len(self.counts)

    def sums(self, values: FloatArray) -> FloatArray:
        """Return the sum over each cluster (k,) of a quantity given for each value (n,)."""
        return np.bincount(self.number, weights=values, minlength=len(self)).astype(np.float64)

    def merged(self, most: int, seed: int) -> Clusters:
        """Return at most so many clusters, by putting random ones together; unchanged if there are no more.

        A mean of independent clusters that are put together varies as much as that of the clusters: an interval or a
        test needs no more of them than its resamples can tell apart, and its time would grow with their square.
        """
        k = len(self)
        if k <= most:
            return self
        place = np.random.default_rng(seed).permutation(k) % most
        number = place[self.number]
        order = np.argsort(number, kind="stable")
        return Clusters(self.values[order], number[order], np.bincount(number, minlength=most))


def clusters_of(values: npt.ArrayLike, labels: Iterable[Hashable]) -> Clusters:
    """Group values by their labels.

    Parameters
    ----------
    values : array_like of float, shape (n,)
        Finite values.
    labels : iterable of hashable, length n
        The recording or test campaign of each value.

    Returns
    -------
    Clusters
        The values, sorted within and between clusters.

    Raises
    ------
    UsageError
        The lengths differ, or a value is not finite.

    Examples
    --------
    >>> groups = clusters_of([3.0, 1.0, 2.0], ["b", "a", "b"])
    >>> groups.values.tolist(), groups.counts.tolist()
    ([1.0, 2.0, 3.0], [1, 2])
    """
    array, names = np.asarray(values, dtype=np.float64), list(labels)
    if array.shape != (len(names),):
        raise UsageError(f"values {array.shape} and clusters ({len(names)},) do not match", "give one label per value")
    if not np.all(np.isfinite(array)):
        raise UsageError("a value is missing or infinite", "leave missed contacts out, and state how many there are")
    groups: dict[Hashable, list[float]] = {}
    for name, value in zip(names, array.tolist(), strict=True):
        groups.setdefault(name, []).append(value)
    ordered = sorted(sorted(group) for group in groups.values())
    counts = np.array([len(group) for group in ordered], dtype=np.intp)
    in_order = np.array([value for group in ordered for value in group], dtype=np.float64)
    return Clusters(in_order, np.repeat(np.arange(len(ordered)), counts), counts)
