"""Check that impact-free logs contain no impact, by load cell, labels or events."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cdtool.base.errors import RecordingError
from cdtool.base.findings import Finding
from cdtool.base.plain_text import counted, digits
from cdtool.recordings.operations import Operation
from cdtool.recordings.recording import Contact, Recording
from cdtool.results.results import RecordingFinding, Skipped
from cdtool.truth.onset import OnsetRule, find_contacts

# A load cell whose resolution is coarser than its noise flickers by one step, which is not a contact.
_STEPS = 3.0


def contacts_shown(recording: Recording, rule: OnsetRule) -> tuple[Contact, ...]:
    """Return the contacts of a log that should have none, by the onset rule; empty without ground truth.

    If the rule derives its level from the noise and the load cell's steps are coarser than that, the level is at least
    three steps. A load cell that measures the machine's own motion shows false contacts; set a level by hand then.
    """
    try:
        return tuple(find_contacts(recording, rule, _STEPS))
    except RecordingError:
        return ()


def without_contacts(
    operations: Sequence[Operation], contacts: Sequence[Contact]
) -> tuple[list[Operation], list[Skipped]]:
    """Return the operations without a contact, and the others, left out with the reason."""
    free: list[Operation] = []
    left_out: list[Skipped] = []
    for operation in operations:
        part = operation.recording
        inside = [contact for contact in contacts if contact.start <= part.end and contact.end >= part.start]
        if inside:
            left_out.append(Skipped(operation.name, _described(inside[0])))
        else:
            free.append(operation)
    return free, left_out


def unchecked(notes: Sequence[tuple[str, Finding]]) -> list[RecordingFinding]:
    """Return one line on the logs, by name, whose freedom from impacts cannot be checked."""
    if not notes:
        return []
    logs = list(dict.fromkeys(name for name, _ in notes))
    which = logs[0] if len(logs) == 1 else f"{counted(len(logs), 'log')}, the first {logs[0]}"
    return [RecordingFinding.of(which, Finding("assumed_impact_free", "", {"absent": str(notes[0][1])}))]


def _described(contact: Contact) -> str:
    force = f" of {digits(round(contact.peak_force))} N" if np.isfinite(contact.peak_force) else ""
    since = f"from its start to {contact.end:.3f} s" if contact.in_progress else f"at {contact.start:.3f} s"
    shown = f"the {contact.found_by} shows a contact{force} {since}"
    hint = " (to learn from what is before it, set learn.until to onset"
    hint += "; if it is not a contact, raise onset.above_n)" if force else ")"
    return f"{shown}: not an impact-free run{hint}"
