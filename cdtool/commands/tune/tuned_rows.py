"""What tuning achieved as rows: one per detector and group, beside what the benchmark file has."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from cdtool.commands.tune.search.tuned import ChoiceResults, TunedDetector


@dataclass(frozen=True)
class TunedRow:
    """The results of a tuned detector on the contacts of one group: a row of `Tuning.summary()`.

    `nested`: they are from recordings not used for the choice. `mean_ms`, `missed` and
    `alarming` (impact-free operations that alarm, of `operations`) are those of the choice, `default_mean_ms` those of
    the benchmark file at the same budget.
    """

    detector: str
    group: str
    threshold: str
    mean_ms: float
    default_mean_ms: float
    missed: int
    contacts: int
    alarming: int
    operations: int
    nested: bool


def tuned_rows(detectors: Sequence[TunedDetector]) -> Iterator[TunedRow]:
    """Yield a row for each detector and group, the best detector first."""
    for tuned in detectors:
        chosen, default = tuned.honest, _default_of(tuned)
        for group, found in chosen.groups.items():
            before = default.groups[group].mean_ms if default else math.nan
            yield TunedRow(
                tuned.detector,
                group,
                str(tuned.choice.rule.name),
                found.mean_ms,
                before,
                found.missed,
                found.contacts,
                chosen.alarming,
                chosen.free,
                tuned.nested is not None,
            )


def _default_of(tuned: TunedDetector) -> ChoiceResults | None:
    """Return the results of the default that were measured as those of the choice."""
    return tuned.default_nested if tuned.nested is not None else tuned.default_apparent
