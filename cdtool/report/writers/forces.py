"""Forces against their limits as a table, in a folder that holds everything."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import ClassVar

from cdtool.base.files.foreign import Kind
from cdtool.base.files.writing import write_pieces
from cdtool.report.writers.base import Report, Writer
from cdtool.report.writers.contacts import csv_lines
from cdtool.results.results import Results

_OF_CONTACT = ("recording", "group", "contact", "point", "profile", "verdict", "peak_n")
_OF_STEP = ("name", "from_s", "at_most_n", "peak_n", "time_budget_ms", "verdict", "reason")
_NAMES = (*_OF_CONTACT, "step", *(f"step_{name}" for name in _OF_STEP[1:]))


class Forces(Writer[Report]):
    """CSV: a row per contact, detector and step of its force profile."""

    name: ClassVar[str] = "forces"
    in_folder: ClassVar[str] = "forces.csv"
    kinds: ClassVar[dict[str, Kind]] = {".csv": Kind(b"step_time_budget_ms", "table of cdtool")}

    def has_content(self, report: Report) -> bool:
        """Return whether any force was compared with a limit."""
        return bool(report.evaluated.results.forces)

    def write(self, report: Report, target: Path) -> None:
        """Write it; raises CdtoolError."""
        write_pieces(target, forces_lines(report.evaluated.results))


def forces_lines(results: Results) -> Iterator[str]:
    """Yield a row per contact and step, in the order of results.json; empty = no value, or never exceeded."""
    rows = (
        [getattr(force, name) for name in _OF_CONTACT] + [getattr(step, name) for name in _OF_STEP]
        for force in results.forces
        for step in force.steps
    )
    return csv_lines(results, _NAMES, rows)
