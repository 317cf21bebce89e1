"""The result of a tuning for Python: what was gained as a DataFrame, the figures of its report, and its files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from cdtool.base.errors import UsageError, nearest
from cdtool.base.plain_text import counted
from cdtool.base.remote.remote_path import location
from cdtool.commands.judging.runs import Runs
from cdtool.commands.scoring.benchmark_file import BenchmarkFile
from cdtool.commands.tune.options import TuningOptions
from cdtool.commands.tune.search.tuned import TunedDetector
from cdtool.commands.tune.tuned_rows import TunedRow, tuned_rows
from cdtool.report.plots.figures import described
from cdtool.results.conclusion import Severity, Statement, worst_first
from cdtool.results.frames import notebook_table, rows_as_frame
from cdtool.results.results import RecordingFinding, Skipped

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure


_SHOWN = [
    "detector",
    "group",
    "threshold",
    "mean_ms",
    "default_mean_ms",
    "missed",
    "contacts",
    "alarming",
    "operations",
]


@dataclass(frozen=True, repr=False)
class TuningResult:
    """What a tuning chose and gained: a DataFrame, figures, and the files of `cdtool tune`.

    `setup` and `options` say what was tuned, and how; `detectors` are the tuned ones, the best first: the choice, its
    results, and what was tried around it. `unusable` maps detectors that cannot be tuned to the reason.
    `is_nested`:
    there are results on recordings not used for the choice. `runs` are the impact-free runs, `groups` has the number of
    contacts by group, `left_out` the logs that were not used, and `findings` what was noticed about the others.
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

    @property
    def plot(self) -> TuningPlots:
        """The figures of the report, for a notebook: `result.plot.front()`."""
        return TuningPlots(self)

    def save(self, folder: str | Path, *, force: bool = False) -> list[Path]:
        """Write what `cdtool tune -o` writes into a folder.

        Parameters
        ----------
        folder : str or Path
            For the machine file, the benchmark files and the signatures with the choice, the report tuning.html, and
            tuning.json.
        force : bool, optional
            Replace files that cdtool did not write.

        Returns
        -------
        list of Path
            The files.

        Raises
        ------
        UsageError
            The folder cannot be created, or has a file that `cdtool tune` did not write.
        """
        from cdtool.commands.tune.files import check_folder, write_tuning

        target = location(folder)
        if target.suffix:
            raise UsageError(f"'{folder}' is the name of a file", "give a folder: result.save('tuned')")
        check_folder(target, self.setup.inputs, [item.detector for item in self.detectors], force=force)
        target.mkdir(parents=True, exist_ok=True)
        return list(write_tuning(self, target))

    def __repr__(self) -> str:
        return f"TuningResult({counted(len(self.detectors), 'detector')}: {self.headline})"

    def _repr_html_(self) -> str:
        """Return these results as a table, which a notebook shows."""
        return notebook_table(f"Tuned: {self.headline}", self.summary()[_SHOWN])


@dataclass(frozen=True)
class TuningPlots:
    """The plots of a tuning's report: each a `matplotlib.figure.Figure`, which Jupyter shows without pyplot."""

    result: TuningResult

    def front(self, detector: str | None = None) -> Figure:
        """Return the costs of two groups of contacts: all choices tried, those that none beats in both, and the choice.

        Parameters
        ----------
        detector : str, optional
            A tuned detector; by default the best.

        Returns
        -------
        Figure
            A mark per choice.

        Raises
        ------
        UsageError
            The detector was not tuned, or there are no two groups of contacts to weigh against each other.
        """
        from cdtool.commands.tune.plots import draw_pareto

        tuned = self._tuned(detector)
        groups = list(tuned.apparent.groups)
        if len(groups) < 2 or not tuned.pareto or any(len(point.costs) < 2 for point in tuned.pareto):
            raise UsageError(
                "a front needs two groups of contacts", "see plot.sensitivity() for the cost around the choice"
            )
        figure = draw_pareto(tuned, groups, self.result.options.goal)
        return described(figure, f"{tuned.detector}: cost of {groups[1]} against that of {groups[0]} of every choice")

    def sensitivity(self, detector: str | None = None) -> Figure:
        """Return the cost over each gain and setting, all others as chosen.

        Parameters
        ----------
        detector : str, optional
            A tuned detector; by default the best.

        Returns
        -------
        Figure
            A panel per gain or setting; the shaded part is at most 5 % worse than the choice.

        Raises
        ------
        UsageError
            The detector was not tuned, or only one value of each setting was tried.
        """
        from cdtool.commands.tune.plots import draw_sensitivity

        tuned = self._tuned(detector)
        if not any(len(item.tried) > 1 for item in tuned.sensitivities):
            raise UsageError(f"only one value of each setting of '{tuned.detector}' was tried", "see summary()")
        return described(draw_sensitivity(tuned.sensitivities), f"{tuned.detector}: cost around the choice")

    def _tuned(self, detector: str | None) -> TunedDetector:
        found = {name: item for item in self.result.detectors for name in (item.detector, item.short_name)}
        if detector is None:
            return self.result.best
        if detector not in found:
            names = [item.detector for item in self.result.detectors]
            raise UsageError(f"'{detector}' was not tuned", nearest(detector, names))
        return found[detector]
