"""What a tuning found: as values, as a verdict, and as rows, one per detector and group."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from cdtool.base.plain_text import counted
from cdtool.commands.judging.runs import Runs
from cdtool.commands.scoring.benchmark_file import BenchmarkFile
from cdtool.commands.tune.options import TuningOptions
from cdtool.commands.tune.search.tuned import ChoiceResults, TunedDetector
from cdtool.results.conclusion import Severity, Statement, worst_first
from cdtool.results.frames import rows_as_frame
from cdtool.results.results import RecordingFinding, Skipped

if TYPE_CHECKING:
    import pandas as pd


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


@dataclass(frozen=True, repr=False)
class Tuning:
    """The tuned detectors, the best first; what was left out; and the inputs.

    `setup` and `options` say what was tuned, and how. `unusable` maps detectors that cannot be tuned to the reason.
    `is_nested`: there are results on recordings not used for the choice. `runs` are the impact-free runs, `groups` has
    the number of contacts by group, `left_out` the logs that were not used, `findings` what was noticed.
    """

    setup: BenchmarkFile
    options: TuningOptions
    detectors: tuple[TunedDetector, ...]
    unusable: Mapping[str, str]
    runs: Runs
    groups: Mapping[str, int]
    is_nested: bool
    left_out: tuple[Skipped, ...]
    findings: tuple[RecordingFinding, ...]

    @property
    def best(self) -> TunedDetector:
        """The best detector; `best.choice` has its gains and its threshold, `best.debounce` its debounce."""
        return self.detectors[0]

    @property
    def verdict(self) -> tuple[str, str]:
        """Return colour and sentence of the best detector: the worst fact first, as page, screen and Python show it."""
        best = self.detectors[0]
        found, groups = best.honest, best.honest.groups
        means = ", ".join(f"{name} {item.mean_ms:.3g} ms" for name, item in groups.items())
        words = f"{best.detector} with {best.choice.rule.name} at {self.options.budget}: {means}"
        statements = [Statement(Severity.MET, f"{words} on recordings not used for the choice")]
        if best.nested is None:
            statements = [Statement(Severity.APPARENT, f"apparent, on the recordings used for the choice: {words}")]
        counts = (
            (Severity.WITHOUT_LIMIT, "missed", sum(item.missed for item in groups.values())),
            (Severity.NOT_ASSESSABLE, "not assessable", sum(item.not_assessable for item in groups.values())),
        )
        statements += [Statement(kind, f"{counted(count, 'contact')} {what}") for kind, what, count in counts if count]
        hours = sum(item.recording.duration for item in self.runs.operations) / 3600.0
        if excess := self.options.budget.excess((found.alarming, found.free), (found.alarming, hours)):
            statements.append(Statement(Severity.OVER_BUDGET, f"more false alarms than the budget: {excess}"))
        return worst_first(statements)[:2]

    @property
    def headline(self) -> str:
        """The verdict on the best detector in one line, the worst fact first, as the report shows it."""
        return self.verdict[1]

    @cached_property
    def skipped(self) -> pd.DataFrame:
        """A row per log that was left out, with the reason."""
        return rows_as_frame(Skipped, self.left_out)

    def summary(self) -> pd.DataFrame:
        """Return a row per detector and group, the best detector first: what was achieved, and what the file has.

        Returns
        -------
        DataFrame
            `mean_ms`, `missed` of `contacts` and `alarming` of `operations` are those of the choice, of recordings
            that chose nothing if `nested`; `default_mean_ms` is that of the benchmark file at the same budget.
        """
        order = {"detector": [item.detector for item in self.detectors], "group": list(self.groups)}
        return rows_as_frame(TunedRow, list(tuned_rows(self.detectors)), order)
