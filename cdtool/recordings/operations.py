"""Divide a recording into operations (strokes), by motion or by a trigger, with class of direction and speed.

A log that contains several runs is cut into recordings before, see `RunCut` and `formats.channels.run_reading`; each of
them is one operation.

An operation keeps the recording's time. This analysis uses the whole recording, for learning, scoring and naming. No
verdict depends on it: a detector runs over the whole log, and for its thresholds the start of a stroke is determined
from earlier samples only (`recordings.motion.strokes`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import numpy.typing as npt

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.base.errors import RecordingError, UsageError, nearest
from cdtool.recordings.motion import MotionClass, leading_joint, motion_class
from cdtool.recordings.motion.strokes import SHORTEST_REST
from cdtool.recordings.recording import Recording

HOW_TO_CUT = ("whole", "motion", "trigger")
# The forms of a cut into runs, for messages.
_RUN_CUTS = ("column:NAME", "clock-reset", "label:NAME")

# A larger speed counts as this one, so that the quantile is finite.
_LARGEST = float(np.finfo(np.float64).max)
# Length of the rest before and after a stroke that belongs to it [s]: detectors start up there.
_MARGIN = 0.5


@dataclass(frozen=True)
class Operation:
    """One stroke: its part of the recording (named recording#n if cut), its class and n (0: the whole recording).

    `log` is the recording that it was cut from, by `cut`; None: it is the whole one.
    """

    recording: Recording
    motion: MotionClass
    number: int = 0
    log: Recording | None = None
    cut: str = "whole"

    @property
    def whole(self) -> Recording:
        """Return the recording that it was cut from."""
        return self.log or self.recording

    @property
    def name(self) -> str:
        """Return the operation's name."""
        return self.recording.name


@dataclass(frozen=True)
class RunCut:
    """How a log is cut into runs, each of which is a recording of its own with its own clock.

    By a `column` of ids, by a column of labels (where the same label again is another run), or where the clock starts
    again. In a log of messages, `column` is a topic and a field with a blank between them.
    """

    by: Literal["column", "label", "clock-reset"]
    column: str = ""

    @classmethod
    def of(cls, operations: str) -> RunCut | None:
        """Return the cut that `operations` states; None if it does not cut a log into runs.

        Raises UsageError for an unknown word, or if the column's name is missing.

        >>> RunCut.of("column:run_id"), RunCut.of("motion")
        (RunCut(by='column', column='run_id'), None)
        """
        if operations in HOW_TO_CUT:
            return None
        if operations == "clock-reset":
            return cls("clock-reset")
        by, colon, column = operations.partition(":")
        if by in ("column", "label") and colon:
            if not column.strip():
                raise UsageError(f"operations '{operations}' has no column's name", f"write {by}:NAME")
            return cls("column" if by == "column" else "label", column.strip())
        raise UsageError(f"unknown operations '{operations}'", nearest(operations, (*HOW_TO_CUT, *_RUN_CUTS)))


def operations_of(recording: Recording, how: str = "whole") -> list[Operation]:
    """Return the operations of a recording: the whole recording, its motions, or its trigger's high phases.

    A recording that is a run is one operation. Raises UsageError for an unknown method, RecordingError if a required
    channel is missing or no operation is found.
    """
    if how == "whole" or RunCut.of(how) is not None:
        return [Operation(recording, motion_class(recording))]
    spans: Sequence[tuple[float, float]] = motion_spans(recording) if how == "motion" else _trigger_spans(recording)
    if not spans:
        raise RecordingError(
            f"{recording.name}: no operation found by {how}",
            "see cdtool info, or set operations to whole",
        )
    operations = []
    for number, (start, end) in enumerate(spans, 1):
        part = replace(recording.between(start, end), name=f"{recording.name}#{number}")
        operations.append(Operation(part, motion_class(part), number, recording, how))
    return operations


def motion_spans(recording: Recording) -> tuple[tuple[float, float], ...]:
    """Return start and end [s] of each motion of a recording; raises RecordingError without a speed."""
    return recording.derived("motion spans", lambda: tuple(_motion_spans(recording)))


def _motion_spans(recording: Recording) -> list[tuple[float, float]]:
    series = recording["reference_speed" if "reference_speed" in recording else "speed"]
    joint = leading_joint(series)
    speed = np.ascontiguousarray(series.values[:, joint])
    if not len(speed):
        return []
    sign = _directions(speed)
    strokes: list[list[float]] = []
    direction = 0
    for first, last in _runs(sign):
        if sign[first] == 0:
            continue
        start, end = float(series.time[first]), float(series.time[last])
        if strokes and direction == sign[first] and start - strokes[-1][1] < SHORTEST_REST:
            strokes[-1][1] = end
        else:
            strokes.append([start, end])
            direction = int(sign[first])
    strokes = [stroke for stroke in strokes if stroke[1] - stroke[0] >= 0.2]  # s: a shake
    return _with_margins(strokes, recording)


def _trigger_spans(recording: Recording) -> list[tuple[float, float]]:
    series = recording["trigger"]
    if not len(series):
        return []
    high: BoolArray = np.nan_to_num(series.values[:, 0]) > 0.5
    return [(float(series.time[a]), float(series.time[b])) for a, b in _runs(high) if high[a]]


def _runs(values: npt.NDArray[np.int8 | np.bool_]) -> list[tuple[int, int]]:
    edges = np.flatnonzero(values[1:] != values[:-1]) + 1
    starts = [0, *edges.tolist()]
    ends = [*(edges - 1).tolist(), len(values) - 1]
    return list(zip(starts, ends, strict=True))


def _with_margins(strokes: list[list[float]], recording: Recording) -> list[tuple[float, float]]:
    spans = []
    for i, (start, end) in enumerate(strokes):
        before = recording.start if i == 0 else 0.5 * (strokes[i - 1][1] + start)
        after = recording.end if i == len(strokes) - 1 else 0.5 * (end + strokes[i + 1][0])
        spans.append((max(before, start - _MARGIN), min(after, end + _MARGIN)))
    return spans


def _directions(speed: FloatArray) -> npt.NDArray[np.int8]:
    """Return the direction (n,) in which a speed moves: 1, -1, or 0 at rest, also where it is missing.

    It is at rest up to a share of the magnitude that 99 % of the samples do not exceed.
    """
    size = np.minimum(np.abs(np.where(np.isnan(speed), 0.0, speed)), _LARGEST)
    rest = 0.05 * np.quantile(size, 0.99)  # 5 % of that magnitude
    return np.asarray((speed > rest).astype(np.int8) - (-speed > rest).astype(np.int8))
