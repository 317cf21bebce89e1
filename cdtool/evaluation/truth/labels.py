"""Contacts from a label file: a CSV with the columns recording, start_s, end_s and, where they are known, kind.

Conventions: `recording` is the path below the benchmark file, or the file's name alone where that is unique; times are
seconds on the recording's own clock. A recording that is named without a time has no contact.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from cdtool.errors import RecordingError
from cdtool.evaluation.truth.named_rows import NamedRow, read_named_rows
from cdtool.recording import Contact

_REQUIRED = ("recording", "start_s", "end_s")
_OPTIONAL = ("kind", "uncertainty_s")


@dataclass(frozen=True)
class Labels:
    """The contacts of each recording that a label file names.

    `lines`: the origin of each contact, as "FILE line N", in the order of `contacts`; without contacts, its only row.
    """

    source: str
    contacts: Mapping[str, tuple[Contact, ...]]
    lines: Mapping[str, tuple[str, ...]]

    def name_of(self, recording: str) -> str | None:
        """Return the name of a recording in the file: its path, or only the file's name; None if it is not there.

        The name of a run may contain slashes after the file's name: `logs/cycles.csv#push/2`.
        """
        if recording in self.contacts:
            return recording
        file, mark, run = recording.partition("#")
        names = (PurePosixPath(recording).name, f"{PurePosixPath(file).name}{mark}{run}")
        return next((name for name in names if name in self.contacts), None)

    def check(self, recording: str, start: float, end: float) -> None:
        """Raise RecordingError, naming the row, if a contact begins outside a recording of `start` to `end` [s]."""
        name = self.name_of(recording)
        if name is None:
            return
        for contact, line in zip(self.contacts[name], self.lines[name], strict=False):
            if not start <= contact.start <= end:
                raise RecordingError(
                    f"{line}: the contact begins at {contact.start:.10g} s, "
                    f"{recording} is recorded from {start:.3f} to {end:.3f} s",
                    "give seconds on the recording's own clock, as cdtool shows them",
                )


def read_labels(path: Path) -> Labels:
    r"""Read and check a label file.

    Parameters
    ----------
    path : Path
        A CSV with the columns recording, start_s, end_s and, optionally, kind and uncertainty_s.

    Returns
    -------
    Labels
        The contacts of each recording, in order of time.

    Raises
    ------
    ConfigurationError
        The file is wrong; the message names the line.

    Examples
    --------
    >>> _ = Path("labels.csv").write_text("recording,start_s,end_s\nstiff/01.mcap,5.94,6.2\n")
    >>> read_labels(Path("labels.csv")).contacts["stiff/01.mcap"][0].start
    5.94
    """
    first: dict[str, str] = {}
    found: dict[str, list[tuple[Contact, str]]] = {}
    for row in read_named_rows(path, _REQUIRED, _OPTIONAL, "label"):
        first.setdefault(row.recording, row.where)
        contacts = found.setdefault(row.recording, [])
        start = row.seconds("start_s")
        if start is not None:
            contacts.append((_contact(row, start), row.where))
    for contacts in found.values():
        contacts.sort(key=lambda item: item[0].start)
    return Labels(
        str(path),
        {name: tuple(contact for contact, _ in items) for name, items in found.items()},
        {name: tuple(where for _, where in items) or (first[name],) for name, items in found.items()},
    )


def _contact(row: NamedRow, start: float) -> Contact:
    end, uncertainty = row.seconds("end_s"), row.seconds("uncertainty_s") or 0.0
    end = start if end is None else end
    if end < start or uncertainty < 0.0:
        raise row.fault(
            f"start {start:g} s, end {end:g} s, uncertainty {uncertainty:g} s",
            "the end must be after the start, and the uncertainty not negative",
        )
    return Contact(start, end, uncertainty, found_by="label file", kind=row.text("kind"))
