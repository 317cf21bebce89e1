"""Where in its stroke an operation is, sample by sample and causally: time since the motion began, travel, phase."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from cdtool.clock import previous_value
from cdtool.kernels import READ_ONLY, kernel
from cdtool.recording import BoolArray, FloatArray, Recording
from cdtool.short_repr import short_repr

ALIGNMENTS = ("time_then_position", "time", "position")
# Shares of the nominal speed at which the stroke has begun, and at which it runs.
START_SHARE = 0.1
RUNNING_SHARE = 0.95
# The motion has started once this many consecutive speed samples exceed the start speed.
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

    __repr__ = short_repr

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
    elapsed, travel = np.empty(len(clock)), np.empty(len(clock))
    running = np.empty(len(clock), dtype=np.bool_)
    # Without a motion no position is needed.
    moves = not math.isnan(starts)
    position = np.ascontiguousarray(previous_value(recording["position"], clock)[:, joint]) if moves else np.empty(0)
    _advance(np.ascontiguousarray(clock), position, direction, starts, runs, elapsed, travel, running)
    for part in (elapsed, travel, running):
        part.flags.writeable = False
    return Progress(elapsed, travel, running)


@kernel(f"UniTuple(float64, 2)({READ_ONLY}, {READ_ONLY}, float64, float64, float64)")
def _begin(
    time: FloatArray, speed: FloatArray, direction: float, start_speed: float, running_speed: float
) -> tuple[float, float]:
    """Return when the motion is confirmed to have begun, and when it first runs from there on [s]; NaN: never."""
    starts = math.nan
    moving = 0
    for k in range(len(time)):
        forward = direction * speed[k]
        if math.isnan(starts):
            moving = moving + 1 if forward >= start_speed else 0
            if moving >= CONFIRM:
                starts = time[k]
        if time[k] >= starts and forward >= running_speed:
            return starts, time[k]
    return starts, math.nan


@kernel(f"void({READ_ONLY}, {READ_ONLY}, float64, float64, float64, float64[::1], float64[::1], b1[::1])", exact=True)
def _advance(  # noqa: PLR0913  kernels take arrays and scalars separately
    clock: FloatArray,
    position: FloatArray,
    direction: float,
    starts: float,
    runs: float,
    elapsed: FloatArray,
    travel: FloatArray,
    running: BoolArray,
) -> None:
    """Fill the progress of a motion that begins at `starts` and runs from `runs` on [s]; NaN: it does not."""
    furthest = -math.inf
    first = math.nan
    for k in range(len(clock)):
        elapsed[k] = math.nan
        travel[k] = math.nan
        running[k] = clock[k] >= runs
        if not clock[k] >= starts:
            continue
        elapsed[k] = clock[k] - starts
        along = direction * position[k]
        if along > furthest:
            furthest = along
        if math.isnan(first) and math.isfinite(along):
            first = along
        if math.isfinite(furthest):
            travel[k] = furthest - first
