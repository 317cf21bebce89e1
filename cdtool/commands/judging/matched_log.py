"""Match a log's contacts with the results of detectors on its operations, identically for every command."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from cdtool.alarms.pipeline import Detection
from cdtool.base.errors import CdtoolError
from cdtool.base.findings import Finding
from cdtool.commands.judging.judged_operation import Judged, contact_rows, false_alarm_rows
from cdtool.commands.judging.log_findings import log_warnings
from cdtool.commands.judging.scoring_rules import ScoringRules
from cdtool.detectors.detection import Alarm
from cdtool.recordings.operations import Operation, motion_spans
from cdtool.recordings.recording import Contact, Recording
from cdtool.results.results import ContactResult, FalseAlarmResult, RecordingFinding, Skipped
from cdtool.truth.force.curve import ForceTimeCurve, force_time_curve
from cdtool.truth.matching import match

# A stroke counts as assessable if at least this share of its samples is.
_JUDGED = 0.5


@dataclass(frozen=True)
class MatchedLog:
    """The outcome of a log's contacts and alarms.

    `judged`, `contacts` and `false_alarms` have one entry per operation, the latter two its rows. `curves` is the force
    by the contact's number.
    `not_scored` lists contacts that have no onset or are outside all operations; `findings` are about the log itself.
    """

    judged: tuple[Judged, ...]
    contacts: tuple[tuple[ContactResult, ...], ...]
    false_alarms: tuple[tuple[FalseAlarmResult, ...], ...]
    curves: dict[int, ForceTimeCurve]
    not_scored: tuple[Skipped, ...]
    findings: tuple[RecordingFinding, ...]


@dataclass(frozen=True)
class CutLog:
    """A log or run, or the part of it that is used: divided into operations by `cut_by`, with its contacts.

    `unwanted` are contacts of a log that should have none.
    """

    recording: Recording
    operations: Sequence[Operation]
    cut_by: str
    contacts: Sequence[Contact] = ()
    unwanted: Sequence[Contact] = ()


def match_log(
    log: CutLog, found: Sequence[Sequence[Detection]], group: str, rules: ScoringRules, rearm: float
) -> MatchedLog:
    """Match the detections `found` in each operation with the contacts; `rearm` [s] is a setting of the activation."""
    recording, contacts = log.recording, log.contacts
    inside = contacts_by_operation(log.operations, contacts)
    curves, doubts = force_curves(recording, contacts, rules.mass_before_cell)
    warned = log_warnings(recording, contacts, rules.onset)
    findings = [
        *_unseen_onsets(contacts, rules.window),
        *_unseen_forces(contacts, curves),
        *doubts,
        *_uncut_strokes(log, found),
    ]
    crossings = _pooled(found)
    judged = []
    for operation, own, detections in zip(log.operations, inside, found, strict=True):
        matchings = tuple(
            match(
                item.verdict,
                own,
                item.statistic,
                rules.window,
                of_log=contacts,
                crossings=crossings[item.detector],
                rearm=rearm,
            )
            for item in detections
        )
        judged.append(Judged(group, operation, own, tuple(detections), matchings))
    return MatchedLog(
        tuple(judged),
        tuple(tuple(contact_rows(item, recording, contacts, curves, rules.synchronisation)) for item in judged),
        tuple(tuple(false_alarm_rows(item)) for item in judged),
        curves,
        tuple(_not_scored(recording, contacts, inside, log.cut_by)),
        (*warned, *(RecordingFinding.of(recording.name, item) for item in findings)),
    )


def contacts_of(operation: Operation, contacts: Sequence[Contact]) -> tuple[Contact, ...]:
    """Return the contacts with their onset in an operation, and one in progress at its start."""
    part = operation.recording
    return tuple(
        contact
        for contact in contacts
        if part.start <= contact.start <= part.end
        or (contact.in_progress and contact.start <= part.end and contact.end >= part.start)
    )


def contacts_by_operation(operations: Sequence[Operation], contacts: Sequence[Contact]) -> list[tuple[Contact, ...]]:
    """Return the contacts of each operation; one at the boundary of two belongs to the earlier."""
    taken: set[Contact] = set()
    found = []
    for operation in operations:
        own = tuple(contact for contact in contacts_of(operation, contacts) if contact not in taken)
        taken.update(own)
        found.append(own)
    return found


def _not_scored(
    recording: Recording, contacts: Sequence[Contact], inside: Sequence[Sequence[Contact]], cut_by: str
) -> list[Skipped]:
    found = []
    for contact in contacts:
        if contact.in_progress:
            in_progress = Finding("in_progress", "force", {"end": contact.end})
            found.append(Skipped(recording.name, f"{in_progress.sentence}, it is not scored"))
        elif not any(contact in own for own in inside):
            text = f"the contact at {contact.start:.3f} s is outside all operations (cut by {cut_by})"
            found.append(Skipped(recording.name, text))
    return found


def _unseen_onsets(contacts: Sequence[Contact], window: float) -> list[Finding]:
    """Return a loss for each contact that began where load-cell samples are missing: its latency is unknown."""
    found = []
    for number, contact in enumerate(contacts, 1):
        if contact.hole and not contact.in_progress:
            later = contact.uncertainty if contact.uncertainty < window else None
            found.append(
                Finding(
                    "onset_unseen", "", {"contact": number, "hole": contact.hole, "time": contact.start, "later": later}
                )
            )
    return found


def _unseen_forces(contacts: Sequence[Contact], curves: Mapping[int, ForceTimeCurve]) -> list[Finding]:
    """Return a warning for each contact with a known onset whose force is partly missing."""
    found = []
    for number, curve in curves.items():
        contact = contacts[number - 1]
        hole = curve.longest_hole(contact.end - contact.start)
        if hole and not contact.hole:
            found.append(Finding("peak_unseen", "", {"contact": number, "hole": hole}))
    return found


def _pooled(found: Sequence[Sequence[Detection]]) -> dict[str, list[Alarm]]:
    """Return every detector's alarms in all operations of a log, in order of time."""
    pooled: dict[str, list[Alarm]] = {}
    for detections in found:
        for detection in detections:
            pooled.setdefault(detection.detector, []).extend(detection.verdict.crossings)
    return {name: sorted(items, key=lambda alarm: (alarm.time, alarm.column)) for name, items in pooled.items()}


def force_curves(
    recording: Recording, contacts: Sequence[Contact], mass_before_cell: float
) -> tuple[dict[int, ForceTimeCurve], list[Finding]]:
    """Return the force over each contact that has an onset, by its number; a contact without a force is reported.

    If the header does not confirm the unit of the force, no contact has one.
    """
    found: dict[int, ForceTimeCurve] = {}
    missing: list[Finding] = []
    if "force" not in recording:
        return found, missing
    for item in recording.findings:
        if item.channel == "force" and item.kind == "unit_contradicted":
            return found, [replace(item, severity="warning")]
    ends = [*(contact.start for contact in contacts[1:]), float("inf")]
    for number, (contact, until) in enumerate(zip(contacts, ends, strict=False), 1):
        if contact.in_progress:
            continue
        try:
            found[number] = force_time_curve(recording, contact, mass_before_cell, until)
        except CdtoolError as fault:
            missing.append(Finding("no_force", "", {"contact": number, "reason": fault.message}))
    return found, missing


def _uncut_strokes(log: CutLog, found: Sequence[Sequence[Detection]]) -> list[Finding]:
    """Return a warning with the strokes of an uncut log that some detector cannot assess although it can the first one.

    A detector that cannot assess the first stroke has other reasons. A stroke without a contact in a log with contacts
    does not matter: the rebound after an impact.
    """
    recording, contacts = log.recording, log.contacts
    detections = [item for of_operation in found for item in of_operation if not np.all(item.statistic.valid)]
    strokes = _strokes(recording) if log.cut_by == "whole" and detections else []
    numbers = tuple(
        number
        for number, stroke in enumerate(strokes[1:], 2)
        if not contacts or any(stroke[0] <= contact.start <= stroke[1] for contact in contacts)
        if any(_mostly_judged(item, *strokes[0]) and not _mostly_judged(item, *stroke) for item in detections)
    )
    return [Finding("log_not_cut", "", {"strokes": len(strokes), "not_assessable": numbers})] if numbers else []


def _strokes(recording: Recording) -> list[tuple[float, float]]:
    """Return the times [s] of the first and the last sample of each motion; empty if no speed is logged."""
    if "speed" not in recording and "reference_speed" not in recording:
        return []
    return [_bounds(recording, start, end) for start, end in motion_spans(recording)]


def _bounds(recording: Recording, start: float, end: float) -> tuple[float, float]:
    """Return the times [s] of the first and the last sample of any channel from `start` to `end` [s]."""
    first, last = math.inf, -math.inf
    for time in (series.time for series in recording.channels.values()):
        begin, after = int(np.searchsorted(time, start)), int(np.searchsorted(time, end, side="right"))
        if begin < after:
            first, last = min(first, float(time[begin])), max(last, float(time[after - 1]))
    return first, last


def _mostly_judged(detection: Detection, start: float, end: float) -> bool:
    statistic = detection.statistic
    first, last = int(np.searchsorted(statistic.time, start)), int(np.searchsorted(statistic.time, end, side="right"))
    valid = np.any(statistic.valid[first:last], axis=1)
    return bool(len(valid)) and float(np.mean(valid)) >= _JUDGED
