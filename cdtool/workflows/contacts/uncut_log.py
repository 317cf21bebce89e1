"""A log that is judged as one operation but holds several strokes: which of them could not be judged for that."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cdtool.errors import CdtoolError
from cdtool.evaluation.results import Skipped
from cdtool.operations import Operation, operations_of
from cdtool.pipeline import Detection
from cdtool.plain_text import counted
from cdtool.recording import Recording

# A stroke counts as judged where at least this share of its samples is.
_JUDGED = 0.5


def uncut_log(recording: Recording, found: Sequence[Sequence[Detection]], cut_by: str) -> list[Skipped]:
    """A warning where the first stroke of a log was judged and a later one was not, since the log is not cut.

    `found` are the detections of its operations, `cut_by` is how it was cut into them.
    """
    detections = [item for of_operation in found for item in of_operation]
    if cut_by != "whole" or all(np.all(item.statistic.valid) for item in detections):
        return []
    strokes = _strokes(recording)
    blind = [
        number
        for number, stroke in enumerate(strokes[1:], 2)
        if any(_judged(item, strokes[0]) and not _judged(item, stroke) for item in detections)
    ]
    if not blind:
        return []
    which = f"stroke {blind[0]} was" if len(blind) == 1 else f"{len(blind)} of them were"
    text = (
        f"holds {counted(len(strokes), 'stroke')} in one operation, and {which} not judged: cut it with "
        'operations = "motion" in the benchmark file, or --operations motion'
    )
    return [Skipped(recording.name, text)]


def _strokes(recording: Recording) -> list[Operation]:
    if "speed" not in recording and "reference_speed" not in recording:
        return []
    try:
        return operations_of(recording, "motion")
    except CdtoolError:
        return []


def _judged(detection: Detection, stroke: Operation) -> bool:
    statistic = detection.statistic
    inside = (statistic.time >= stroke.recording.start) & (statistic.time <= stroke.recording.end)
    valid = np.any(statistic.valid[inside], axis=1)
    return bool(len(valid)) and float(np.mean(valid)) >= _JUDGED
