"""The result of a benchmark for Python: rows as DataFrames, the figures of its reports, and the reports themselves."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from cdtool.base.errors import UsageError, nearest
from cdtool.base.plain_text import counted, first_of, shorten
from cdtool.base.remote.remote_path import location
from cdtool.report.plots.figures import described
from cdtool.results.evaluated import Evaluated
from cdtool.results.frames import FIRST_OF_CONTACT, results_as_frame
from cdtool.results.results import Results
from cdtool.results.summary import FIGURES, Summary
from cdtool.results.traces.trace import Trace

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

_FIRST = (
    *("contacts", "detected", "missed", "missed_share_at_most", "not_assessable", "false_alarms", "operations"),
    *("median_ms", "min_ms", "max_ms", "mean_ms", "p95_ms", "force_at_alarm_n"),
)
_METRICS: dict[str, Callable[[Summary], float]] = {"min_ms": lambda item: item.min_ms, **FIGURES}


@dataclass(frozen=True)
class StoreReport:
    """How many recordings were computed, at least in part, and how many were all in the store."""

    computed: int = 0
    reused: int = 0


@dataclass(frozen=True, repr=False)
class BenchmarkResult:
    """What a benchmark measured: DataFrames, figures and reports.

    `contacts`, `false_alarms` and the other frames have a column per field of `results.json`, under the same names,
    with units. `results` are the same rows as plain values, `evaluated` these with all statistics. `traces` are the
    curves that the trigger plots show. A frame is made at its first use, and is the same one from then on.

    Parameters
    ----------
    evaluated : Evaluated
        The rows with their statistics.
    traces : tuple of Trace
        The curves that were kept.
    inputs : tuple of Path
        The files that were read; they are never overwritten.
    stored : StoreReport, optional
        How much was in the store; None without one.

    Examples
    --------
    >>> import cdtool
    >>> result = cdtool.benchmark("sample_logs/gate/benchmark.toml", detectors=["momentum"])
    >>> result.headline
    '4 of 8 limits not checked (pure_inertia, friction_ekf not run); all 9 limits are met'
    >>> result.contacts.groupby("group", observed=True).latency_ms.median().round().astype(int).to_dict()
    {'stiff': 63, 'soft': 119}
    >>> result.summary().loc[("stiff", "momentum"), ["detected", "missed"]].tolist()
    [4.0, 0.0]
    """

    evaluated: Evaluated
    traces: tuple[Trace, ...] = ()
    inputs: tuple[Path, ...] = field(default=(), compare=False)
    stored: StoreReport | None = field(default=None, compare=False)

    @property
    def results(self) -> Results:
        """The rows and their provenance as plain values."""
        return self.evaluated.results

    @property
    def headline(self) -> str:
        """The conclusion in one line, as every report shows it."""
        return self.results.conclusion.headline

    @cached_property
    def contacts(self) -> pd.DataFrame:
        """What is looked at first of each contact; `latency_ms` is NaN unless `outcome` is "detected".

        `frame("contacts")` has all columns.
        """
        return self.frame("contacts")[FIRST_OF_CONTACT]

    @cached_property
    def false_alarms(self) -> pd.DataFrame:
        """A row per alarm without a contact."""
        return self.frame("false_alarms")

    @cached_property
    def skipped(self) -> pd.DataFrame:
        """A row per log or detector that was left out, with the reason."""
        return self.frame("skipped")

    def frame(self, table: str) -> pd.DataFrame:
        """Return one kind of rows as a new DataFrame.

        Parameters
        ----------
        table : str
            The name of the rows in `results.json`: "contacts", "forces", "sweep", and so on.

        Returns
        -------
        DataFrame
            A column per field, all columns even without a row.

        Raises
        ------
        UsageError
            There are no rows of that name.
        """
        from cdtool.results.results import tables

        if table not in tables():
            raise UsageError(f"no table '{table}' in the results", nearest(table, tuple(tables())))
        return results_as_frame(self.results, table)

    def summary(self, *, every: bool = False) -> pd.DataFrame:
        """Return the statistics of each detector in each group.

        Parameters
        ----------
        every : bool, optional
            All metrics that `[limits]` may name, not only those to look at first.

        Returns
        -------
        DataFrame
            Index: group and detector, in the order of the benchmark file, changed conditions last. All columns are
            floats, NaN where a metric is not known. The counts are first, because a latency means nothing without
            them: the median, the range and `p95_ms` count a missed contact as later than all others, `mean_ms` and
            `std_ms` are those of the detected contacts. Below ten of these there is no mean and no P95, as in reports.
        """
        import pandas as pd

        items = (*self.evaluated.summaries, *self.evaluated.conditions)
        values = {name: [float(metric(item)) for item in items] for name, metric in _METRICS.items()}
        of_rows = {"group": self.results.every_group, "detector": self.results.detectors}
        index = [pd.Categorical([getattr(item, name) for item in items], of_rows[name]) for name in of_rows]
        frame = pd.DataFrame(values, index=pd.MultiIndex.from_arrays(index, names=list(of_rows)), dtype="float64")
        of_many = [name for name in _METRICS if name.startswith(("mean", "std", "p95"))]
        frame.loc[np.array([item.few for item in items], dtype=bool), of_many] = math.nan
        return frame[[*_FIRST, *(name for name in frame if every and name not in _FIRST)]]

    @property
    def plot(self) -> BenchmarkPlots:
        """The figures of the reports, for a notebook: `result.plot.latency()`."""
        return BenchmarkPlots(self)

    def save(self, *targets: str | Path, force: bool = False) -> list[Path]:
        """Write reports, as `cdtool benchmark -o` does.

        Parameters
        ----------
        *targets : str or Path
            A folder for all reports, or names that end in .html, .md, .json, .xml, .csv, .png, .parquet ...
        force : bool, optional
            Replace files that cdtool did not write.

        Returns
        -------
        list of Path
            The files; of a folder, its report.

        Raises
        ------
        UsageError
            A target cannot be written, or is a file that cdtool did not write.
        """
        from cdtool.report.outputs import write_outputs
        from cdtool.report.writers.base import Report

        report = Report(self.evaluated, self.traces)
        return write_outputs(report, [location(target) for target in targets], force=force, inputs=self.inputs)

    def __repr__(self) -> str:
        found = self.results
        counts = {"detector": found.detectors, "group": found.every_group, "recording": found.recordings}
        size = ", ".join(counted(len(rows), name) for name, rows in counts.items())
        return f"BenchmarkResult({shorten(self.headline, 100)}; {size})"  # one line

    def _repr_html_(self) -> str:
        """Return the verdict and the table of results of the reports, which a notebook shows."""
        from cdtool.report.model import counts_text
        from cdtool.report.notebook import as_frame, notebook_table
        from cdtool.report.tables.results import results_table

        table = results_table(self.evaluated.summaries)
        bounds = [f"{part.text}: {'; '.join(part.lines[1:])}" for part in table.parts.values() if part.details]
        about = "\n".join((counts_text(self.evaluated), *bounds))
        return notebook_table(self.headline, as_frame(table), about, self.results.conclusion.tone)


@dataclass(frozen=True)
class BenchmarkPlots:
    """The plots of a benchmark's reports: each a `matplotlib.figure.Figure`, which Jupyter shows without pyplot."""

    result: BenchmarkResult

    def latency(self) -> Figure:
        """Return the latency of every contact, by group and detector, with the counts to read it with."""
        from cdtool.report.plots.latency_plot import latency_figure

        return described(latency_figure(self.result.evaluated), "latency of every contact by group and detector")

    def survival(self) -> Figure:
        """Return the share of the contacts that are still undetected over the time since their onset."""
        from cdtool.report.plots.survival_plot import survival_figure

        return described(survival_figure(self.result.evaluated), "share of the contacts still undetected over time")

    def amoc(self) -> Figure:
        """Return the median latency against the false alarms, with all limits moved; needs an impact-free group."""
        from cdtool.report.plots.amoc_plot import amoc_figure

        return described(amoc_figure(self.result.evaluated), "median latency against false alarms")

    def triggers(self, recording: str | None = None, *, group: str | None = None) -> Figure:
        """Return all detectors below the load-cell curve of one recording.

        Parameters
        ----------
        recording : str, optional
            A recording whose curves were kept, as `contacts.recording` names it or by any ending of this name that no
            other has, such as "03.csv"; by default the one that shows most.
        group : str, optional
            Of one group only.

        Returns
        -------
        Figure
            The load cell, and a row per detector, the fastest first.

        Raises
        ------
        UsageError
            No curves of the recording or the group were kept.
        """
        from cdtool.report.plots.trigger_plot import most_informative, trigger_figure

        found = [
            trace
            for trace in self.result.traces
            if group in (None, trace.group)
            and (recording is None or any(f"/{name}".endswith(f"/{recording}") for name in _names_of(trace)))
        ]
        found = [trace for trace in found if recording in _names_of(trace)] or found
        several = dict.fromkeys(_names_of(trace)[-1] for trace in found)
        if recording is not None and len(several) > 1:
            raise UsageError(f"'{recording}' fits {first_of(list(several))}", "give more of its path")
        if not found:
            asked = recording or group or ""
            known = dict.fromkeys(trace.recording if recording else trace.group for trace in self.result.traces)
            hint = nearest(asked, tuple(known)) if known else "run the benchmark, or keep results.traces.json.gz"
            raise UsageError(f"no curves of '{asked}' were kept" if asked else "no curves were kept", hint)
        trace = most_informative(found)
        return described(
            trigger_figure(trace, self.result.results), f"{trace.recording}: load cell and all detectors over time"
        )


def _names_of(trace: Trace) -> tuple[str, str]:
    """Return the name of an operation, and that of its log."""
    return trace.recording, trace.recording.partition("#")[0]
