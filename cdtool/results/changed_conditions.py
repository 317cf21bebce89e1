"""How a detector performs when the machine has changed: its results under each condition with the unchanged ones.

Conventions: a condition is compared with the unchanged machine group by group, with the same thresholds. Recordings of
a condition count in no other statistic.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from cdtool.results.evaluated import Evaluated
from cdtool.results.results import ExposureResult
from cdtool.results.summary import Summary
from cdtool.statistics.interval import Interval
from cdtool.statistics.rates import binomial_share


@dataclass(frozen=True)
class OnMachine:
    """The results of one detector on the machine in one state, in the groups of impacts and impact-free runs.

    `struck` has the groups of impacts by the name that they have on the unchanged machine. `free` is None without
    impact-free runs. `not_assessable_share` is of the samples of all these groups, each weighted by its operations; NaN
    without any.
    """

    free: Summary | None
    struck: Mapping[str, Summary]
    not_assessable_share: float

    @property
    def alarming(self) -> tuple[int, int]:
        """Return how many of how many assessable impact-free operations have a false alarm."""
        return (self.free.alarming, self.free.judged_operations) if self.free else (0, 0)

    @property
    def alarming_share(self) -> Interval:
        """Return the share of alarming impact-free operations with its 95 % interval; NaN without any."""
        return binomial_share(*self.alarming)

    @property
    def missed(self) -> tuple[int, int]:
        """Return how many of how many assessable contacts were missed, in all groups of impacts."""
        return sum(item.missed for item in self.struck.values()), sum(item.assessable for item in self.struck.values())

    @property
    def not_assessable(self) -> tuple[int, int]:
        """Return how many of how many contacts were not assessable, in all groups of impacts."""
        rows = self.struck.values()
        return sum(item.not_assessable for item in rows), sum(item.contacts for item in rows)


@dataclass(frozen=True)
class ConditionRow:
    """One detector under one changed condition, and the same groups of the unchanged machine."""

    detector: str
    condition: str
    changed: OnMachine
    unchanged: OnMachine

    def latency(self, group: str) -> tuple[Interval, Interval | None, str]:
        """Return the latency [ms] in a group of impacts, that of the unchanged machine, and which statistic both are.

        It is the mean of the detected contacts, or the median if either has fewer than ten of them. The second is None
        if the unchanged machine has no contact there.
        """
        changed, before = self.changed.struck[group], self.unchanged.struck.get(group)
        if changed.few or (before is not None and before.few):
            return changed.median, before.median if before else None, "median"
        return changed.mean, before.mean if before else None, "mean"


def condition_rows(evaluated: Evaluated) -> list[ConditionRow]:
    """Return every detector under every changed condition, condition by condition in the order of the benchmark file.

    Parameters
    ----------
    evaluated : Evaluated
        The results of a benchmark with their statistics.

    Returns
    -------
    list of ConditionRow
        Empty if the benchmark file has no [conditions].

    Examples
    --------
    `cdtool.benchmark` returns evaluated results.
    """
    results = evaluated.results
    summaries = {(item.detector, item.group): item for item in (*evaluated.summaries, *evaluated.conditions)}
    exposures = {(item.detector, item.group): item for item in results.exposure}

    def on_machine(detector: str, free: str | None, struck: Mapping[str, str]) -> OnMachine:
        found = {name: summaries.get((detector, group)) for name, group in struck.items()}
        names = (*struck.values(), *([free] if free else []))
        return OnMachine(
            summaries.get((detector, free)) if free else None,
            {name: item for name, item in found.items() if item is not None},
            _share([exposures[detector, name] for name in names if (detector, name) in exposures]),
        )

    rows = []
    for condition in dict.fromkeys(item.condition for item in results.conditions):
        groups = [item for item in results.conditions if item.condition == condition]
        free = next((item for item in groups if item.impact_free), None)
        struck = {item.counterpart: item.group for item in groups if not item.impact_free}
        for detector in results.detectors:
            changed = on_machine(detector, free.group if free else None, struck)
            before = on_machine(detector, free.counterpart if free else None, {name: name for name in struck})
            rows.append(ConditionRow(detector, condition, changed, before))
    return rows


def _share(exposures: Sequence[ExposureResult]) -> float:
    operations = sum(item.operations for item in exposures)
    if not operations:
        return math.nan
    return sum(item.operations * sum(item.not_judged.values()) for item in exposures) / operations  # language: data
