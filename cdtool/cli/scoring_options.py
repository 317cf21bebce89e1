"""The options that make a log's figures: by hand, or all of them from a benchmark file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from cdtool.errors import UsageError

if TYPE_CHECKING:
    from cdtool.workflows.contacts.scoring_rules import ScoringRules


def rules_of(
    *,
    above: float | None,
    back_to: float | None,
    hold: float | None,
    sigmas: float | None,
    separation: float | None,
    labels: Path | None,
    synchronisation: float | None,
    window: float | None,
    mass_before_cell: float | None,
) -> ScoringRules:
    """The rules that the options give; None: the default. Raises UsageError for a value outside its range."""
    from cdtool.evaluation.truth.labels import read_labels
    from cdtool.evaluation.truth.onset import OnsetRule
    from cdtool.workflows.contacts.scoring_rules import ScoringRules

    onset = {"above": above, "back_to": back_to, "hold": hold, "sigmas": sigmas, "separation": separation}
    rules = {"window": window, "synchronisation": synchronisation, "mass_before_cell": mass_before_cell}
    return ScoringRules(
        onset=OnsetRule(**{name: value for name, value in onset.items() if value is not None}),
        labels=read_labels(labels) if labels else None,
        **{name: value for name, value in rules.items() if value is not None},
    )


def refuse_beside_benchmark(benchmark: Path, **given: object) -> None:
    """Raise UsageError where the command line gives a setting that the benchmark file holds; `given` by option."""
    for name, value in given.items():
        if value is not None and value != "":
            option = f"--{name.replace('_', '-')}"
            raise UsageError(
                f"{option} is given together with --benchmark", f"write it in {benchmark}, or leave one out"
            )
