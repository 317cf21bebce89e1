"""Where in its stroke an operation is, sample by sample and causally: time since the motion began, travel, phase."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.recordings.clock import previous_value
from cdtool.recordings.recording import Recording

Alignment = Literal["time_then_position", "time", "position"]
ALIGNMENTS: tuple[Alignment, ...] = get_args(Alignment)
#: The stroke has begun at this share of the nominal speed: noise and settling are below it.
START_SHARE = 0.1
#: It runs from this share of the nominal speed on.
RUNNING_SHARE = 0.95
# The motion has started once this many consecutive speed samples exceed the start speed, or turned round: a single
# wrong sample does not decide.
CONFIRM = 3


@dataclass(frozen=True)
class Progress:
    """On a signal's clock (n,): `elapsed` s since the motion began, `travel` since then, `running` after acceleration.

    NaN (and False) before the motion begins. Travel is a running maximum: it stays constant while the axis runs
    backward. Read-only: several detectors use the same.
    """

    elapsed: FloatArray
    travel: FloatArray
    running: BoolArray

    def part(self, rows: slice) -> Progress:
        """Return the progress at some of the samples."""
        return Progress(self.elapsed[rows], self.travel[rows], self.running[rows])


def progress(
    recording: Recording,
    clock: FloatArray,
    direction: int,
    start_speed: float,
    running_speed: float,
    joint: int,
) -> Progress:
    """Return the progress from measured speed and position of the leading joint, each at or before the sample.

    On the clock of one of the recording's channels it is computed once, and stored with the speed.
    """
    motion = (direction, start_speed, running_speed, joint)
    own = recording.own_clock(clock)
    if own is None:
        return _progress(recording, clock, *motion)
    speed, position = recording["speed"], recording.channels.get("position")
    return speed.derived(("progress", *motion), lambda: _progress(recording, own, *motion), position, own)


def _progress(
    recording: Recording,
    clock: FloatArray,
    direction: int,
    start_speed: float,
    running_speed: float,
    joint: int,
) -> Progress:
    speed = recording["speed"]
    forward = np.ascontiguousarray(speed.values[:, joint])
    starts, runs = _begin(speed.time, forward, direction, start_speed, running_speed)
    moves = clock >= starts
    elapsed = np.where(moves, clock - starts, np.nan)
    travel, running = np.full(len(clock), np.nan), clock >= runs
    if moves.any():  # otherwise no position is needed
        with np.errstate(invalid="ignore"):
            along = direction * previous_value(recording["position"], clock)[moves, joint]
        furthest = np.maximum.accumulate(np.where(np.isnan(along), -np.inf, along))
        first = along[np.isfinite(along).argmax()]
        reached = np.isfinite(furthest)
        travel[np.flatnonzero(moves)[reached]] = furthest[reached] - first
    for part in (elapsed, travel, running):
        part.flags.writeable = False
    return Progress(elapsed, travel, running)


def _begin(
    time: FloatArray, speed: FloatArray, direction: int, start_speed: float, running_speed: float
) -> tuple[float, float]:
    """Return when the motion is confirmed to have begun, and when it first runs from there on [s]; NaN: never."""
    with np.errstate(invalid="ignore"):  # 0 times infinity
        forward = direction * speed
    moving = np.cumsum(np.concatenate(([0], forward >= start_speed)))
    confirmed = np.flatnonzero(moving[CONFIRM:] - moving[:-CONFIRM] == CONFIRM)
    if not len(confirmed):
        return math.nan, math.nan
    starts = int(confirmed[0]) + CONFIRM - 1
    runs = np.flatnonzero(forward[starts:] >= running_speed)
    return float(time[starts]), float(time[starts + runs[0]]) if len(runs) else math.nan
