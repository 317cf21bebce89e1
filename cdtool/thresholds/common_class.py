"""The class of motion that the runs to learn from have in common."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cdtool.base.errors import SignatureError
from cdtool.recordings.motion import MotionClass, measured_class
from cdtool.recordings.motion.speed_course import learn_course
from cdtool.recordings.recording import Recording

# Nominal speeds of one class differ by at most this share.
SPEED_TOLERANCE = 0.1


def common_class(recordings: Sequence[Recording], alignment: str = "time_then_position") -> MotionClass:
    """Return direction, leading joint, median speed and speed curve of runs of one class.

    Raises SignatureError if one is of another class: `commands.learning.fitting` groups the runs before.
    """
    classes = [measured_class(recording) for recording in recordings]
    nominal = float(np.median([item.nominal_speed for item in classes]))
    common = replace(classes[0], nominal_speed=nominal)
    if common.direction == 0:
        raise SignatureError(f"{recordings[0].name}: the axis does not move", "learn from runs with motion")
    for recording, item in zip(recordings, classes, strict=True):
        if not item.matches(common, SPEED_TOLERANCE):
            raise SignatureError(
                f"{recording.name}: runs {item.described}, the others {common.described}",
                "a signature belongs to one direction and speed; leave the run out",
            )
    if any("speed" not in recording for recording in recordings):
        return common
    return replace(common, course=learn_course(recordings, common.direction, nominal, common.joint, alignment))
