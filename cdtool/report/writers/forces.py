"""Forces against their limits as a table, in a folder that holds everything."""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar

from cdtool.files import write_text
from cdtool.foreign_files import Kind
from cdtool.report.writers.base import Report, Writer


class Forces(Writer):
    """CSV: a row per contact, detector and step of its force profile."""

    name: ClassVar[str] = "forces"
    in_folder: ClassVar[str] = "forces.csv"
    kinds: ClassVar[dict[str, Kind]] = {".csv": Kind(b"recording,group,", "table of cdtool")}

    def has_content(self, report: Report) -> bool:
        """Return whether any force was compared with a limit."""
        return bool(report.evaluated.results.forces)

    def write(self, report: Report, target: Path) -> None:
        """Write it; raises CdtoolError."""
        from cdtool.report.forces_csv import forces_csv

        write_text(target, forces_csv(report.evaluated.results))
