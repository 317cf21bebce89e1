"""Findings about the motion in a log: strokes, speed, direction."""

from __future__ import annotations

from typing import Literal

from cdtool.base.findings import Finding
from cdtool.recordings.motion import motion_class
from cdtool.recordings.operations import motion_spans
from cdtool.recordings.recording import Recording


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
