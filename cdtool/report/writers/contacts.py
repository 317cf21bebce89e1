"""Contacts as a table."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path
from typing import ClassVar

from cdtool.base.files.foreign import Kind
from cdtool.base.files.writing import write_pieces
from cdtool.report.csv_text import csv_lines
from cdtool.report.writers.base import Report, Writer
from cdtool.results.results import ContactResult, Results


class Contacts(Writer[Report]):
    """CSV: a row per contact and detector."""

    name: ClassVar[str] = "contacts"
    suffixes: ClassVar[tuple[str, ...]] = (".csv",)
    in_folder: ClassVar[str] = "contacts.csv"
    kinds: ClassVar[dict[str, Kind]] = {".csv": Kind(b"force_at_alarm_n", "table of cdtool")}

    def write(self, report: Report, target: Path) -> None:
        """Write it; raises CdtoolError."""
        write_pieces(target, contacts_lines(report.evaluated.results))


def contacts_lines(results: Results) -> Iterator[str]:
    """Yield a row per contact and detector, in the order and under the names of results.json; empty = no value."""
    names = [item.name for item in fields(ContactResult)]
    return csv_lines(results, names, ([getattr(contact, name) for name in names] for contact in results.contacts))
