"""Intervals for few contacts: none for a mean below ten recordings, an exact one for the median of six or more.

Conventions: if 15 % of all contacts are slow, the 95 % interval of the mean of four contains the true mean in 49 of 100
tests: in half of the tests none of the four is slow (docs/statistics.md). An interval that does not have its stated
coverage is not given. The interval of the median between two order statistics holds for any distribution.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable

import numpy as np
import numpy.typing as npt

from cdtool.statistics.interval import Interval
from cdtool.statistics.kaplan_meier import latency_quantile

# Below so many independent recordings or campaigns a mean, a standard deviation or a P95 has no interval.
FEWEST = 10


def too_few(clusters: int) -> str:
    """Return why a mean has no interval; empty if it has one.

    Parameters
    ----------
    clusters : int
        Number of recordings or campaigns.

    Returns
    -------
    str
        The reason.

    Examples
    --------
    >>> too_few(4), too_few(10)
    ('an interval needs 10 recordings or campaigns; there are 4', '')
    """
    if clusters >= FEWEST:
        return ""
    return f"an interval needs {FEWEST} recordings or campaigns; there are {clusters}"


def median_rank(n: int, level: float = 0.95) -> int:
    """Return the rank of the order statistics between which the median of any distribution lies.

    Parameters
    ----------
    n : int
        Number of contacts.
    level : float
        Confidence level.

    Returns
    -------
    int
        The largest r with P(X_(r) <= median <= X_(n + 1 - r)) >= level; 0 without one.

    Notes
    -----
    The largest r with P(B <= r - 1) <= (1 - level) / 2, B binomial with n contacts and share 1/2. At 95 %: r = 1 for 6
    to 8 contacts (96.9, 98.4, 99.2 %), r = 2 for 9 (96.1 %), none for 5 (their whole range holds 93.8 %).

    Examples
    --------
    >>> [median_rank(n) for n in (4, 5, 6, 8, 9)]
    [0, 0, 1, 1, 2]
    """
    rank, below = 0, 0.0
    while 2 * rank < n:
        below += math.comb(n, rank) / 2**n
        if below > 0.5 - 0.5 * level:
            break
        rank += 1
    return rank


def median_of(
    latency: npt.ArrayLike, censored: npt.ArrayLike, labels: Iterable[Hashable], level: float = 0.95
) -> Interval:
    """Return the median latency, with an interval that is valid for this number of contacts.

    Parameters
    ----------
    latency : array_like of float, shape (n,)
        Latency of each contact in any unit of time; of a missed contact the time for which it was monitored.
    censored : array_like of bool, shape (n,)
        True if the contact was missed.
    labels : iterable of hashable, length n
        The recording or test campaign of each contact.
    level : float
        Confidence level.

    Returns
    -------
    Interval
        In the unit of the latencies. No interval with fewer than 6 contacts, nor if the contacts are from fewer
        than 10 recordings and one recording has several: contacts of one recording are similar.

    Raises
    ------
    UsageError
        The lengths differ, a latency is below 0 or not finite, or the level is not between 0 and 1.

    Notes
    -----
    The value is that of `latency_quantile`. With 10 contacts or more, so is the interval. With fewer, it extends
    between the order statistics of rank r = `median_rank` and n + 1 - r, exact for any distribution: in the lower bound
    a missed contact counts with the time for which it was monitored, in the upper bound it is later than all others.

    Examples
    --------
    >>> median = median_of([31.0, 33.0, 30.0, 35.0, 32.0, 34.0], [False] * 6, range(6))
    >>> median.value, median.low, median.high
    (32.5, 30.0, 35.0)
    """
    found = latency_quantile(latency, censored, 0.5, level)
    times, missed = np.asarray(latency, dtype=np.float64), np.asarray(censored, dtype=np.bool_)
    n, clusters = len(times), len(set(labels))
    if not n:
        return found
    if clusters < min(n, FEWEST):
        return _without(found, f"{too_few(clusters)}, and contacts of one recording are correlated")
    if n >= FEWEST:
        return found
    rank = median_rank(n, level)
    if not rank:
        return _without(found, f"an interval of the median needs 6 contacts; there are {n}")
    low, high = np.sort(times)[rank - 1], np.sort(np.where(missed, np.inf, times))[n - rank]
    return Interval(found.value, float(low), float(high), level)


def p95_of(
    latency: npt.ArrayLike, censored: npt.ArrayLike, labels: Iterable[Hashable], level: float = 0.95
) -> Interval:
    """Return the P95 of the latency, without an interval below 10 recordings or campaigns.

    Parameters
    ----------
    latency : array_like of float, shape (n,)
        Latency of each contact in any unit of time; of a missed contact the time for which it was monitored.
    censored : array_like of bool, shape (n,)
        True if the contact was missed.
    labels : iterable of hashable, length n
        The recording or test campaign of each contact.
    level : float
        Confidence level.

    Returns
    -------
    Interval
        In the unit of the latencies.

    Raises
    ------
    UsageError
        The lengths differ, a latency is below 0 or not finite, or the level is not between 0 and 1.

    Notes
    -----
    See `latency_quantile`.

    Examples
    --------
    >>> p95 = p95_of([30.0, 31.0, 32.0, 39.0], [False] * 4, range(4))
    >>> p95.value, p95.reason
    (39.0, 'an interval needs 10 recordings or campaigns; there are 4')
    """
    found = latency_quantile(latency, censored, 0.95, level)
    reason = too_few(len(set(labels))) if found.known else ""
    return _without(found, reason) if reason else found


def _without(figure: Interval, reason: str) -> Interval:
    return Interval(figure.value, math.nan, math.nan, figure.level, reason)
