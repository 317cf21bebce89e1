"""The result of one detector on one log: its detections, the contacts, and what they have to do with each other."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from cdtool.alarms.activation import Activation
from cdtool.alarms.pipeline import Detection
from cdtool.commands.judging.runs import absent_truth
from cdtool.detectors.detection import Alarm
from cdtool.recordings.recording import SHOWS_CONTACTS, Contact, Recording
from cdtool.results.results import ContactResult, RecordingFinding, Skipped
from cdtool.thresholds.normal_motion import NormalMotions
from cdtool.truth.matching import Matching, belongs, windows
from cdtool.truth.missing_samples import longest_step


@dataclass(frozen=True)
class Detected:
    """A log, the detector's result for each of its operations, and the contacts if the log has ground truth.

    `matchings` match each operation's alarms with its contacts, in the order of `detections`. `threshold` describes
    the threshold, `activation` how a signal outside it becomes an alarm. `learned`: the signature was learned from this
    log, so the absence of alarms is no evidence. `window`: how long after its onset a contact may be detected [s].
    `normals`: the normal motion of impact-free runs, or why it is unknown.
    `contact_rows` contains, for each of `detections`, the rows of these contacts as written by `cdtool benchmark`.
    `not_scored` names contacts without an onset; `findings` concern the log itself and the signature file.
    `onset` describes how the onset is found on the load cell.
    """

    recording: Recording
    detections: tuple[Detection, ...]
    contacts: tuple[Contact, ...]
    matchings: tuple[Matching, ...]
    threshold: str
    activation: Activation = field(default_factory=Activation)
    learned: bool = False
    window: float = 1.0
    contact_rows: tuple[tuple[ContactResult, ...], ...] = ()
    not_scored: tuple[Skipped, ...] = ()
    findings: tuple[RecordingFinding, ...] = ()
    normals: NormalMotions = field(default_factory=NormalMotions)
    onset: str = ""

    @property
    def joints(self) -> tuple[str, ...]:
        """Return the names of the signal's columns: the monitored joints."""
        return self.detections[0].statistic.joints if self.detections else self.recording.joints


@dataclass(frozen=True)
class DetectedRuns:
    """The results for the runs of a log, in its order; `skipped` are runs left out, `findings` concern the log."""

    runs: tuple[Detected, ...]
    skipped: tuple[Skipped, ...] = ()
    findings: tuple[RecordingFinding, ...] = ()


def contact_of(found: Detected, alarm: Alarm) -> Contact | None:
    """Return the contact that an alarm detected, or belongs to: by its window, or because it lasts until the alarm."""
    matches = [item for matching in found.matchings for item in matching.matches]
    if own := next((item.contact for item in matches if item.alarm == alarm), None):
        return own
    spans = windows(found.contacts, found.window)
    return next((span[0] for span in reversed(spans) if belongs(alarm.time, [span])), None)


def same_contact(found: Detected, contact: Contact, alarm: Alarm) -> str:
    """Describe an alarm of a contact that did not detect it: another joint's, a repeated or a late one."""
    matches = [item for matching in found.matchings for item in matching.matches if item.contact == contact]
    first = next((item.alarm for item in matches if item.alarm), None)
    if contact.in_progress:
        return "contact in progress at the start"
    if first is None and contact.hole and contact.uncertainty >= found.window:
        return f"contact first seen at {contact.start:.3f} s: load-cell samples are missing where it began"
    if first is None:
        return f"contact at {contact.start:.3f} s, more than {found.window:g} s after its onset"
    if first.joint != alarm.joint:
        return f"same contact, also {alarm.joint}"
    return f"same contact, {alarm.joint} again"


# Why a false alarm has no latency.
NO_CONTACT = "no contact"


def why_no_contact(found: Detected, alarm: Alarm) -> str:
    """Explain why an alarm without a contact has no latency: no ground truth, ground truth ended, or a false alarm."""
    channel = next((name for name in SHOWS_CONTACTS if name in found.recording), None)
    if channel is None:
        absent = absent_truth(found.recording)
        return f"{absent[0].channel} is not in this log" if absent else "no ground truth is mapped"
    series = found.recording[channel]
    present = series.time[np.isfinite(series.values[:, 0])]
    if channel != "event" and (not len(present) or alarm.time > present[-1]):
        ends = f"ends at {present[-1]:.3f} s" if len(present) else "has no samples"
        return f"{'load cell' if channel == 'force' else channel} {ends}"
    if channel == "force" and len(present) > 1:
        k = int(np.searchsorted(present, alarm.time))
        if k > 0 and present[k] - present[k - 1] > longest_step(present):
            return f"unknown: load-cell samples are missing from {present[k - 1]:.3f} to {present[k]:.3f} s"
    return NO_CONTACT
