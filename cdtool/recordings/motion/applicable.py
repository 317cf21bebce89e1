"""Which classes of motion apply to a log, sample by sample, from its speed so far and nothing later.

The threshold of a class is in use while the class applies. A class that fits applies. One whose speed departs applies
for a while longer, because a contact slows the axis and must not excuse itself. Motion that fits no class is not
assessable until a class fits again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.base.kernels import READ_ONLY, kernel
from cdtool.recordings.motion.motion_class import MotionClass
from cdtool.recordings.motion.speed_range import SpeedRange
from cdtool.recordings.motion.strokes import Stroke
from cdtool.recordings.recording import Recording, Series

# What a threshold was learned for: one class, or several and the speeds between them.
Motion = MotionClass | SpeedRange
# How long a class still applies after a departure that began while it fitted [s]: the matching window.
GRACE = 1.0


@dataclass(frozen=True)
class Applicability:
    """Where (n,) a class applies in a stroke: `stroke` and `motion` are the numbers of stroke and class."""

    stroke: int
    motion: int
    where: BoolArray


def applicable_classes(
    recording: Recording,
    classes: Sequence[Motion],
    strokes: Sequence[Stroke],
    clock: FloatArray,
    grace: float = GRACE,
) -> list[Applicability]:
    """Return where on `clock` (n,) [s] each class applies in each stroke; a class that applies nowhere is left out.

    * Until a class has begun its stroke, all classes apply. Then a class applies that has fitted since it began.
    * A class that has departed applies for `grace` [s] more, also beyond the end of its stroke.
    * A class that has completed its stroke applies to the rest after it, for at most `grace`.
    * A class that no longer applies does so again once it fits and no other class applies, or has fitted for `grace`.
    * Where there was no speed for `grace`, no class applies.

    On the clock of one of the recording's channels this is decided once, for all detectors that learned the same
    classes.
    """
    own = recording.own_clock(clock)
    if own is None:
        return _applicable(recording, classes, strokes, clock, grace)
    key = ("applicable classes", tuple(item.content for item in classes), tuple(strokes), grace)
    return list(recording.derived(key, lambda: tuple(_applicable(recording, classes, strokes, own, grace)), own))


def _applicable(
    recording: Recording, classes: Sequence[Motion], strokes: Sequence[Stroke], clock: FloatArray, grace: float
) -> list[Applicability]:
    speed = recording["speed"]
    if not len(speed):
        return []
    n, count = len(speed.time), len(classes)
    begun = np.zeros((n, count), dtype=np.bool_)
    fits = np.zeros((n, count), dtype=np.bool_)
    fresh = np.zeros(n, dtype=np.bool_)
    firsts = [int(np.searchsorted(speed.time, item.applies, side="left")) for item in strokes]
    completed_by = np.zeros(n)
    for item, first, last in zip(strokes, firsts, [*firsts[1:], n], strict=True):
        if first >= last:
            continue
        part = recording if len(strokes) == 1 else recording.section(item.start, float(speed.time[last - 1]))
        for j, motion in enumerate(classes):
            started, agrees = motion.fitting(part)
            begun[first:last, j] = started[-(last - first) :]
            fits[first:last, j] = agrees[-(last - first) :]
        fresh[first] = True
        # A class that has fitted 50 ms before its stroke came to rest or turned round, or later, has completed it.
        completed_by[first] = item.rests - 0.05
    known = _known(speed, [motion.joint for motion in classes])
    now = np.zeros((n, count), dtype=np.bool_)
    before = np.zeros((n, count), dtype=np.bool_)
    opposed = np.array(
        [[one.joint == other.joint and one.direction != other.direction for other in classes] for one in classes]
    )
    _decide(speed.time, begun, fits, known, fresh, completed_by, opposed, grace, now, before)
    recent = speed_is_recent(recording, classes, clock, grace)
    return _on_clock(speed.time, now, now & begun, before, firsts, clock, recent)


def speed_is_recent(
    recording: Recording, classes: Sequence[Motion], clock: FloatArray, grace: float = GRACE
) -> BoolArray:
    """Return where on `clock` (n,) [s] the last `grace` [s] contain a speed of every joint that leads a class."""
    own, joints = recording.own_clock(clock), tuple(sorted({motion.joint for motion in classes}))
    if own is None:
        return _speed_is_recent(recording["speed"], joints, clock, grace)
    speed = recording["speed"]
    return speed.derived(("speed is recent", joints, grace), lambda: _speed_is_recent(speed, joints, own, grace), own)


def _speed_is_recent(speed: Series, joints: Sequence[int], clock: FloatArray, grace: float) -> BoolArray:
    known = _known(speed, joints)
    if clock is speed.time and known.all() and grace >= 0.0:
        return known
    last = speed.time[known]
    if not len(last):
        return np.zeros(len(clock), dtype=bool)
    at = np.searchsorted(last, clock, side="right") - 1
    recent: BoolArray = (at >= 0) & (clock - last[np.maximum(at, 0)] <= grace)
    return recent


def _known(speed: Series, joints: Sequence[int]) -> BoolArray:
    known: BoolArray = np.all(np.isfinite(speed.values[:, list(joints)]), axis=1)
    return known


def _on_clock(
    time: FloatArray,
    now: BoolArray,
    begun_now: BoolArray,
    before: BoolArray,
    firsts: Sequence[int],
    clock: FloatArray,
    recent: BoolArray,
) -> list[Applicability]:
    """Return the decision at the last speed sample at or before each time of `clock`, where one is `recent`."""
    if len(firsts) == 1 and firsts[0] == 0:
        return _in_the_only_stroke(time, now, clock, recent)
    at = np.maximum(np.searchsorted(time, clock, side="right") - 1, 0)
    stroke_of = np.searchsorted(firsts, np.arange(len(time)), side="right") - 1
    stroke = stroke_of[at]
    found = []
    for j in range(now.shape[1]):
        # A class that departed in an earlier stroke: the last one that it had begun and applied to.
        held_from = np.maximum.accumulate(np.where(begun_now[:, j], stroke_of, -1))[at]
        own = now[at, j] & recent
        held = before[at, j] & recent & (held_from >= 0) & (held_from < stroke)
        for number in np.union1d(stroke[own], held_from[held]).tolist():
            where = (own & (stroke == number)) | (held & (held_from == number))
            found.append(Applicability(number, j, where))
    return found


def _in_the_only_stroke(time: FloatArray, now: BoolArray, clock: FloatArray, recent: BoolArray) -> list[Applicability]:
    """Return `_on_clock` for a log of a single stroke: no class departed in an earlier one."""
    at = slice(None) if clock is time else np.maximum(np.searchsorted(time, clock, side="right") - 1, 0)
    where = now[at] & recent[:, np.newaxis]
    return [Applicability(0, j, np.ascontiguousarray(where[:, j])) for j in range(now.shape[1]) if where[:, j].any()]


@kernel(
    f"void({READ_ONLY}, b1[:,::1], b1[:,::1], b1[::1], b1[::1], float64[::1], b1[:,::1], float64, b1[:,::1], b1[:,::1])"
)
def _decide(  # noqa: C901, PLR0913  a kernel: one loop, arrays and scalars one by one
    time: FloatArray,
    begun: BoolArray,
    fits: BoolArray,
    known: BoolArray,
    fresh: BoolArray,
    completed_by: FloatArray,
    opposed: BoolArray,
    grace: float,
    now: BoolArray,
    before: BoolArray,
) -> None:
    """Fill `now` (n, classes): classes that apply to their current stroke, and `before`: those of an earlier one.

    `begun`, `fits` (n, classes): whether a class has begun this stroke, and its speed fits so far. Where a stroke is
    `fresh` (n,), a class that fitted until `completed_by` [s] has completed the one before. A class joins when it
    begins, unless one of the `opposed` direction has departed: a contact throws an axis back. Of each class: `member`:
    it applies to the current stroke. `started`: it has begun this stroke. `held`: it departed in an earlier stroke and
    still applies for `grace` [s]. `resting`: it completed an earlier stroke and applies to the rest after it, for
    `grace`. `fitting`: its speed fits at the present sample.
    """
    count = begun.shape[1]
    member = np.zeros(count, dtype=np.bool_)
    held = np.zeros(count, dtype=np.bool_)
    resting = np.zeros(count, dtype=np.bool_)
    started = np.zeros(count, dtype=np.bool_)
    fitting = np.zeros(count, dtype=np.bool_)
    last_fit = np.zeros(count)
    departed = np.zeros(count)
    held_since = np.zeros(count)
    fitting_since = np.zeros(count)
    for k in range(len(time)):
        if fresh[k]:
            for j in range(count):
                if member[j] and started[j]:
                    resting[j] = last_fit[j] >= completed_by[k]
                    held[j] = not resting[j]
                    held_since[j] = time[k] if resting[j] else departed[j]
                member[j] = not begun[k, j]
                last_fit[j] = time[k]
                departed[j] = time[k]
                started[j] = False
                fitting[j] = True
        if not known[k]:
            for j in range(count):
                now[k, j] = member[j]
                before[k, j] = held[j] or resting[j]
            continue
        any_held = False
        for j in range(count):
            if time[k] - held_since[j] > grace:
                held[j] = False
                resting[j] = False
            any_held = any_held or held[j]
        for j in range(count):
            if fits[k, j]:
                if not fitting[j]:
                    fitting_since[j] = time[k]
                last_fit[j] = time[k]
            elif fitting[j]:
                departed[j] = time[k]
            fitting[j] = fits[k, j]
            if member[j] and not fitting[j] and time[k] - departed[j] > grace:
                member[j] = False
        any_member = False
        for j in range(count):
            if begun[k, j] and not started[j]:
                # At its beginning it applies if it fits, together with others.
                started[j] = True
                fitting_since[j] = time[k]
                member[j] = fits[k, j] and not any_held
                for i in range(count):
                    if opposed[i, j] and member[i] and started[i] and not fitting[i]:
                        member[j] = False
            any_member = any_member or (member[j] and started[j])
        for j in range(count):
            if not member[j] and fits[k, j]:
                alone = not any_member and not any_held
                if alone or (started[j] and time[k] - fitting_since[j] >= grace):
                    member[j] = True
        any_started = False
        for j in range(count):
            any_started = any_started or (member[j] and started[j])
        for j in range(count):
            # Once a class has begun, one that rests after its stroke no longer applies, and one that has not begun
            # applies only while the motion may still be its own.
            now[k, j] = member[j] and (started[j] or not any_started or fits[k, j])
            resting[j] = resting[j] and not any_started
            before[k, j] = held[j] or resting[j]
