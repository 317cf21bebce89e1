"""Findings about a log itself, independent of the detector and identical in every command.

Findings about the motion in a log: strokes, speed, direction.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from cdtool.base.findings import Finding, worst_first
from cdtool.machines.plausibility import derivatives
from cdtool.recordings.motion import motion_class
from cdtool.recordings.operations import motion_spans
from cdtool.recordings.recording import Contact, Recording
from cdtool.results.results import RecordingFinding
from cdtool.truth.doubts import truth_findings
from cdtool.truth.onset import OnsetRule


def motion_findings(recording: Recording) -> list[Finding]:
    """Return the number of strokes, speed and direction."""
    if "speed" not in recording:
        return [Finding("no_motion_mapped", "speed")]
    motion = motion_class(recording)
    if motion.direction == 0:
        return [Finding("no_motion", "speed")]
    unit = recording["speed"].unit
    strokes = len(motion_spans(recording))
    direction: Literal["forward", "backward"] = "forward" if motion.direction > 0 else "backward"
    joint = recording.joints[motion.joint] if len(recording.joints) > 1 else ""
    return [
        Finding(
            "motion",
            "speed",
            {
                "strokes": strokes,
                "nominal_speed": motion.nominal_speed,
                "unit": unit,
                "direction": direction,
                "joint": joint,
            },
        )
    ]


def log_findings(recording: Recording, contacts: Sequence[Contact], rule: OnsetRule) -> tuple[Finding, ...]:
    """Return the findings of reading a log, and those about its motion and load cell, worst first.

    `contacts` are the log's contacts by `rule`.
    """
    found = [*recording.findings, *motion_findings(recording)]
    return worst_first(dict.fromkeys([*found, *truth_findings(recording, contacts, rule)]))


def log_warnings(recording: Recording, contacts: Sequence[Contact], rule: OnsetRule) -> list[RecordingFinding]:
    """Return the warnings among the findings of a log, with its name; `runs.lost` returns the losses.

    Among them are channels whose derivatives contradict each other in this log, if not in those that were learned from.
    """
    contradicted = [item for item in derivatives([before_contact(recording, contacts)]) if item.severity == "loss"]
    found = [item for item in log_findings(recording, contacts, rule) if item.severity == "warning"]
    found += [replace(item, severity="warning") for item in contradicted]
    return [RecordingFinding.of(recording.name, item) for item in found]


def before_contact(recording: Recording, contacts: Sequence[Contact]) -> Recording:
    """Return the part before the first contact: during contact the elastic drive separates motor and load."""
    if not contacts:
        return recording
    since = contacts[0].end if contacts[0].in_progress else -np.inf
    first = next((contact.start for contact in contacts if not contact.in_progress), np.inf)
    return recording.between(since, first)
