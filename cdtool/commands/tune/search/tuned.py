"""The result of tuning a detector: the choice with its results, what led to it, and how sure it is."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.commands.tune.search.candidate import Candidate
from cdtool.commands.tune.search.held_out import Pooled
from cdtool.commands.tune.search.objective import Objective
from cdtool.commands.tune.search.search import Scored, Searched
from cdtool.statistics.interval import Interval
from cdtool.statistics.rates import binomial_share
from cdtool.statistics.spread import mean_interval

# An optimum is flat where the cost is at most this share above the best.
FLAT = 0.05


@dataclass(frozen=True)
class GroupResults:
    """The latencies of a group's contacts [ms]: mean with its 95 % interval, 95th percentile, force at the alarm [N].

    A missed contact counts as its window in mean, range and percentile. The interval has no bounds below 10 contacts.
    """

    contacts: int
    missed: int
    not_assessable: int
    mean_ms: float
    interval_ms: Interval
    range_ms: tuple[float, float]
    p95_ms: float
    force_n: float


@dataclass(frozen=True)
class ChoiceResults:
    """What a choice gives: by group, and the number of impact-free operations that alarm.

    `alarm_share`: their share, with its exact 95 % interval.
    """

    groups: dict[str, GroupResults]
    alarming: int
    free: int
    alarm_share: Interval
    score: float
    costs: FloatArray


@dataclass(frozen=True)
class TriedValue:
    """One value of a setting with everything else as chosen: its cost over that of the choice."""

    value: float
    cost_ratio: float


@dataclass(frozen=True)
class Sensitivity:
    """What a gain or a setting does around the choice.

    `flat_from` to `flat_to` are the tried values with at most 5 % more cost, `is_at_edge`: the choice is the largest or
    smallest value that was tried, and its neighbour is worse.
    """

    name: str
    chosen: float
    tried: tuple[TriedValue, ...]

    @property
    def flat_from(self) -> float:
        """Return the smallest value of the flat part."""
        return min(item.value for item in self._flat)

    @property
    def flat_to(self) -> float:
        """Return the largest value of the flat part."""
        return max(item.value for item in self._flat)

    @property
    def is_at_edge(self) -> bool:
        """Whether values beyond those tried may be better."""
        values = sorted(self.tried, key=lambda item: item.value)
        if len(values) < 2 or self.chosen not in (values[0].value, values[-1].value):
            return False
        neighbour = values[1] if self.chosen == values[0].value else values[-2]
        # Where the neighbour is hardly worse, the edge does not matter.
        return neighbour.cost_ratio > 1.01

    @property
    def _flat(self) -> list[TriedValue]:
        """Return the tried values around the choice, without a worse one between, that cost at most 5 % more."""
        values = sorted(self.tried, key=lambda item: item.value)
        at = next(number for number, item in enumerate(values) if item.value == self.chosen)
        first = last = at
        while first > 0 and values[first - 1].cost_ratio <= 1.0 + FLAT:
            first -= 1
        while last + 1 < len(values) and values[last + 1].cost_ratio <= 1.0 + FLAT:
            last += 1
        return values[first : last + 1]


@dataclass(frozen=True)
class Rejection:
    """A kind of rule that was best but is not chosen: on recordings not used for the choice, a group is much worse.

    `ratio` is the cost of the group over that of the default.
    """

    rule: str
    group: str
    ratio: float


@dataclass(frozen=True)
class TunedDetector:
    """A detector with the choice, its debounce and the safety factor that meets the budget.

    `correction`: what the factor was multiplied by, because it was set on the runs used for the choice; 1 if nothing
    shows that.

    `apparent` results are from the recordings used for the choice, each assessed without its fold; `nested` those of
    recordings not used for the choice, None if there are too few runs; `default` and `default_nested` those of what the
    benchmark file has, at the same budget, None if it cannot be used: `default_reason`. `chosen_in_folds` are the
    choices without each fold, in words. `debounce` [samples] is None for the default of 9 ms.
    `why_not_nested`: why there is no nested result.
    """

    detector: str
    short_name: str
    default: Candidate
    choice: Candidate
    debounce: int | None
    factor: float
    correction: float
    apparent: ChoiceResults
    nested: ChoiceResults | None
    default_apparent: ChoiceResults | None
    default_nested: ChoiceResults | None
    default_reason: str
    sensitivities: tuple[Sensitivity, ...]
    candidates: int
    unusable: dict[str, str]
    chosen_in_folds: tuple[str, ...]
    rejected: tuple[Rejection, ...] = ()
    why_not_nested: str = ""

    @property
    def honest(self) -> ChoiceResults:
        """Return the nested results, the apparent ones if there is no such result."""
        return self.nested or self.apparent


def results_of(
    objective: Objective,
    latency: FloatArray,
    force: FloatArray,
    assessable: np.ndarray[Any, np.dtype[np.bool_]],
    counts: tuple[int, int],
) -> ChoiceResults:
    """Return the results of latencies [s] and forces [N] of all contacts (C,); `counts`: alarming and free runs."""
    recordings = objective.recordings
    everything = np.ones(len(latency), dtype=bool)
    values = 1e3 * np.where(np.isnan(latency), recordings.window_of, latency)
    found = {}
    for number, name in enumerate(recordings.groups):
        own = recordings.group_of == number
        missed = np.isnan(latency[own]) & assessable[own]
        known = force[own][np.isfinite(force[own])]
        found[name] = GroupResults(
            int(own.sum()),
            int(missed.sum()),
            int((~assessable[own]).sum()),
            float(np.mean(values[own])),
            mean_interval(values[own], range(int(own.sum()))),
            (float(np.min(values[own])), float(np.max(values[own]))),
            float(np.quantile(values[own], 0.95)),
            float(np.mean(known)) if len(known) else math.nan,
        )
    costs = objective.costs_of(latency, force, everything)
    return ChoiceResults(found, *counts, binomial_share(*counts), objective.score(costs), costs)


def held_out_results(objective: Objective, made: Pooled | None) -> ChoiceResults | None:
    """Return the results of all folds together; None if one could not be assessed."""
    if made is None:
        return None
    counts = (made.alarming, made.free)
    return results_of(objective, made.latency, made.force, made.assessable, counts)


def apparent_results(objective: Objective, searched: Searched, item: Scored) -> ChoiceResults | None:
    """Return the results of a candidate on the recordings used to choose it; None if it cannot be used."""
    measured = searched.measured[item.candidate.key]
    if measured.reason:
        return None
    at = item.debounce, 0
    counts = (int(measured.alarming[at]), len(objective.recordings.free))
    return results_of(objective, measured.latency[at], measured.force[at], measured.assessable, counts)


def settings_of(candidate: Candidate, gains: Sequence[str]) -> dict[str, Any]:
    """Return the settings of the rule that are searched, and these gains, by name: numbers or tuples of them."""
    searched = getattr(candidate.rule, "searched", {})
    own = dict(candidate.gains)
    return {**{name: getattr(candidate.rule, name) for name in searched}, **{name: own[name] for name in gains}}


def sensitivities_of(
    searched: Searched, best: Scored, debounces: Sequence[int], gains: Sequence[str]
) -> tuple[Sensitivity, ...]:
    """Return what each searched gain and setting does around the choice, from what the search has tried.

    A setting of which no other value was tried with the others as chosen has one value only.
    """
    found = searched.subsets[0]
    chosen = settings_of(best.candidate, gains)
    tried: dict[str, dict[float, float]] = {name: {} for name in chosen}
    for scored in found.known.values():
        for item in scored:
            if item.debounce != best.debounce or not math.isfinite(item.score):
                continue
            if item.candidate.rule.name != best.candidate.rule.name:
                continue
            other = settings_of(item.candidate, gains)
            different = [name for name in chosen if other[name] != chosen[name]]
            for name in chosen if not different else different[:1] if len(different) == 1 else ():
                tried[name][_number(other[name])] = math.exp(item.score - best.score)
    made = [
        Sensitivity(name, _number(chosen[name]), tuple(TriedValue(*pair) for pair in sorted(values.items())))
        for name, values in tried.items()
        if values
    ]
    of_debounce = {
        float(debounces[item.debounce]): math.exp(item.score - best.score)
        for item in found.known[best.candidate.key]
        if math.isfinite(item.score)
    }
    own = float(debounces[best.debounce])
    made.append(Sensitivity("debounce", own, tuple(TriedValue(*pair) for pair in sorted(of_debounce.items()))))
    return tuple(made)


def _number(value: Any) -> float:
    return float(value[0] if isinstance(value, tuple) else value)
