"""The rows of a detection: of `DetectionResult.alarms` and `summary()`, and of `cdtool detect --json`."""

from __future__ import annotations

from dataclasses import dataclass

from cdtool.alarms.pipeline import Detection
from cdtool.commands.detecting.detection import Detected, contact_of
from cdtool.detectors.detection import Alarm
from cdtool.truth.matching import Matching


@dataclass(frozen=True)
class AlarmRow:
    """One alarm: a row of `DetectionResult.alarms`."""

    recording: str
    operation: str
    detector: str
    joint: str
    time_s: float
    side: str
    statistic: float
    limit: float
    contact_onset_s: float | None


@dataclass(frozen=True)
class OperationRow:
    """The verdict on one operation, its first alarm, its first latency: a row of `DetectionResult.summary()`."""

    recording: str
    operation: str
    detector: str
    verdict: str
    alarms: int
    first_alarm_s: float | None
    contacts: int
    latency_ms: float | None
    assessed_s: float
    reason: str | None


def alarm_row(found: Detected, detection: Detection, alarm: Alarm) -> AlarmRow:
    """Return the row of an alarm."""
    contact = contact_of(found, alarm)
    onset = None if contact is None or contact.in_progress else contact.start
    names = (found.recording.name, detection.operation.name, detection.detector, alarm.joint)
    return AlarmRow(*names, alarm.time, alarm.side, alarm.statistic, alarm.limit, onset)


def operation_row(found: Detected, detection: Detection, matching: Matching) -> OperationRow:
    """Return the row of an operation."""
    verdict = detection.verdict
    latencies = [1e3 * item.latency for item in matching.matches if item.alarm]
    return OperationRow(
        found.recording.name,
        detection.operation.name,
        detection.detector,
        verdict.outcome,
        len(verdict.alarms),
        verdict.alarms[0].time if verdict.alarms else None,
        len(matching.matches),
        latencies[0] if latencies else None,
        detection.assessed_seconds,
        verdict.reason or None,
    )
