"""Search a detector's gains: each one times and divided by a factor, which is reduced when nothing helps."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields
from typing import Any

from cdtool.commands.tune.search.candidate import Candidate

# The first factor; the last one is the smallest that is tried. The number of evaluations is limited.
_FIRST, _LAST = 2.0, 2.0**0.5
# The number of evaluations of one search is limited: each of them runs on all recordings.
EVALUATIONS = 40
# A gain is not moved further from where it began than by this factor.
FARTHEST = 32.0


@dataclass
class CoordinateSearch:
    """A coordinate search in the logarithms of gains, asked for candidates and given their scores.

    It begins at `best`, whose score is known. `names` are the gains that are moved.
    """

    best: Candidate
    score: float
    names: tuple[str, ...]
    step: float = _FIRST
    evaluated: int = 0
    _scores: dict[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._first = self.best
        self._scores[self.best.key] = self.score

    def ask(self) -> list[Candidate]:
        """Return the candidates whose scores are needed next; empty at the end."""
        while self.step >= _LAST - 1e-9 and self.names and self.evaluated < EVALUATIONS:
            around = [item for item in self._around() if item.key not in self._scores]
            if around:
                return around[: EVALUATIONS - self.evaluated]
            self._advance()
        return []

    def tell(self, scores: dict[str, float]) -> None:
        """Take the scores of the candidates asked for, by their keys; infinite for one that cannot be used."""
        self._scores |= scores
        self.evaluated += len(scores)
        self._advance()

    def _advance(self) -> None:
        """Move to the best neighbour, or reduce the step if none is better."""
        around = min(self._around(), key=lambda item: self._scores.get(item.key, math.inf), default=None)
        found = math.inf if around is None else self._scores.get(around.key, math.inf)
        if around is not None and found < self.score - 1e-2:  # 1 % of the cost: less is none
            self.best, self.score = around, found
        else:
            self.step = math.sqrt(self.step)

    def _around(self) -> list[Candidate]:
        """Return the neighbours of the best candidate, none of them too far from the beginning."""
        found = []
        for name in self.names:
            for factor in (self.step, 1.0 / self.step):
                moved = self.best.with_gain(name, factor)
                ratio = _size(moved, name) / _size(self._first, name)
                if 1.0 / FARTHEST <= ratio <= FARTHEST:
                    found.append(moved)
        return found


def _size(candidate: Candidate, name: str) -> float:
    value = dict(candidate.gains)[name]
    return float(value[0] if isinstance(value, tuple) else value)


def movable_gains(detector: Any, candidate: Candidate) -> tuple[str, ...]:
    """Return the names of the gains that are searched: numbers above 0 that the detector does not leave out."""
    left_out = {item.name for item in fields(detector) if not item.metadata.get("searched", True)}
    found = []
    for name, value in candidate.gains:
        values = value if isinstance(value, tuple) else (value,)
        if (
            name not in left_out
            and values
            and all(isinstance(item, float) and 0.0 < item < math.inf for item in values)
        ):
            found.append(name)
    return tuple(found)
