"""Contacts, and forces against their limits, as tables for spreadsheets."""

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

_OF_CONTACT = ("recording", "group", "contact", "point", "profile", "verdict", "peak_n")
_OF_STEP = ("name", "from_s", "at_most_n", "peak_n", "time_budget_ms", "verdict", "reason")
_NAMES = (*_OF_CONTACT, "step", *(f"step_{name}" for name in _OF_STEP[1:]))


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
