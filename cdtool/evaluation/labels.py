"""Contacts from a label file: a CSV with the columns recording, start_s, end_s and, where they are known, kind.

Conventions: `recording` is the path below the benchmark file, or the file's name alone where that is unique; times are
seconds on the recording's own clock. A recording that is named without a time has no contact.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from cdtool.errors import ConfigurationError, nearest
from cdtool.recording import Contact

_REQUIRED = ("recording", "start_s", "end_s")
_KNOWN = (*_REQUIRED, "kind", "uncertainty_s")


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
    try:
        with path.open(encoding="utf-8-sig", newline="") as stream:
            reader = csv.DictReader(stream, strict=True)
            names = [name.strip() for name in reader.fieldnames or ()]
            reader.fieldnames = names
            _check_columns(path, names)
            rows = [(reader.line_num, row) for row in reader]
    except (OSError, UnicodeDecodeError, csv.Error) as fault:
        raise ConfigurationError(f"{path}: no label file: {fault}", "a UTF-8 CSV file is needed") from fault
    found: dict[str, list[Contact]] = {}
    for line, row in rows:
        name = (row["recording"] or "").strip().replace("\\", "/")
        if not name:
            raise ConfigurationError(f"{path} line {line}: no recording is named", "write its path in column recording")
        contacts = found.setdefault(name, [])
        if (row["start_s"] or "").strip():
            contacts.append(_contact(path, line, row))
    ordered = {name: tuple(sorted(items, key=lambda item: item.start)) for name, items in found.items()}
    return Labels(str(path), ordered)


def _check_columns(path: Path, names: list[str]) -> None:
    for name in names:
        if name not in _KNOWN:
            raise ConfigurationError(f"{path} line 1: unknown column '{name}'", nearest(name, _KNOWN))
    for name in _REQUIRED:
        if name not in names:
            raise ConfigurationError(f"{path} line 1: column '{name}' is missing", f"write {','.join(_KNOWN)}")


def _contact(path: Path, line: int, row: Mapping[str, str | None]) -> Contact:
    def number(name: str, default: float) -> float:
        text = (row.get(name) or "").strip()
        try:
            value = float(text) if text else default
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise ConfigurationError(f"{path} line {line}: {name} is '{text}'", "a number of seconds is needed")
        return value

    start = number("start_s", math.nan)
    end = number("end_s", start)
    uncertainty = number("uncertainty_s", 0.0)
    if end < start or uncertainty < 0.0:
        raise ConfigurationError(
            f"{path} line {line}: start {start:g} s, end {end:g} s, uncertainty {uncertainty:g} s",
            "the end comes after the start, and the uncertainty is not negative",
        )
    return Contact(start, end, uncertainty, found_by="label file", kind=(row.get("kind") or "").strip())
