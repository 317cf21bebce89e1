"""The result of a tuning for Python: what was gained as a DataFrame, the figures of its report, and its files."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from cdtool.base.errors import UsageError, nearest
from cdtool.base.plain_text import counted
from cdtool.base.remote.remote_path import location
from cdtool.commands.tune.search.tuned import TunedDetector
from cdtool.commands.tune.tuned_rows import Tuning
from cdtool.report.plots.figures import described
from cdtool.results.frames import notebook_table

if TYPE_CHECKING:
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
class TuningResult(Tuning):
    """What a tuning chose and gained: a DataFrame, figures, and the files of `cdtool tune`.

    What was found is in the fields of `Tuning`: `detectors` are the tuned ones, the best first; `unusable` maps the
    others to the reason.
    """

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
        figure = draw_pareto(tuned, groups, self.result.options.objective)
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
