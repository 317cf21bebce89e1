"""Contacts as a table."""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar

from cdtool.files import write_text
from cdtool.foreign_files import Kind
from cdtool.report.writers.base import Report, Writer


class Contacts(Writer):
    """CSV: a row per contact and detector."""

    name: ClassVar[str] = "contacts"
    suffixes: ClassVar[tuple[str, ...]] = (".csv",)
    in_folder: ClassVar[str] = "contacts.csv"
    kinds: ClassVar[dict[str, Kind]] = {".csv": Kind(b"recording,group,", "table of cdtool")}

    def write(self, report: Report, target: Path) -> None:
        """Write it; raises CdtoolError."""
        from cdtool.report.contacts_csv import contacts_csv

        write_text(target, contacts_csv(report.evaluated.results))
