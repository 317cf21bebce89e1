"""Contacts from a label file: a CSV with the columns recording, start_s, end_s and, where they are known, kind.

Conventions: `recording` is the path below the benchmark file, or the file's name alone where that is unique; times are
seconds on the recording's own clock. A recording that is named without a time has no contact.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from cdtool.evaluation.truth.named_rows import NamedRow, read_named_rows
from cdtool.recording import Contact

_REQUIRED = ("recording", "start_s", "end_s")
_OPTIONAL = ("kind", "uncertainty_s")


@dataclass(frozen=True)
class Labels:
    """The contacts of each recording that a label file names."""

    source: str
    contacts: Mapping[str, tuple[Contact, ...]]

    def of(self, recording: str) -> tuple[Contact, ...] | None:
        """The contacts of a recording, by its path or its file's name; None where the file does not name it."""
        if recording in self.contacts:
            return self.contacts[recording]
        return self.contacts.get(PurePosixPath(recording).name)


def read_labels(path: Path) -> Labels:
    """Read and check a label file; raises ConfigurationError with the line."""
    found: dict[str, list[Contact]] = {}
    for row in read_named_rows(path, _REQUIRED, _OPTIONAL, "label"):
        contacts = found.setdefault(row.recording, [])
        start = row.seconds("start_s")
        if start is not None:
            contacts.append(_contact(row, start))
    ordered = {name: tuple(sorted(items, key=lambda item: item.start)) for name, items in found.items()}
    return Labels(str(path), ordered)


def _contact(row: NamedRow, start: float) -> Contact:
    end, uncertainty = row.seconds("end_s"), row.seconds("uncertainty_s") or 0.0
    end = start if end is None else end
    if end < start or uncertainty < 0.0:
        raise row.fault(
            f"start {start:g} s, end {end:g} s, uncertainty {uncertainty:g} s",
            "the end comes after the start, and the uncertainty is not negative",
        )
    return Contact(start, end, uncertainty, found_by="label file", kind=row.text("kind"))
