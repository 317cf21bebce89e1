"""One operation with the detection of every detector, its alarms matched with the contacts, and the resulting rows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from cdtool.alarms.pipeline import Detection
from cdtool.base.files.strict_json import finite
from cdtool.detectors.detection import Alarm, Band, Signal, Status, Verdict
from cdtool.recordings.operations import Operation
from cdtool.recordings.recording import MEASURED, Contact, Recording
from cdtool.results.curves.sweep import Swept
from cdtool.results.results import ContactResult, FalseAlarmResult
from cdtool.truth.force.curve import ForceTimeCurve, force_at
from cdtool.truth.matching import Match, Matching


@dataclass(frozen=True)
class Judged:
    """One operation with every detector's detection and its alarms matched with the contacts."""

    group: str
    operation: Operation
    contacts: tuple[Contact, ...]
    detections: tuple[Detection, ...]
    matchings: tuple[Matching, ...]
    sweeps: tuple[Swept | None, ...] = ()


def not_assessable(operation: Operation, detector: str, unit: str, reason: str, watched: Sequence[str]) -> Detection:
    """Return the detection of a detector that cannot be used on an operation: not assessable, with the reason."""
    recording = operation.recording
    time = next((recording[name].time for name in MEASURED if name in recording), np.empty(0))
    nothing = np.full((len(time), len(recording.joints)), np.nan)
    status = np.full(nothing.shape, Status.GAP, dtype=np.uint8)
    signal = Signal(time, nothing, status, unit, joints=recording.joints).watching(watched)
    limits = np.full(signal.values.shape, np.nan)
    return Detection(operation, detector, signal, Band(limits, limits), Verdict("not_assessable", reason=reason))


def contact_rows(
    judged: Judged,
    recording: Recording,
    contacts: Sequence[Contact],
    curves: Mapping[int, ForceTimeCurve],
    synchronisation: float,
) -> list[ContactResult]:
    """Return a row for each contact and detector; `synchronisation` [s]: largest offset of the load cell's clock."""
    numbers = {contact: number for number, contact in enumerate(contacts, 1)}
    rows = []
    for detection, matching in zip(judged.detections, judged.matchings, strict=True):
        own = detection.statistic.period + synchronisation
        for found in matching.matches:
            number = numbers[found.contact]
            resolution = own + _resolution_of_onset(recording, found.contact)
            rows.append(_contact_row(judged, recording, detection, found, number, curves.get(number), resolution))
    return rows


def _resolution_of_onset(recording: Recording, contact: Contact) -> float:
    """Return the resolution of the onset [s]; from a label file, at best that of the file and of the cell.

    Of a load cell in a file of its own, with how far its clock may be off.
    """
    if np.isfinite(contact.resolution):
        return contact.resolution + (recording.truth_clock if contact.found_by == "load cell" else 0.0)
    cell = recording["force"].period if "force" in recording else 0.0
    return (cell if np.isfinite(cell) else 0.0) + contact.uncertainty


def _contact_row(
    judged: Judged,
    recording: Recording,
    detection: Detection,
    found: Match,
    number: int,
    curve: ForceTimeCurve | None,
    resolution: float,
) -> ContactResult:
    contact, alarm = found.contact, found.alarm
    peak = curve.peak if curve else contact.peak_force
    # If samples are missing where a contact began, its force before its first sample was not measured.
    seen = curve is not None and alarm is not None and not (contact.hole and found.clipped)
    hole = curve.longest_hole(contact.end - contact.start) if curve else contact.hole
    return ContactResult(
        recording=recording.name,
        group=judged.group,
        detector=detection.detector,
        joint=alarm.joint if alarm else None,
        onset_s=contact.start,
        onset_uncertainty_s=None if contact.in_progress else contact.uncertainty,
        alarm_s=alarm.time if alarm else None,
        latency_ms=1e3 * found.latency if alarm else None,
        outcome=found.outcome,
        force_at_alarm_n=finite(abs(force_at(curve, found.latency))) if curve and seen else None,
        peak_force_n=finite(peak),
        clipped=found.clipped,
        reason=found.reason or None,
        contact=number,
        kind=contact.kind or None,
        found_by=contact.found_by,
        watched_ms=None if contact.in_progress else 1e3 * found.watched,
        resolution_ms=None if contact.in_progress else 1e3 * resolution,
        rest_n=finite(contact.rest),
        drift_n_per_s=contact.drift if np.isfinite(contact.rest) and not contact.in_progress else None,
        onset_hole_ms=1e3 * contact.hole or None,
        force_hole_ms=1e3 * hole or None,
        **_crossing(detection, alarm),
    )


def false_alarm_rows(judged: Judged) -> list[FalseAlarmResult]:
    """Return a row for each alarm without a contact."""
    return [
        FalseAlarmResult(
            recording=judged.operation.whole.name,
            group=judged.group,
            detector=detection.detector,
            joint=alarm.joint,
            time_s=alarm.time,
            operation=max(judged.operation.number, 1),
            **_crossing(detection, alarm),
        )
        for detection, matching in zip(judged.detections, judged.matchings, strict=True)
        for alarm in matching.false_alarms
    ]


def _crossing(detection: Detection, alarm: Alarm | None) -> dict[str, Any]:
    """Return the limit that an alarm crossed and the value; empty if no threshold raised it, as with triggers."""
    known = alarm if detection.threshold is not None else None
    return {
        "side": known.side if known else None,
        "statistic": known.statistic if known else None,
        "limit": known.limit if known else None,
    }
