"""Is one detector better than another on the same impacts? Paired, with Holm's correction over a group's questions."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

from cdtool.base.errors import UsageError
from cdtool.results.results import ContactResult, Results, grouped
from cdtool.results.summary import campaigns
from cdtool.statistics.paired import Difference, holm, mcnemar_p, paired_difference

# A difference counts as shown below this, after correction.
SIGNIFICANT = 0.05
# Below this, the confidence (1 minus the level) cannot be distinguished from 1.
_LEAST_LEVEL = 1e-9

Key = tuple[str, int]


Pair = tuple[ContactResult, ContactResult]


def check_significance(level: float) -> None:
    """Check a significance level.

    Parameters
    ----------
    level : float
        The level.

    Raises
    ------
    UsageError
        It is not between 1e-9 and 0.5.

    Examples
    --------
    >>> check_significance(0.05)
    """
    if not _LEAST_LEVEL <= level < 0.5:
        hint = "give a share of at least 0.000000001 and below 0.5, such as 0.05"
        raise UsageError(f"significance level is {level:g}", hint)


@dataclass(frozen=True)
class Comparison:
    """Two detectors on the contacts of one group that both could assess.

    `latency` [ms] is first minus second over the contacts that both detected; `only_first_missed` and
    `only_second_missed` count the others. All p are corrected (Holm) over all pairs of the group, latency and misses
    together.
    """

    group: str
    first: str
    second: str
    contacts: int
    latency: Difference
    latency_p: float
    only_first_missed: int
    only_second_missed: int
    missed_p: float

    @property
    def faster(self) -> str | None:
        """The detector that is shown to be faster."""
        if not self.latency_p < SIGNIFICANT:
            return None
        return self.first if self.latency.mean.value < 0.0 else self.second

    @property
    def misses_less(self) -> str | None:
        """The detector that is shown to miss fewer contacts."""
        if not self.missed_p < SIGNIFICANT:
            return None
        return self.first if self.only_first_missed < self.only_second_missed else self.second


def compare_detectors(results: Results) -> list[Comparison]:
    """Return every pair of detectors in every group of impacts, in the order of the benchmark file."""
    clusters = campaigns(results)
    of_group = grouped(results.scored_contacts, "group", "detector")
    found: list[Comparison] = []
    for group in results.groups:
        rows = {
            name: {(item.recording, item.contact): item for item in of_group[group, name]}
            for name in results.detectors
            if (group, name) in of_group
        }
        made = [
            _compare(group, first, second, rows[first], rows[second], clusters)
            for first, second in combinations(rows, 2)
        ]
        found += _corrected([item for item in made if item.contacts])
    return found


def _pairs_of(first: Mapping[Key, ContactResult], second: Mapping[Key, ContactResult]) -> list[Pair]:
    """Return the contacts that both could assess."""
    both = [(item, second[key]) for key, item in first.items() if key in second]
    return [pair for pair in both if all(item.outcome != "not_assessable" for item in pair)]


def _latency_difference(pairs: Sequence[Pair], clusters: Mapping[str, str]) -> Difference:
    """Return the latency [ms] of the first minus that of the second, over the contacts that both detected."""
    differences, labels = [], []
    for first, second in pairs:
        if first.latency_ms is not None and second.latency_ms is not None:
            differences.append(first.latency_ms - second.latency_ms)
            labels.append(clusters.get(first.recording, first.recording))
    return paired_difference(differences, labels)


def _only_one_missed(pairs: Sequence[Pair]) -> tuple[int, int]:
    """Return how many contacts only the first missed, and how many only the second."""
    missed = [(first.outcome == "missed", second.outcome == "missed") for first, second in pairs]
    return missed.count((True, False)), missed.count((False, True))


def _compare(
    group: str,
    first: str,
    second: str,
    rows: Mapping[Key, ContactResult],
    others: Mapping[Key, ContactResult],
    clusters: Mapping[str, str],
) -> Comparison:
    pairs = _pairs_of(rows, others)
    difference = _latency_difference(pairs, clusters)
    only = _only_one_missed(pairs)
    missed_p = mcnemar_p(*only) if sum(only) else math.nan
    return Comparison(group, first, second, len(pairs), difference, difference.p, *only, missed_p)


def _corrected(comparisons: Sequence[Comparison]) -> list[Comparison]:
    count = len(comparisons)
    adjusted = holm([item.latency_p for item in comparisons] + [item.missed_p for item in comparisons])
    return [
        replace(item, latency_p=float(adjusted[i]), missed_p=float(adjusted[count + i]))
        for i, item in enumerate(comparisons)
    ]
