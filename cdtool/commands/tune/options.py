"""How detectors are tuned: the settings of `cdtool tune`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import KW_ONLY, dataclass
from pathlib import Path

from cdtool.base.errors import UsageError, nearest
from cdtool.commands.tune.search.grid import SHORTEST_DEBOUNCE
from cdtool.commands.tune.search.objective import WORSE_AT_MOST, Goal
from cdtool.execution.workers import Progress, Workers
from cdtool.results.curves.false_alarm_budget import Budget
from cdtool.thresholds import THRESHOLDS

# Which contacts a detector is tuned on.
IMPACTS = ("real", "injected", "both")
# Called after each round of a search: the detector, the candidates measured so far, and the best so far in words.
Watch = Callable[[str, int, str], None]


def unwatched(detector: str, count: int, best: str) -> None:
    """Ignore a round of a search."""


@dataclass(frozen=True)
class TuningOptions:
    """How detectors are tuned: what `cdtool.tune` describes. Raises UsageError for what is unknown or out of range."""

    false_alarm_budget: str
    _: KW_ONLY
    detectors: Sequence[str] = ()
    thresholds: Sequence[str] = ()
    objective: str = Goal.LATENCY.value
    impacts: str | None = None
    worse_at_most: float = WORSE_AT_MOST
    shortest_debounce: float = SHORTEST_DEBOUNCE
    seed: int = 0
    journals: Path | None = None
    workers: Workers | None = None
    progress: Progress | None = None
    watch: Watch = unwatched

    def __post_init__(self) -> None:
        Budget.parse(self.false_alarm_budget)
        choices = {
            "objective": (self.objective, [item.value for item in Goal]),
            "impacts": (self.impacts or IMPACTS[0], IMPACTS),
            **{f"threshold {name}": (name, THRESHOLDS.usable_names()) for name in self.thresholds},
        }
        for what, (given, known) in choices.items():
            if given not in known:
                words = f"unknown threshold '{given}'" if what.startswith("threshold ") else f"{what} is '{given}'"
                raise UsageError(words, nearest(given, known))
        for what, value in (("worse_at_most", self.worse_at_most), ("shortest_debounce", self.shortest_debounce)):
            if not 0.0 <= value < float("inf"):
                raise UsageError(f"{what} is {value:g}", "give 0 or more")

    @property
    def budget(self) -> Budget:
        """Return the false-alarm budget."""
        return Budget.parse(self.false_alarm_budget)

    @property
    def goal(self) -> Goal:
        """Return what is minimised."""
        return Goal(self.objective)
