"""The normal motion of every channel, learned from impact-free operations for each class of motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from statistics import median

from cdtool.base.findings import remark
from cdtool.commands.learning.grouping import by_class
from cdtool.formats.signature_file import SignatureFile
from cdtool.recordings.motion import measured_class
from cdtool.recordings.operations import Operation
from cdtool.results.results import RecordingFinding
from cdtool.thresholds.base import Threshold, is_per_run
from cdtool.thresholds.common_class import SPEED_TOLERANCE
from cdtool.thresholds.normal_motion import Absence, NormalMotion, NormalMotions, learn_normal_motion


def normal_motions(operations: Sequence[Operation]) -> tuple[NormalMotion, ...]:
    """Return the normal motion of each class of motion with enough runs that have speed and position."""
    able = [item for item in operations if "speed" in item.recording and "position" in item.recording]
    learned = []
    for members in by_class(able)[0] if able else []:
        classes = [measured_class(item.recording) for item in members]
        motion = replace(classes[0], nominal_speed=median(item.nominal_speed for item in classes))
        normal = learn_normal_motion([item.recording.without_ground_truth() for item in members], motion)
        if normal is not None:
            learned.append(normal)
    return tuple(learned)


def normals_for(operations: Sequence[Operation], rule: Threshold) -> NormalMotions:
    """Return the normal motions of the operations that a rule learned from, or why they are missing."""
    absent = Absence.PER_RUN if is_per_run(rule) else Absence.FEW_RUNS
    absent = Absence.BY_HAND if getattr(rule, "limits", ()) else absent
    return NormalMotions(normal_motions(operations), absent)


def normals_of(file: SignatureFile) -> NormalMotions:
    """Return the normal motions of a signature file, or why they are missing."""
    return NormalMotions(file.normal or (), Absence.OLDER_FILE if file.normal is None else Absence.FEW_RUNS)


def notes_on(file: SignatureFile) -> list[RecordingFinding]:
    """Return the notes on a signature file of an earlier version, under its name; else empty."""
    note = remark(file.of_earlier_version, severity="note")
    return [RecordingFinding.of(file.source, note)] if file.of_earlier_version else []


def with_operation(
    file: SignatureFile, operation: Operation, cap: float, forget: float | None
) -> tuple[NormalMotion, ...] | None:
    """Return a file's normal motions with one more impact-free operation in that of its class; None without one.

    The run is clipped to `cap` spreads and weighted as in the signature (`forget`).
    """
    if file.normal is None:
        return None
    recording, motions = operation.recording.without_ground_truth(), list(file.normal)
    motion = measured_class(recording)
    for i, normal in enumerate(motions):
        if normal.motion.matches(motion, SPEED_TOLERANCE) and normal.serves(recording):
            motions[i] = normal.with_run(recording, cap, forget)
            break
    return tuple(motions)
