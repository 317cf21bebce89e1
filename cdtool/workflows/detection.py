"""Running one detector over one log."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from cdtool.activation import Activation, ActivationSettings
from cdtool.detection import Alarm
from cdtool.errors import RecordingError, UsageError
from cdtool.evaluation.explanation.normal_choice import Absence, NormalMotions
from cdtool.evaluation.truth.matching import Matching, belongs, match, windows
from cdtool.evaluation.truth.onset import OnsetRule, find_contacts
from cdtool.machine_file import MachineFile, read_machine_file
from cdtool.motion.applicable import HOLD
from cdtool.operations import Operation
from cdtool.pipeline import Detection, detect_operations
from cdtool.plain_text import digits
from cdtool.plausible import PlausibleRanges
from cdtool.recording import GROUND_TRUTH, Contact, Recording
from cdtool.signature_store import read_signature
from cdtool.thresholds.base import FittedThreshold
from cdtool.thresholds.limit import Limit
from cdtool.workflows.runs import absent_truth, check_joints, load_operations


@dataclass(frozen=True)
class Detected:
    """A log, what the detector says of each of its operations, and the contacts where the log has ground truth.

    `matchings` hold each operation's alarms against its contacts, in the order of `detections`. `threshold` says in
    words what was held against the signal, `activation` is what raised the alarms. `learned`: the signature was learned
    from this log, so that no alarm shows nothing. `window`: how long after its onset a contact may be detected [s].
    `normals`: what impact-free runs look like, or why that is not known.
    """

    recording: Recording
    detections: tuple[Detection, ...]
    contacts: tuple[Contact, ...]
    matchings: tuple[Matching, ...]
    threshold: str
    activation: Activation = field(default_factory=Activation)
    learned: bool = False
    window: float = 1.0
    normals: NormalMotions = field(default_factory=NormalMotions)

    @property
    def joints(self) -> tuple[str, ...]:
        """The names of the signal's columns: the joints that are watched."""
        return self.detections[0].statistic.joints if self.detections else self.recording.joints


def detect(
    log: str | Path,
    machine: str | Path | MachineFile,
    *,
    signature: str | Path | None = None,
    detector: str | None = None,
    limit: Sequence[float] = (),
    joints: Sequence[str] = (),
    operations: str = "whole",
    activation: ActivationSettings | None = None,
    onset: OnsetRule | None = None,
    window: float = 1.0,
) -> Detected:
    """Alarms of one detector in one log, against a signature file or hand-set limits (one, or one a joint).

    With limits, `joints` are those to watch (none named: all); a signature watches those that it was learned for.
    `activation`: settings other than the signature's, or than the default's.
    Raises UsageError where neither or both are given, SignatureError where the signature does not belong,
    RecordingError where the log cannot be read.
    """
    if (signature is None) == (not limit):
        raise UsageError("one threshold is needed: a signature or a limit", "give --signature FILE or --limit VALUE")
    machine_file = machine if isinstance(machine, MachineFile) else read_machine_file(machine)
    thresholds: tuple[FittedThreshold, ...]
    learned: set[str] = set()
    ranges: PlausibleRanges | None = None
    normals = NormalMotions(absent=Absence.BY_HAND)
    if signature is not None:
        stored = read_signature(signature)
        instance = machine_file.detector(detector or stored.detector)
        stored.check(machine_file.machine, instance)
        if joints:
            raise UsageError("joints belong to a limit", "a signature watches the joints that it was learned for")
        thresholds, joints, ranges = stored.current, stored.joints, stored.plausible
        learned = {run.sha256 for run in stored.runs}
        raised_by, described = stored.activation, stored.described
        normals = NormalMotions(stored.normal or (), Absence.OLDER_FILE if stored.normal is None else Absence.FEW_RUNS)
    else:
        if detector is None:
            raise UsageError("a limit belongs to a detector", "give --detector NAME; see cdtool list detectors")
        instance = machine_file.detector(detector)
        check_joints(joints, machine_file.machine)
        thresholds = (Limit.given(limit),)
        raised_by = Activation()
        described = f"limit {', '.join(map(digits, limit))} {instance.unit(machine_file.machine)} set by hand"
    stored_one, raised_by = raised_by, raised_by.changed(activation or {})
    if raised_by != stored_one and signature is not None:
        described += ", with another activation than that of the file"
    recording, parts = load_operations(Path(log), machine_file, operations, ranges=ranges)
    detections = tuple(
        detect_operations(parts, machine_file.machine, instance, thresholds, raised_by, joints, max(HOLD, window))
    )
    contacts = _contacts(recording, onset or OnsetRule())
    matchings = tuple(
        match(item.verdict, contacts_of(item.operation, contacts), item.statistic, window, rearm=raised_by.wait)
        for item in detections
    )
    return Detected(
        recording,
        detections,
        contacts,
        matchings,
        described,
        raised_by,
        recording.digest in learned,
        window,
        normals,
    )


def contact_of(found: Detected, alarm: Alarm) -> Contact | None:
    """The contact that an alarm belongs to: in whose window it lies, or that still presses when it comes."""
    spans = windows(found.contacts, found.window)
    return next((span[0] for span in reversed(spans) if belongs(alarm.time, [span])), None)


def same_contact(found: Detected, contact: Contact, alarm: Alarm) -> str:
    """What an alarm of a contact is that did not detect it: another joint's, the same one's again, or too late."""
    matches = [item for matching in found.matchings for item in matching.matches if item.contact == contact]
    first = next((item.alarm for item in matches if item.alarm), None)
    if first is None:
        return f"contact at {contact.start:.3f} s, more than {found.window:g} s after its onset"
    if first.joint != alarm.joint:
        return f"same contact, also {found.joints[alarm.joint]}"
    return f"same contact, {found.joints[alarm.joint]} again"


def why_no_contact(found: Detected, alarm: Alarm) -> str:
    """Why an alarm that belongs to no contact has no latency: no ground truth, none any more, or it is a false one."""
    channel = next((name for name in GROUND_TRUTH if name in found.recording), None)
    if channel is None:
        absent = absent_truth(found.recording)
        return str(absent[0]).partition(":")[0] + " is not in this log" if absent else "no ground truth is mapped"
    series = found.recording[channel]
    present = series.time[np.isfinite(series.values[:, 0])]
    if channel != "event" and (not len(present) or alarm.time > present[-1]):
        ends = f"ends at {present[-1]:.3f} s" if len(present) else "holds no sample"
        return f"{'load cell' if channel == 'force' else channel} {ends}"
    return "no contact"


def contacts_of(operation: Operation, contacts: Sequence[Contact]) -> tuple[Contact, ...]:
    """The contacts whose onset lies in an operation."""
    part = operation.recording
    return tuple(contact for contact in contacts if part.start <= contact.start <= part.end)


def _contacts(recording: Recording, rule: OnsetRule) -> tuple[Contact, ...]:
    try:
        return tuple(find_contacts(recording, rule))
    except RecordingError:
        return ()  # without ground truth there are alarms, but no latency
