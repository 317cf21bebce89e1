"""One log of a benchmark: read, cut, detected by every detector, matched with its contacts; the rows that it gives."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from time import perf_counter
from typing import Any

from cdtool.detection import Alarm
from cdtool.errors import CdtoolError
from cdtool.evaluation.force.course import ForceCourse, force_course
from cdtool.evaluation.force.verdict import ForceVerdict, judge
from cdtool.evaluation.results import ContactResult, FalseAlarmResult, ForceResult, RecordingResult, Skipped
from cdtool.evaluation.sweep import sweep
from cdtool.evaluation.truth.matching import match
from cdtool.motion.applicable import HOLD
from cdtool.operations import Operation
from cdtool.pipeline import Detection, detect_operations
from cdtool.plausible import PlausibleRanges
from cdtool.recording import Contact, Finding, FloatArray, Recording
from cdtool.thresholds.base import FittedThreshold
from cdtool.workflows.benchmark_file import HOLDOUT, BenchmarkFile
from cdtool.workflows.detection import contacts_of
from cdtool.workflows.force_rows import force_rows
from cdtool.workflows.impact_free import without_contacts
from cdtool.workflows.judged import Judged, contact_rows, false_alarm_rows, not_assessable
from cdtool.workflows.runs import absent_truth, load_operations, lost, told, unread
from cdtool.workflows.true_contacts import true_contacts, unwanted_contacts


@dataclass
class Scored:
    """What one log gave."""

    recording: RecordingResult | None = None
    judged: list[Judged] = field(default_factory=list)
    contacts: list[ContactResult] = field(default_factory=list)
    false_alarms: list[FalseAlarmResult] = field(default_factory=list)
    forces: list[ForceResult] = field(default_factory=list)
    verdicts: dict[int, ForceVerdict] = field(default_factory=dict)
    skipped: list[Skipped] = field(default_factory=list)
    findings: list[Skipped] = field(default_factory=list)
    # Names of logs taken as free of impacts, with what would tell and is not in them.
    unchecked: list[tuple[str, Finding]] = field(default_factory=list)
    source: str = ""
    reading: float = 0.0
    detecting: float = 0.0


# What gives the detections of each operation of a log; it names what failed in the log's `Scored`.
Detect = Callable[[Sequence[Operation], Scored], list[list[Detection]]]


def detect_with(
    setup: BenchmarkFile,
    detectors: Sequence[Any],
    thresholds: Mapping[str, tuple[FittedThreshold, ...]],
    lacking: Mapping[str, str],
    hold: float = HOLD,
) -> Detect:
    """Detectors with their thresholds; one that fails on a log is left out there and named.

    Those that are `lacking` what they need, for the reason given, can judge nothing. `hold` [s]: the matching window.
    """
    machine = setup.machine_file.machine

    def detect(operations: Sequence[Operation], scored: Scored) -> list[list[Detection]]:
        found: list[list[Detection]] = [[] for _ in operations]
        for detector in detectors:
            if detector.name in lacking:
                unit, why = detector.unit(machine), lacking[detector.name]
                made = [not_assessable(item, detector.name, unit, why, setup.watched) for item in operations]
            else:
                known = thresholds[detector.name]
                try:
                    made = detect_operations(
                        operations, machine, detector, known, setup.activation, setup.watched, hold
                    )
                except CdtoolError as fault:
                    scored.skipped += [Skipped(item.name, str(fault)) for item in operations]
                    continue
            for of_operation, detection in zip(found, made, strict=True):
                of_operation.append(detection)
        return found

    return detect


def score_log(
    setup: BenchmarkFile,
    group: str,
    path: Path,
    detect: Detect,
    factors: Mapping[str, FloatArray],
    ranges: PlausibleRanges | None = None,
) -> Scored:
    """A log's rows; `factors`: the safety factors of the sweep by detector; outside of `ranges` values are masked.

    A log or detector that fails is left out and named, and nothing is raised.
    """
    scored = Scored()
    begin = perf_counter()
    try:
        recording, operations = load_operations(path, setup.machine_file, setup.operations, setup.path.parent, ranges)
        contacts = true_contacts(recording, setup, path) if group != HOLDOUT else []
    except CdtoolError as fault:
        scored.skipped.append(unread(path, setup.path.parent, fault))
        scored.reading = perf_counter() - begin
        return scored
    scored.reading = perf_counter() - begin
    scored.source = recording.source
    scored.findings = told(recording)
    scored.skipped += lost(recording)
    if group == HOLDOUT:
        operations, touched = without_contacts(operations, unwanted_contacts(recording, setup))
        scored.skipped += touched
        scored.unchecked = [(recording.name, item) for item in absent_truth(recording)]
        if not operations:
            return scored
    scored.recording = _recording_result(recording, group, path, len(operations), len(contacts), setup)
    inside = _by_operation(operations, contacts)
    for contact in contacts:
        if not any(contact in items for items in inside):
            text = f"the contact at {contact.start:.3f} s lies in no operation (cut by {setup.operations})"
            scored.skipped.append(Skipped(recording.name, text))
    courses = _courses(recording, contacts, setup, scored)
    profile = setup.impacts[group].force
    if profile:
        scored.verdicts = {number: judge(course, profile) for number, course in courses.items()}
        scored.forces = force_rows(scored.recording, scored.verdicts, courses)
        unseen = [f"contact {number}" for number in range(1, len(contacts) + 1) if number not in courses]
        if unseen:
            text = f"{', '.join(unseen)}: no load-cell force to hold against {profile.name}"
            scored.skipped.append(Skipped(recording.name, text))
    found = detect(operations, scored)
    crossings = _pooled(found)
    for operation, own, detections in zip(operations, inside, found, strict=True):
        judged = _judge(setup, group, operation, own, detections, factors, contacts, crossings)
        scored.judged.append(judged)
        scored.contacts += contact_rows(judged, recording, contacts, courses, setup.synchronisation)
        scored.false_alarms += false_alarm_rows(judged)
    scored.detecting = perf_counter() - begin - scored.reading
    return scored


def _by_operation(operations: Sequence[Operation], contacts: Sequence[Contact]) -> list[tuple[Contact, ...]]:
    """The contacts of each operation; one on the edge of two belongs to the earlier."""
    taken: set[Contact] = set()
    found = []
    for operation in operations:
        own = tuple(contact for contact in contacts_of(operation, contacts) if contact not in taken)
        taken.update(own)
        found.append(own)
    return found


def _pooled(found: Sequence[Sequence[Detection]]) -> dict[str, list[Alarm]]:
    """Every detector's crossings in all operations of a log, in order of time."""
    pooled: dict[str, list[Alarm]] = {}
    for detections in found:
        for detection in detections:
            pooled.setdefault(detection.detector, []).extend(detection.verdict.crossings)
    return {name: sorted(items, key=lambda alarm: (alarm.time, alarm.joint)) for name, items in pooled.items()}


def _recording_result(
    recording: Recording, group: str, path: Path, operations: int, contacts: int, setup: BenchmarkFile
) -> RecordingResult:
    return RecordingResult(
        recording=recording.name,
        group=group,
        sha256=recording.digest,
        seconds=recording.duration,
        operations=operations,
        contacts=contacts,
        campaign=setup.campaigns.get(path),
        point=setup.points.get(path),
    )


def _courses(
    recording: Recording, contacts: Sequence[Contact], setup: BenchmarkFile, scored: Scored
) -> dict[int, ForceCourse]:
    """The force over each contact by its number; one that has none is named."""
    found: dict[int, ForceCourse] = {}
    if "force" not in recording:
        return found
    ends = [*(contact.start for contact in contacts[1:]), float("inf")]
    for number, (contact, until) in enumerate(zip(contacts, ends, strict=False), 1):
        try:
            found[number] = force_course(recording, contact, setup.mass_before_cell, until)
        except CdtoolError as fault:
            scored.findings.append(Skipped(recording.name, f"contact {number}: no force: {fault.message}"))
    return found


def _judge(
    setup: BenchmarkFile,
    group: str,
    operation: Operation,
    contacts: tuple[Contact, ...],
    detections: Sequence[Detection],
    factors: Mapping[str, FloatArray],
    of_log: Sequence[Contact],
    crossings: Mapping[str, Sequence[Alarm]],
) -> Judged:
    window = setup.impacts[group].window
    matchings = tuple(
        match(
            item.verdict,
            contacts,
            item.statistic,
            window,
            of_log=of_log,
            crossings=crossings[item.detector],
            rearm=setup.activation.wait,
        )
        for item in detections
    )
    sweeps = tuple(
        sweep(item, contacts, setup.activation, window, factors[item.detector]) if item.detector in factors else None
        for item in detections
    )
    return Judged(group, operation, contacts, tuple(detections), matchings, sweeps)
