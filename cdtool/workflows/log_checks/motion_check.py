"""Findings about the motion in a log: strokes, speed, direction, bandwidth of the friction EKF."""

from __future__ import annotations

from typing import Literal

import numpy as np

from cdtool.detectors.base import of_joint
from cdtool.findings import Finding
from cdtool.findings.motion import (
    BelowMinimumSpeed,
    Motion,
    NoMotion,
    NoMotionMapped,
    Poles,
)
from cdtool.machine_file import MachineFile
from cdtool.motion import motion_class
from cdtool.operations import motion_spans
from cdtool.recording import Recording


def motion_findings(recording: Recording) -> list[Finding]:
    """Return the number of strokes, speed and direction."""
    if "speed" not in recording:
        return [Finding(NoMotionMapped(), "speed", "note")]
    motion = motion_class(recording)
    if motion.direction == 0:
        return [Finding(NoMotion(), "speed", "note")]
    unit = recording["speed"].unit
    strokes = len(motion_spans(recording))
    direction: Literal["forward", "backward"] = "forward" if motion.direction > 0 else "backward"
    fact = Motion(strokes, motion.nominal_speed, unit, direction, _joint_name(recording, motion.joint))
    return [Finding(fact, "speed", "note")]


def _joint_name(recording: Recording, joint: int) -> str:
    """Return the name of a joint; empty if there is but one."""
    return recording.joints[joint] if len(recording.joints) > 1 else ""


def bandwidth_findings(recording: Recording, machine_file: MachineFile) -> list[Finding]:
    """Return the poles of the friction EKF at the nominal speed of an axis, or that this is below `minimum_speed`."""
    if machine_file.machine.coupled or not all(channel in recording for channel in ("torque", "speed", "acceleration")):
        return []
    motion = motion_class(recording)
    detector = of_joint(machine_file.detector("friction_ekf"), motion.joint, len(recording.joints))
    if motion.nominal_speed < detector.minimum_speed:
        name = _joint_name(recording, motion.joint)
        below = BelowMinimumSpeed(detector.minimum_speed, recording["speed"].unit, name)
        return [Finding(below, "friction_ekf")]
    inertia = float(machine_file.machine.nominal_inertia[motion.joint])
    if inertia <= 0.0:
        return []
    torque = recording["torque"].values[:, motion.joint]
    torque = torque[np.isfinite(torque)]
    if not len(torque):
        return []
    friction = float(np.median(np.abs(torque))) / motion.nominal_speed
    poles, _ = detector.steady_state(inertia, motion.nominal_speed, friction, recording["speed"].period)
    fact = Poles(motion.nominal_speed, recording["speed"].unit, float(poles[0]), float(poles[1]))
    return [Finding(fact, "friction_ekf", "note")]
