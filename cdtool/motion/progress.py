"""Where in its stroke an operation is, sample by sample and causally: time since the motion began, travel, phase."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cdtool.clock import previous_value
from cdtool.recording import BoolArray, FloatArray, Recording

ALIGNMENTS = ("time_then_position", "time", "position")
# Shares of the nominal speed at which the stroke has begun, and at which it runs.
START_SHARE = 0.1
RUNNING_SHARE = 0.95
# The motion has started once this many consecutive speed samples exceed the start speed.
_CONFIRM = 3


@dataclass(frozen=True)
class Progress:
    """On a signal's clock (n,): `elapsed` s since the motion began, `travel` since then, `running` after acceleration.

    NaN (and False) before the motion begins. Travel is a running maximum: it stays constant while the axis runs
    backward.
    """

    elapsed: FloatArray
    travel: FloatArray
    running: BoolArray


def progress(
    recording: Recording,
    clock: FloatArray,
    direction: int,
    start_speed: float,
    running_speed: float,
    joint: int,
) -> Progress:
    """Return the progress from measured speed and position of the leading joint, each at or before the sample."""
    speed = recording["speed"]
    forward = direction * speed.values[:, joint]
    moving = confirmed(forward >= start_speed)
    elapsed = np.full(len(clock), np.nan)
    travel = np.full(len(clock), np.nan)
    running = np.zeros(len(clock), dtype=bool)
    starts = np.flatnonzero(moving)
    if not len(starts):
        return Progress(elapsed, travel, running)
    start = float(speed.time[starts[0]])
    begun = clock >= start
    elapsed[begun] = clock[begun] - start
    fast = np.flatnonzero((forward >= running_speed) & (speed.time >= start))
    if len(fast):
        running = clock >= speed.time[fast[0]]
    position = direction * previous_value(recording["position"], clock)[:, joint]
    along = np.where(begun, position, np.nan)
    known = np.flatnonzero(np.isfinite(along))
    if len(known):
        reached = np.fmax.accumulate(np.where(np.isnan(along), -np.inf, along))
        travel = np.where(begun & np.isfinite(reached), reached - along[known[0]], np.nan)
    return Progress(elapsed, travel, running)


def confirmed(there: BoolArray) -> BoolArray:
    """Return (n,) True where the condition holds at the sample and at the two before it."""
    sure = there.copy()
    for lag in range(1, _CONFIRM):
        sure[lag:] &= there[:-lag]
    sure[: _CONFIRM - 1] = False
    return sure
