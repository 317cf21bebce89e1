"""The true contacts of a log: at least one in an impact log, none in an impact-free one."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cdtool.base.errors import RecordingError
from cdtool.commands.judging.impact_free import contacts_shown
from cdtool.commands.judging.runs import absent_truth, lost
from cdtool.commands.judging.scoring_rules import ScoringRules
from cdtool.recordings.recording import SHOWS_CONTACTS, Contact, Recording
from cdtool.truth.force.curve import TAIL
from cdtool.truth.missing_samples import cell_samples
from cdtool.truth.onset import find_contacts


def unwanted_contacts(recording: Recording, rules: ScoringRules) -> tuple[Contact, ...]:
    """Return the contacts of a hold-out log, which should have none; a label file with the log takes precedence.

    Raises RecordingError if a label is outside the log.
    """
    labels = rules.labels
    if labels and labels.name_of(recording.name) is not None:
        return tuple(labels.contacts_in(recording))
    return contacts_shown(recording, rules.onset)


def any_contacts(recording: Recording, rules: ScoringRules) -> list[Contact]:
    """Return the contacts of a log by a label file that names it or by its channels; empty without ground truth."""
    if rules.labels and rules.labels.name_of(recording.name) is not None:
        return rules.labels.contacts_in(recording)
    try:
        return find_contacts(recording, rules.onset)
    except RecordingError:
        return []  # without ground truth there are alarms, but no latency


def true_contacts(recording: Recording, rules: ScoringRules, path: Path) -> list[Contact]:
    """Return an impact log's contacts: from a label file that names it, else from load cell, label channel or events.

    Raises RecordingError if the log has no contact or no ground truth.
    """
    labels = rules.labels
    name = labels.name_of(recording.name) if labels else None
    if labels and name is not None:
        found = labels.contacts_in(recording)
        if not found:
            raise RecordingError(
                f"{path}: no contact found ({labels.why_none(name)})",
                "add start_s and end_s there, or move the log to [holdout]",
            )
        return found
    for item in absent_truth(recording):
        if not any(channel in recording for channel in SHOWS_CONTACTS):
            raise RecordingError(f"{path}: no ground truth: {item}", "an impact log requires it, or a label file")
    contacts = find_contacts(recording, rules.onset)
    if not contacts and (missing := missing_truth(recording)):
        raise RecordingError(
            f"{path}: no contact found ({rules.onset.described}), and {missing}", "copy the log again, or remove it"
        )
    if not contacts:
        raise RecordingError(
            f"{path}: no contact found ({rules.onset.described})", "lower [onset] above_n, or move the log to [holdout]"
        )
    return contacts


def missing_truth(recording: Recording) -> str:
    """Return what is missing from a log that may contain the contact; empty for a complete log."""
    if damage := lost(recording):
        return f"part of the log is lost: {damage[0].reason}"
    if "force" not in recording:
        if "label" in recording and not np.isfinite(recording["label"].values).all():
            return "samples of the label are missing"
        return ""
    clock = cell_samples(recording["force"]).clock
    present = clock.time
    if len(present) and present[-1] > recording.end - TAIL:
        marks = np.concatenate(([recording.start], present))
        steps = np.diff(marks)
        k = int(np.argmax(steps))
        if steps[k] <= clock.longest_step:
            return ""
        return f"load-cell samples are missing from {marks[k]:.3f} to {marks[k + 1]:.3f} s"
    last = f"ends at {present[-1]:.3f} s" if len(present) else "has no samples"
    return f"the load cell {last}, the log at {recording.end:.3f} s"
