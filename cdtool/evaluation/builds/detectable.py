"""Which change of two builds a test would have shown, at a given p: with 80 % power of a mean, or the least count.

Conventions: infinite where no change could have been shown.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from cdtool.evaluation.statistics.bootstrap import RESAMPLES
from cdtool.evaluation.statistics.sample_size import detectable_difference
from cdtool.evaluation.statistics.spread import Spread

POWER = 0.8


def paired_detectable(spread: Spread) -> Callable[[float], float]:
    """Return the least mean difference of pairs with this spread that the sign-flip test shows at a given p."""
    k = spread.clusters
    patterns = 2**k if k <= 13 else math.inf

    def least(alpha: float) -> float:
        return _detectable(k, spread.std, alpha, patterns)

    return least


def unpaired_detectable(old: Spread, new: Spread) -> Callable[[float], float]:
    """Return the least difference of two means that the permutation test shows at a given p.

    A t-test with k_a + k_b - 2 degrees of freedom is one of k_a + k_b - 1 differences: only the error differs.
    """
    k = old.clusters + new.clusters - 1
    std = math.hypot(old.error, new.error) * math.sqrt(k)
    divisions = math.comb(old.clusters + new.clusters, old.clusters)

    def least(alpha: float) -> float:
        return _detectable(k, std, alpha, divisions)

    return least


def _detectable(n: int, std: float, alpha: float, patterns: float) -> float:
    """What a test with so many equally likely patterns shows at `alpha`; their number bounds its p from below."""
    lowest_p = 2.0 / patterns if patterns <= RESAMPLES else 2.0 / (RESAMPLES + 1)
    if lowest_p >= alpha or math.isnan(std):
        return math.inf
    return detectable_difference(n, std, POWER, 1.0 - alpha) if std > 0.0 else 0.0


def least_count(p_of: Callable[[int], float], start: int, most: int) -> Callable[[float], float]:
    """The least count above `start`, where p is largest, whose p is below alpha; infinite above `most`."""

    def least(alpha: float) -> float:
        below, above = start, start + 1
        while above <= most and p_of(above) >= alpha:
            below, above = above, (min(2 * above, most) if above < most else most + 1)
        if above > most:
            return math.inf
        while above - below > 1:
            middle = (above + below) // 2
            below, above = (middle, above) if p_of(middle) >= alpha else (below, middle)
        return above

    return least
