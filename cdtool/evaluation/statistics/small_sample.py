"""Intervals that few contacts allow: none for a mean below ten recordings, an exact one for the median of six or more.

Conventions: the 95 % bootstrap interval of a mean holds the true mean in about 80 of 100 tests with four contacts, and
in 47 where 15 % of the contacts are slow: none of the four is slow in half of the tests (docs/statistics.md). An
interval that does not hold what it says is not given. The interval between two order statistics of the median holds for
any distribution.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable

import numpy as np
import numpy.typing as npt

from cdtool.evaluation.statistics.interval import Interval
from cdtool.evaluation.statistics.kaplan_meier import latency_quantile

# Below so many independent recordings or campaigns a mean, a standard deviation or a P95 has no interval.
FEWEST = 10


def too_few(clusters: int) -> str:
    """Why a mean of so many recordings or campaigns has no interval; empty where it has one."""
    if clusters >= FEWEST:
        return ""
    return f"an interval needs {FEWEST} recordings or campaigns; there are {clusters}"


def median_rank(n: int, level: float = 0.95) -> int:
    """Rank r with P(X_(r) <= median <= X_(n + 1 - r)) >= level for any distribution; 0 if no rank does.

    The largest r with P(B <= r - 1) <= (1 - level) / 2, B binomial with n contacts and share 1/2. At 95 %: r = 1 for 6
    to 8 contacts (96.9, 98.4, 99.2 %), r = 2 for 9 (96.1 %), none for 5 (their whole range holds 93.8 %).

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
    """Median latency as `latency_quantile` defines it, with an interval that holds for so many contacts.

    `latency` (n,), `censored` (n,) True where the contact was missed, `labels` (n,) its recording or campaign. With 10
    or more contacts the interval is that of Kaplan and Meier. Below, it is that between the order statistics of rank
    r = `median_rank` and n + 1 - r: exact for any distribution. A missed contact counts from the time that it was
    watched in the lower bound, and is later than all in the upper one. None with fewer than 6 contacts, nor where fewer
    than 10 recordings hold several contacts each: those of one recording are alike. Raises UsageError as
    `latency_quantile` does.
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
    """P95 of the latency as `latency_quantile` defines it; without an interval below 10 recordings or campaigns."""
    found = latency_quantile(latency, censored, 0.95, level)
    reason = too_few(len(set(labels))) if found.known else ""
    return _without(found, reason) if reason else found


def _without(figure: Interval, reason: str) -> Interval:
    return Interval(figure.value, math.nan, math.nan, figure.level, reason)
