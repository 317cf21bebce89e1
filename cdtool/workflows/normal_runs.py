"""What every channel normally looks like, learned from impact-free operations, each class of motion apart."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from statistics import median

from cdtool.operations import Operation
from cdtool.signature_file import SignatureFile
from cdtool.thresholds.normal_motion import NormalMotion, learn_normal_motion

# Speeds of one class differ by at most this share.
_TOLERANCE = 0.1


def normal_motions(operations: Sequence[Operation]) -> tuple[NormalMotion, ...]:
    """The normal motion of each class of motion of which there are enough runs with speed and position."""
    classes: list[list[Operation]] = []
    for operation in operations:
        for members in classes:
            if operation.motion.matches(members[0].motion, _TOLERANCE):
                members.append(operation)
                break
        else:
            classes.append([operation])
    learned = []
    for members in classes:
        motion = replace(members[0].motion, nominal_speed=median(item.motion.nominal_speed for item in members))
        normal = learn_normal_motion([item.recording.without_ground_truth() for item in members], motion)
        if normal is not None:
            learned.append(normal)
    return tuple(learned)


def with_operation(
    file: SignatureFile, operation: Operation, cap: float, forget: float | None
) -> tuple[NormalMotion, ...] | None:
    """A file's normal motions with one more impact-free operation in that of its class; None where it has none."""
    if file.normal is None:
        return None
    recording, motions = operation.recording.without_ground_truth(), list(file.normal)
    for i, normal in enumerate(motions):
        if normal.motion.matches(operation.motion, _TOLERANCE) and normal.serves(recording):
            motions[i] = normal.with_run(recording, cap, forget)
            break
    return tuple(motions)
