"""The search for one detector: a grid of rules, then gains, for all recordings and again without each of their folds.

What is chosen without a fold is assessed on it: these nested results are from recordings not used for the choice.
All of these searches share what is measured; a search chooses among the candidates that it asked for itself.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.commands.tune.search.candidate import Candidate, Measured
from cdtool.commands.tune.search.coordinate_search import CoordinateSearch
from cdtool.commands.tune.search.objective import Objective

# The gains are searched for so many rules, those with the best settings of different kinds: with all recordings, and
# without a fold. A search without a fold finds no more than one with all, so that nested results are on the safe side.
_RULES, _RULES_WITHOUT_FOLD = 3, 1
# Measures candidates, in their order.
Measure = Callable[[Sequence[Candidate]], Sequence[Measured]]


@dataclass(frozen=True)
class Scored:
    """A candidate with the number of its debounce, and its costs and score on a subset of the recordings."""

    candidate: Candidate
    debounce: int
    costs: FloatArray
    score: float


@dataclass
class SubsetSearch:
    """What a search on one subset of the recordings asked for, and its default."""

    subset: int
    objective: Objective
    default: Scored
    known: dict[str, list[Scored]] = field(default_factory=dict)

    def take(self, candidate: Candidate, measured: Measured) -> None:
        """Score a candidate with each debounce."""
        found = []
        for debounce in range(len(measured.factors)):
            costs = self.objective.costs(measured, debounce, self.subset)
            found.append(Scored(candidate, debounce, costs, self.objective.score(costs)))
        self.known[candidate.key] = found

    def best_of(self, key: str) -> Scored | None:
        """Return the best acceptable debounce of a candidate."""
        usable = [item for item in self.known.get(key, ()) if self._is_acceptable(item)]
        return min(usable, key=lambda item: item.score, default=None)

    @property
    def best(self) -> Scored:
        """Return the best of all; the default if nothing else is acceptable and better."""
        return self.best_without(())

    def best_without(self, rules: Collection[str]) -> Scored:
        """Return the best whose kind of rule is none of these; the default if nothing is acceptable and better."""
        found = [item for key in self.known if (item := self.best_of(key)) is not None]
        allowed = [item for item in found if item.candidate.rule.name not in rules]
        return min((self.default, *allowed), key=lambda item: item.score)

    def best_rules(self, count: int) -> list[Scored]:
        """Return the best of each kind of rule, so many of them."""
        ranked = sorted(
            (item for key in self.known if (item := self.best_of(key)) is not None), key=lambda item: item.score
        )
        kinds: dict[str, Scored] = {}
        for item in ranked:
            kinds.setdefault(item.candidate.rule.name, item)
        return list(kinds.values())[:count]

    def _is_acceptable(self, item: Scored) -> bool:
        return math.isfinite(item.score) and self.objective.is_acceptable(item.costs, self.default.costs)


@dataclass(frozen=True)
class Searched:
    """The searches of one detector by subset, everything that was measured, and the default."""

    subsets: tuple[SubsetSearch, ...]
    measured: dict[str, Measured]
    default: Candidate

    @property
    def best(self) -> Scored:
        """Return the choice of all recordings."""
        return self.subsets[0].best


def search(
    default: Candidate,
    rules: Sequence[Candidate],
    gains: tuple[str, ...],
    objective: Objective,
    measure: Measure,
) -> Searched:
    """Search for the best candidate on all recordings, and without each fold.

    Parameters
    ----------
    default : Candidate
        What the benchmark file has, with the first of the debounces.
    rules : sequence of Candidate
        The first part of the search, with the default gains.
    gains : tuple of str
        The names of the gains that are searched.
    objective : Objective
        What is minimised.
    measure : callable
        Measures candidates.

    Returns
    -------
    Searched
        The searches. If the default cannot be used, every subset has an infinite default score.

    Examples
    --------
    `cdtool.commands.tune` searches the detectors of a benchmark file with it.
    """
    known: dict[str, Measured] = {}

    def measured(candidates: Sequence[Candidate]) -> None:
        new = list({item.key: item for item in candidates if item.key not in known}.values())
        for item, made in zip(new, measure(new), strict=True):
            known[item.key] = made

    measured([default, *rules])
    subsets = []
    for subset in range(objective.recordings.subsets):
        made = SubsetSearch(subset, objective, _scored(default, known, objective, subset))
        for candidate in (default, *rules):
            made.take(candidate, known[candidate.key])
        subsets.append(made)
    running: list[tuple[SubsetSearch, CoordinateSearch]] = [
        (item, CoordinateSearch(start.candidate, start.score, gains))
        for item in subsets
        for start in item.best_rules(_RULES_WITHOUT_FOLD if item.subset else _RULES)
    ]
    while running:
        asked = [(item, own, own.ask()) for item, own in running]
        measured([candidate for _, _, wanted in asked for candidate in wanted])
        for item, own, wanted in asked:
            for candidate in wanted:
                item.take(candidate, known[candidate.key])
            if wanted:
                scores = {one.key: item.best_of(one.key) for one in wanted}
                own.tell({key: math.inf if made is None else made.score for key, made in scores.items()})
        running = [(item, own) for item, own, wanted in asked if wanted]
    return Searched(tuple(subsets), known, default)


def _scored(candidate: Candidate, known: dict[str, Measured], objective: Objective, subset: int) -> Scored:
    made = known[candidate.key]
    if made.reason:
        return Scored(candidate, 0, np.full(len(objective.recordings.groups), np.nan), math.inf)
    costs = objective.costs(made, 0, subset)
    return Scored(candidate, 0, costs, objective.score(costs))
