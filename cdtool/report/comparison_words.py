"""What a pair of detectors shows: a difference, none, or that there were too few recordings to show one."""

from __future__ import annotations

import math
from collections.abc import Sequence

from cdtool.evaluation.comparison import SIGNIFICANT, Comparison
from cdtool.evaluation.statistics.paired import holm

NONE_SHOWN = "no difference shown"
TOO_FEW = "too few recordings to show one"


def without_finding(comparisons: Sequence[Comparison]) -> list[str]:
    """For each comparison "" where it shows a difference, else NONE_SHOWN or TOO_FEW; in the same order."""
    too_few: dict[int, bool] = {}
    for group in dict.fromkeys(item.group for item in comparisons):
        places = [i for i, item in enumerate(comparisons) if item.group == group]
        too_few |= dict(zip(places, _too_few([comparisons[i] for i in places]), strict=True))
    return [
        "" if item.faster or item.misses_less else TOO_FEW if too_few[i] else NONE_SHOWN
        for i, item in enumerate(comparisons)
    ]


def _too_few(group: Sequence[Comparison]) -> list[bool]:
    """Whether no outcome could have come below the limit: each question of a group with its least p, then Holm's.

    Least p: 2 / 2^k of k recordings for latency, of k contacts for misses. A corrected p only falls where others do.
    """
    latency = [_least_p(item.latency.clusters) if item.latency.clusters > 1 else math.nan for item in group]
    asked = [not math.isnan(item.missed_p) or not item.latency.n for item in group]
    missed = [_least_p(item.contacts) if known else math.nan for item, known in zip(group, asked, strict=True)]
    least = holm(latency + missed)
    return [not (least[i] < SIGNIFICANT or least[len(group) + i] < SIGNIFICANT) for i, item in enumerate(group)]


def _least_p(count: int) -> float:
    return float(min(1.0, 2.0 ** (1 - count)))
