"""The result of a tuning for Python: what was gained as a DataFrame, and its files."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from cdtool.base.errors import UsageError
from cdtool.base.plain_text import counted
from cdtool.base.remote.remote_path import location
from cdtool.commands.tune.tuned_rows import Tuning
from cdtool.report.notebook import notebook_table

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
    """What a tuning chose and gained: a DataFrame, and the files of `cdtool tune`.

    What was found is in the fields of `Tuning`: `detectors` are the tuned ones, the best first; `unusable` maps the
    others to the reason.
    """

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
        return f"TuningResult({self.headline}; {counted(len(self.detectors), 'detector')})"

    def _repr_html_(self) -> str:
        """Return these results as a table, which a notebook shows."""
        tone, headline = self.verdict
        return notebook_table(headline, self.summary()[_SHOWN], counted(len(self.detectors), "detector"), tone)
