"""Findings about the motion in a log: strokes, agreement of speed and position, bandwidth of the friction EKF."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np

from cdtool.clock import GAP_PERIODS, integrate, previous_value
from cdtool.detectors.base import of_joint
from cdtool.findings import Finding
from cdtool.findings.channels import DerivedSpeed, IntegratedPosition
from cdtool.findings.motion import (
    BelowMinimumSpeed,
    JointsSwapped,
    Motion,
    NoMotion,
    NoMotionMapped,
    Poles,
    SpeedSignOpposite,
    SpeedUnitDoubtful,
)
from cdtool.kernels import READ_ONLY, kernel
from cdtool.machine_file import MachineFile
from cdtool.median_kernel import median_of
from cdtool.motion import motion_class
from cdtool.operations import motion_spans
from cdtool.recording import FloatArray, Recording, Series

# Rounding errors are far smaller than a step of any encoder: this share of the largest position, or this value.
_ROUNDING, _LEAST_POSITION = 1e-9, 1e-300
# The columns of two joints are exchanged if both positions correlate with the integral of their own speed by less than
# the first value, and one with that of the other joint by more than the second.
_OWN_FIT, _OTHER_FIT = 0.9, 0.99
# Below this share of the largest movement a joint hardly moves: its integrated speed is noise and offset.
_HARDLY = 0.01
_PARTS, _ABOVE_NOISE = 50, 10.0
# The noise, 1.05 times a median distance from the median step, is at most 2.1 times the largest step.
_CERTAIN = 2.5
_FACTORS = (
    (180.0 / np.pi, "deg and rad"),
    (1000.0, "mm and m, or ms and s"),
    (1e6, "um and m, or us and s"),
    (3600.0, "h and s"),
    (60.0 / (2.0 * np.pi), "rpm and rad/s"),
    (60.0, "min and s"),
    (6.0, "rpm and deg/s"),
    (2.0 * np.pi, "turns and rad"),
)


def motion_findings(recording: Recording) -> list[Finding]:
    """Return the number of strokes, speed and direction, and where speed and position disagree."""
    if "speed" not in recording:
        return [Finding(NoMotionMapped(), "speed", "note")]
    motion = motion_class(recording)
    if motion.direction == 0:
        return [Finding(NoMotion(), "speed", "note")]
    unit = recording["speed"].unit
    strokes = len(motion_spans(recording))
    direction: Literal["forward", "backward"] = "forward" if motion.direction > 0 else "backward"
    fact = Motion(strokes, motion.nominal_speed, unit, direction, _joint_name(recording, motion.joint))
    return [Finding(fact, "speed", "note"), *_consistency(recording)]


def _consistency(recording: Recording) -> list[Finding]:
    """Return findings where the mapped speed does not match the derivative of the mapped position."""
    is_derived = any(isinstance(item.fact, DerivedSpeed | IntegratedPosition) for item in recording.findings)
    if is_derived or "position" not in recording:
        return []
    found = []
    speed, position = recording["speed"], recording["position"]
    moved = [_moved(position.values[:, j]) for j in range(speed.joint_count)]
    integrals = previous_value(integrate(speed, position.unit), position.time)
    for j in range(speed.joint_count):
        if moved[j] <= _HARDLY * max(moved):
            continue
        joint = recording.joints[j] if len(recording.joints) > 1 else ""
        expected, gained, spanned, travelled = _travel(integrals, speed, position, j)
        if expected <= 0.0 or spanned <= 0.0:
            continue
        if not 0.8 < expected / spanned < 1.25:
            between = units_apart(max(expected / spanned, spanned / expected))
            fact = SpeedUnitDoubtful(joint, expected, spanned, position.unit, speed.unit, between)
            found.append(Finding(fact, "speed"))
        elif abs(travelled) > 0.5 * spanned and np.sign(travelled) != np.sign(gained):
            found.append(Finding(SpeedSignOpposite(joint), "speed"))
    return [*found, *_swapped(recording, integrals)]


def _moved(values: FloatArray) -> float:
    """Return the range of a joint's position (n,) without noise and encoder steps; 0 at rest.

    It is the range of the medians of fifty parts of the log, if it exceeds ten times the noise of single samples and
    ten steps of the encoder.
    """
    present = np.isfinite(values)
    known = np.ascontiguousarray(values) if present.all() else values[present]
    if len(known) < 3:
        return 0.0
    travel: tuple[float, float, float] = travel_of(known, min(_PARTS, len(known)))
    span, encoder, largest = travel
    if span <= _ABOVE_NOISE * encoder:
        return 0.0
    # The noise is less than the largest step: where the span is far above that one, it need not be known.
    if span > _CERTAIN * _ABOVE_NOISE * largest:
        return span
    steps = np.diff(known)
    noise = 1.48 * float(np.median(np.abs(steps - np.median(steps)))) / np.sqrt(2.0)
    return span if span > _ABOVE_NOISE * noise else 0.0


def units_apart(ratio: float, tolerance: float = 0.05) -> str:
    """Return the units that differ by a factor, the nearest ones within the tolerance; empty if it is none of theirs.

    >>> units_apart(1000.0), units_apart(60.0), units_apart(57.3), units_apart(3.0)
    ('mm and m, or ms and s', 'min and s', 'deg and rad', '')
    """
    factor, units = min(_FACTORS, key=lambda item: abs(math.log(max(ratio, 1e-300) / item[0])))
    return units if abs(ratio / factor - 1.0) < tolerance else ""


def _joint_name(recording: Recording, joint: int) -> str:
    """Return the name of a joint; empty if there is but one."""
    return recording.joints[joint] if len(recording.joints) > 1 else ""


def _swapped(recording: Recording, integrals: FloatArray) -> list[Finding]:
    """Return joints whose position follows the speed of another joint: columns in the wrong order."""
    speed, position = recording["speed"], recording["position"]
    if speed.joint_count < 2 or len(speed) < 3 or len(position) < 3:
        return []
    known = np.isfinite(position.values).all(axis=1) & np.isfinite(integrals).all(axis=1)
    integrals, positions = integrals[known], position.values[known]
    if len(positions) < 3:
        return []
    joints = speed.joint_count
    with np.errstate(invalid="ignore", divide="ignore"):  # a joint at rest has no correlation
        fit = np.nan_to_num(np.corrcoef(integrals.T, positions.T)[:joints, joints:])
    found = []
    for j, joint in enumerate(recording.joints):
        best = int(np.argmax(fit[:, j]))
        if fit[best, j] > _OTHER_FIT and max(fit[j, j], fit[best, best]) < _OWN_FIT:
            found.append(Finding(JointsSwapped(joint, recording.joints[best]), "position"))
    return found


def _travel(integrals: FloatArray, speed: Series, position: Series, joint: int) -> tuple[float, float, float, float]:
    """Return range and last value of the integral of a joint's speed, then of its position, without gaps of a clock."""
    travel: tuple[float, float, float, float] = travel_without_gaps(
        position.time,
        np.ascontiguousarray(integrals[:, joint]),
        np.ascontiguousarray(position.values[:, joint]),
        GAP_PERIODS * position.period,
        speed.time,
        GAP_PERIODS * speed.period,
    )
    return travel


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


@kernel(f"UniTuple(float64, 3)({READ_ONLY}, int64)", exact=True)
def travel_of(position: FloatArray, parts: int) -> tuple[float, float, float]:
    """Return the range of the medians of so many parts of a position (n,), its smallest step and its largest one.

    The smallest step is that of an encoder, without rounding errors; 0 if all are equal. No sample is missing, and
    no part is empty: the first n modulo `parts` of them have a sample more.
    """
    count = len(position)
    scratch = np.empty(count // parts + 1)
    lowest = math.inf
    highest = -math.inf
    begin = 0
    for i in range(parts):
        size = count // parts + (1 if i < count % parts else 0)
        for k in range(size):
            scratch[k] = position[begin + k]
        begin += size
        median = median_of(scratch, size)
        lowest, highest = min(lowest, median), max(highest, median)
    farthest = _LEAST_POSITION
    for k in range(count):
        farthest = max(farthest, abs(position[k]))
    smallest = 0.0
    largest = 0.0
    is_any = False
    for k in range(1, count):
        step = abs(position[k] - position[k - 1])
        largest = max(largest, step)
        if step > _ROUNDING * farthest and (step < smallest or not is_any):
            smallest = step
            is_any = True
    return float(highest - lowest), float(smallest), float(largest)


@kernel(f"UniTuple(float64, 4)({READ_ONLY}, {READ_ONLY}, {READ_ONLY}, float64, {READ_ONLY}, float64)", exact=True)
def travel_without_gaps(
    time: FloatArray,
    integrated: FloatArray,
    position: FloatArray,
    longest_step: float,
    speed_time: FloatArray,
    longest_speed_step: float,
) -> tuple[float, float, float, float]:
    """Return the range and the last value of the integral of a speed, then those of the position, (n,) each, from 0.

    Changes in gaps of a clock are left out, as the speed there is unknown; also missing samples. A gap is longer than
    the longest step [s]; the speed's times (m,) [s] are its own. All are 0 with fewer than two samples.
    """
    before = -1
    at = -1
    pauses = 0  # gaps of the speed up to sample `at`
    pauses_before = 0
    low, high, gained = 0.0, 0.0, 0.0
    lowest, highest, travelled = 0.0, 0.0, 0.0
    for k in range(len(time)):
        if not (math.isfinite(position[k]) and math.isfinite(integrated[k])):
            continue
        while at + 1 < len(speed_time) and speed_time[at + 1] <= time[k]:
            at += 1
            if at > 0 and speed_time[at] - speed_time[at - 1] > longest_speed_step:
                pauses += 1
        after = pauses
        if 0 <= at < len(speed_time) - 1 and speed_time[at + 1] - speed_time[at] > longest_speed_step:
            after += 1
        if before >= 0 and time[k] - time[before] <= longest_step and after == pauses_before:
            gained += integrated[k] - integrated[before]
            travelled += position[k] - position[before]
            low, high = min(low, gained), max(high, gained)
            lowest, highest = min(lowest, travelled), max(highest, travelled)
        before = k
        pauses_before = pauses
    return high - low, gained, highest - lowest, travelled
