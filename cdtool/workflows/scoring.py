"""One log of a benchmark: read, cut, detected by every detector, matched with its contacts."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from cdtool.activation import Activation
from cdtool.clock import previous_value
from cdtool.errors import CdtoolError, RecordingError
from cdtool.evaluation.matching import Match, Matching, match
from cdtool.evaluation.onset import find_contacts
from cdtool.evaluation.results import ContactResult, ExposureResult, FalseAlarmResult, Skipped
from cdtool.operations import Operation
from cdtool.pipeline import Detection, detect_operation
from cdtool.recording import Contact
from cdtool.thresholds.base import FittedThreshold
from cdtool.workflows.benchmark_file import HOLDOUT, BenchmarkFile
from cdtool.workflows.detection import contacts_of
from cdtool.workflows.runs import load_operations, lost, shown_path, told


@dataclass(frozen=True)
class Trace:
    """One operation with every detector's detection: what a plot needs."""

    group: str
    operation: Operation
    contacts: tuple[Contact, ...]
    detections: tuple[Detection, ...]
    matchings: tuple[Matching, ...]


@dataclass
class Scored:
    """What one log gave."""

    traces: list[Trace] = field(default_factory=list)
    skipped: list[Skipped] = field(default_factory=list)
    findings: list[Skipped] = field(default_factory=list)
    digest: tuple[str, str] | None = None
    reading: float = 0.0
    detecting: float = 0.0


@dataclass
class Exposure:
    """How long one detector watched one group, added up operation by operation."""

    recordings: int = 0
    operations: int = 0
    seconds: float = 0.0
    not_assessable: int = 0
    samples: int = 0
    not_judged: Counter[str] = field(default_factory=Counter)

    def add(self, detection: Detection) -> None:
        """Count one operation."""
        self.operations += 1
        self.seconds += detection.assessed_seconds
        self.not_assessable += detection.verdict.outcome == "not assessable"
        size = detection.statistic.status.size
        self.samples += size
        for reason, share in detection.statistic.shares().items():
            self.not_judged[reason] += round(share * size)

    def result(self, group: str, detector: str) -> ExposureResult:
        """The row of results.json."""
        shares = {reason: count / max(self.samples, 1) for reason, count in sorted(self.not_judged.items())}
        hours = self.seconds / 3600.0
        return ExposureResult(group, detector, self.recordings, self.operations, hours, self.not_assessable, shares)


def score_log(
    setup: BenchmarkFile,
    group: str,
    path: Path,
    detectors: Sequence[Any],
    thresholds: Mapping[str, tuple[FittedThreshold, ...]],
    activation: Activation,
) -> Scored:
    """A log's traces; a log or detector that fails is left out and named, and nothing is raised."""
    scored = Scored()
    begin = perf_counter()
    try:
        recording, operations = load_operations(path, setup.machine_file, setup.operations, setup.path.parent)
        contacts = [] if group == HOLDOUT else find_contacts(recording, setup.onset)
        if group != HOLDOUT and not contacts:
            raise RecordingError(
                f"{path}: no contact found ({setup.onset.described})",
                "lower [onset] above_n, or move the log to [holdout]",
            )
    except CdtoolError as fault:
        scored.skipped.append(Skipped(shown_path(path, setup.path.parent), str(fault)))
        scored.reading = perf_counter() - begin
        return scored
    scored.reading = perf_counter() - begin
    scored.digest = (recording.source, recording.digest)
    scored.findings = told(recording)
    scored.skipped += lost(recording)
    for contact in contacts:
        if not any(contacts_of(item, [contact]) for item in operations):
            text = f"the contact at {contact.start:.3f} s lies in no operation (cut by {setup.operations})"
            scored.skipped.append(Skipped(recording.name, text))
    for operation in operations:
        inside = contacts_of(operation, contacts)
        detections, matchings = [], []
        for detector in detectors:
            try:
                detection = detect_operation(
                    operation,
                    setup.machine_file.machine,
                    detector,
                    thresholds[detector.name],
                    activation,
                    setup.watched,
                )
            except CdtoolError as fault:
                scored.skipped.append(Skipped(operation.name, str(fault)))
                continue
            detections.append(detection)
            matchings.append(match(detection.verdict, inside, detection.statistic, setup.window))
        scored.traces.append(Trace(group, operation, inside, tuple(detections), tuple(matchings)))
    scored.detecting = perf_counter() - begin - scored.reading
    return scored


def contact_results(trace: Trace) -> list[ContactResult]:
    """A row for each contact and detector."""
    recording = trace.operation.recording
    return [
        ContactResult(
            recording=recording.name,
            group=trace.group,
            detector=detection.detector,
            joint=detection.statistic.joints[found.alarm.joint] if found.alarm else None,
            onset_s=found.contact.start,
            onset_uncertainty_s=found.contact.uncertainty,
            alarm_s=found.alarm.time if found.alarm else None,
            latency_ms=1e3 * found.latency if found.alarm else None,
            outcome=found.outcome,
            force_at_alarm_n=_force_at_alarm(trace, found),
            peak_force_n=found.contact.peak_force if np.isfinite(found.contact.peak_force) else None,
            clipped=found.clipped,
            reason=found.reason or None,
        )
        for detection, matching in zip(trace.detections, trace.matchings, strict=True)
        for found in matching.matches
    ]


def false_alarm_results(trace: Trace) -> list[FalseAlarmResult]:
    """A row for each alarm without a contact."""
    return [
        FalseAlarmResult(
            trace.operation.name, trace.group, detection.detector, detection.statistic.joints[alarm.joint], alarm.time
        )
        for detection, matching in zip(trace.detections, trace.matchings, strict=True)
        for alarm in matching.false_alarms
    ]


def _force_at_alarm(trace: Trace, found: Match) -> float | None:
    recording = trace.operation.recording
    if found.alarm is None or "force" not in recording:
        return None
    force = float(previous_value(recording["force"], np.array([found.alarm.time]))[0, 0])
    return force if np.isfinite(force) else None
