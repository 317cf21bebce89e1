"""The class of motion that runs to learn from have in common."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cdtool.errors import SignatureError
from cdtool.motion import MotionClass, motion_class
from cdtool.recording import Recording

# Speeds of one class differ by at most this share.
SPEED_TOLERANCE = 0.05


def common_class(recordings: Sequence[Recording]) -> MotionClass:
    """Direction, leading joint and median speed of the runs; raises SignatureError where one is of another class."""
    classes = [motion_class(recording) for recording in recordings]
    nominal = float(np.median([item.nominal_speed for item in classes]))
    common = MotionClass(classes[0].direction, nominal, classes[0].joint)
    if common.direction == 0:
        raise SignatureError(f"{recordings[0].name}: the axis does not move", "learn from runs with motion")
    for recording, item in zip(recordings, classes, strict=True):
        if not item.matches(common, SPEED_TOLERANCE):
            raise SignatureError(
                f"{recording.name}: runs {item.described}, the others {common.described}",
                "a signature belongs to one direction and speed; leave the run out",
            )
    return common
