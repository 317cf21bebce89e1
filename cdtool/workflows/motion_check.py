"""Does a recording move, do its speed and position agree, and how fast can the friction EKF be on it?"""

from __future__ import annotations

import numpy as np

from cdtool.clock import integrate, previous_value
from cdtool.detectors.base import of_joint
from cdtool.errors import CdtoolError
from cdtool.machine_file import MachineFile
from cdtool.motion import motion_class
from cdtool.operations import operations_of
from cdtool.recording import Finding, Recording, Series

# Two joints whose positions correlate with the integrals of their own speeds less than the first of these, and of which
# one correlates with the other's more than the second, have their columns mixed up.
_OWN_FIT, _OTHER_FIT = 0.9, 0.99


def motion_findings(recording: Recording) -> list[Finding]:
    """How the machine moves and how many operations that makes; what does not fit together."""
    if "speed" not in recording:
        return [Finding("neither speed nor position is mapped: no operation can be cut or classed", "speed", "note")]
    motion = motion_class(recording)
    if motion.direction == 0:
        return [Finding("the axis does not move", "speed", "note")]
    unit = recording["speed"].unit
    try:
        strokes = len(operations_of(recording, "motion"))
    except CdtoolError:
        strokes = 0
    word = "forward" if motion.direction > 0 else "backward"
    cut = f"{strokes} {'stroke' if strokes == 1 else 'strokes'} by motion"
    text = f"{cut}; nominal speed {motion.nominal_speed:.4g} {unit}, mainly {word}"
    return [Finding(text, "speed", "note"), *_consistency(recording)]


def _consistency(recording: Recording) -> list[Finding]:
    """Does the mapped speed fit the derivative of the mapped position?"""
    derived = any(
        item.channel in ("speed", "position") and "not in the log" in item.message for item in recording.findings
    )
    if derived or "position" not in recording:
        return []
    found = []
    speed, position = recording["speed"], recording["position"]
    for j in range(speed.joint_count):
        way = _travelled(speed, j)
        seen = float(np.nanmax(position.values[:, j]) - np.nanmin(position.values[:, j]))
        signed = (
            float(position.values[-1, j] - position.values[0, j])
            if np.isfinite(position.values[[0, -1], j]).all()
            else 0.0
        )
        if way[1] <= 0.0 or seen <= 0.0:
            continue
        if not 0.8 < way[1] / seen < 1.25:
            found.append(Finding(f"integrates to {way[1]:.4g}, the position spans {seen:.4g}: check units", "speed"))
        elif abs(signed) > 0.5 * seen and np.sign(signed) != np.sign(way[0]):
            found.append(Finding("has the opposite sign of the position's derivative", "speed"))
    return [*found, *_swapped(recording)]


def _swapped(recording: Recording) -> list[Finding]:
    """Joints whose position follows another joint's speed: columns in the wrong order."""
    speed, position = recording["speed"], recording["position"]
    if speed.joint_count < 2 or len(speed) < 3 or len(position) < 3:
        return []
    ways = previous_value(integrate(speed, position.unit), position.time)
    known = np.isfinite(position.values).all(axis=1) & np.isfinite(ways).all(axis=1)
    ways, places = ways[known], position.values[known]
    if len(places) < 3:
        return []
    joints = speed.joint_count
    with np.errstate(invalid="ignore", divide="ignore"):  # a joint that stands still fits nothing
        fit = np.nan_to_num(np.corrcoef(ways.T, places.T)[:joints, joints:])
    found = []
    for j, joint in enumerate(recording.joints):
        best = int(np.argmax(fit[:, j]))
        if fit[best, j] > _OTHER_FIT and max(fit[j, j], fit[best, best]) < _OWN_FIT:
            text = f"that of {joint} follows the speed of {recording.joints[best]}: columns in another order?"
            found.append(Finding(text, "position"))
    return found


def _travelled(speed: Series, joint: int) -> tuple[float, float]:
    path = integrate(speed, "").values[:, joint]
    return float(path[-1]), float(path.max() - path.min())


def bandwidth_findings(recording: Recording, machine_file: MachineFile) -> list[Finding]:
    """How fast the friction EKF can be on this log: its poles at the nominal speed of an axis."""
    if machine_file.machine.coupled or not all(channel in recording for channel in ("torque", "speed", "acceleration")):
        return []
    motion = motion_class(recording)
    detector = of_joint(machine_file.detector("friction_ekf"), motion.joint, len(recording.joints))
    if motion.nominal_speed < detector.minimum_speed:
        return [
            Finding(f"nominal speed below minimum_speed ({detector.minimum_speed:g}): not applicable", "friction_ekf")
        ]
    inertia = float(machine_file.machine.nominal_inertia[motion.joint])
    if inertia <= 0.0:
        return []
    force = np.nanmedian(np.abs(recording["torque"].values[:, motion.joint]))
    friction = float(force) / motion.nominal_speed
    poles, _ = detector.steady_state(inertia, motion.nominal_speed, friction, recording["speed"].period)
    slow, quick = float(poles[0]), float(poles[1])
    text = f"poles at {motion.nominal_speed:.3g} {recording['speed'].unit}: {slow:.3g} and {quick:.3g} rad/s"
    return [Finding(text, "friction_ekf", "note")]
