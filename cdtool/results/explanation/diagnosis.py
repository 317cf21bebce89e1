"""The channels that left their normal band, in their order, and the likely cause of the alarm."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from cdtool.detectors.detection import WHOLE_MACHINE
from cdtool.recordings.recording import REFERENCES, Recording
from cdtool.results.explanation.cause import Cause, CauseKind, Event, likely_cause
from cdtool.results.explanation.departure import BASELINE, Track, tracks_of
from cdtool.results.explanation.movement import Movement
from cdtool.results.explanation.transient import Transient
from cdtool.thresholds.normal_choice import Absence, NormalMotions
from cdtool.thresholds.normal_motion import NormalMotion

# Departures are searched from this long before the signal left its band permanently [s]: a soft contact takes as long.
_BEFORE = 0.9
# The class of motion of a run is determined up to this long before the exit from the band [s].
_LATEST = 0.1
# This much of the run after accelerating shows its usual offset [s]; departures are searched for at least this long.
_SETTLING, _LEAST_BEFORE = 0.3, 0.3
# The time after an alarm that distinguishes a contact from friction [s].
_AFTER = 0.5

# Without impact-free runs, a run must have been steady: its speed within this share of its median.
_STEADY, _ENOUGH = 0.3, 10
# Uncertainty of the time at which a channel began to move [s].
_RESOLUTION = 0.02
# Among channels that move at the same time, the one that physically responds first comes first.
_ORDER = ("acceleration", "speed", "torque", "position", *REFERENCES)


@dataclass(frozen=True)
class Diagnosis:
    """The channels in the order in which they left their normal band, and the likely cause (known for a contact).

    `absent`: why there were no impact-free runs to compare with; None if there were, `runs` of them.
    """

    moved: tuple[Movement, ...]
    cause: Cause
    absent: Absence | None
    runs: int = 0


def diagnose_alarm(
    recording: Recording, event: Event, normals: NormalMotions, own_past: Callable[[], Sequence[Movement]]
) -> Diagnosis:
    """Return what led to an alarm.

    `own_past` finds the movements compared with the run's own past, which are used without impact-free runs.
    """
    found = normals.of(recording, event.left - _LATEST)
    absent = None if isinstance(found, NormalMotion) else found
    normal = found if isinstance(found, NormalMotion) else None
    begin = event.left - _BEFORE if normal is None else _search_begin(recording, normal, event.left)
    end = min(event.alarm + _AFTER, recording.end)
    motion = normal.motion if normal is not None else event.motion
    leading, direction = recording.joints[motion.joint], motion.direction or 1
    tracks: list[Track] = []
    cause = Cause(CauseKind.UNCLEAR)
    if normal is not None or _steady(recording, leading, begin):
        tracks = tracks_of(recording, normal, leading, begin, end)
        cause = likely_cause(recording, tracks, leading, direction, event, end)
    moved = list(own_past()) if normal is None else moved_channels(tracks, event.joint, begin, end)
    if cause.transient is not None:
        moved = _with_transient(moved, cause.transient, [] if normal is None else tracks)
    return Diagnosis(in_order(moved, event.joint), cause, absent, normal.runs if normal is not None else 0)


def diagnose_contact(
    recording: Recording,
    joint: str,
    onset: float,
    until: float,
    normals: NormalMotions,
    own_past: Callable[[], Sequence[Movement]],
) -> Diagnosis:
    """Return the channels that a contact moved, from its onset minus its uncertainty; its cause is known."""
    normal = normals.of(recording, onset)
    if not isinstance(normal, NormalMotion):
        return Diagnosis(tuple(own_past()), Cause(CauseKind.CONTACT), normal)
    end = min(until, recording.end)
    tracks = tracks_of(recording, normal, recording.joints[normal.motion.joint], onset, end)
    moved = moved_channels(tracks, joint, onset, end)
    return Diagnosis(in_order(moved, joint), Cause(CauseKind.CONTACT), None, normal.runs)


def moved_channels(tracks: Sequence[Track], joint: str, begin: float, end: float) -> list[Movement]:
    """Return every channel of the signal's joint, and those of other joints that left their normal band."""
    found = [track.movement(begin, end) for track in tracks]
    return [item for item in found if (joint,) == WHOLE_MACHINE or item.joint == joint or not math.isnan(item.time)]


def _steady(recording: Recording, leading: str, begin: float) -> bool:
    """Whether the leading joint ran steadily up to `begin` [s], so that its own past can serve as normal."""
    if "speed" not in recording:
        return False
    series = recording["speed"]
    past = series.values[slice(*np.searchsorted(series.time, (begin - BASELINE, begin)))]
    known = past[:, recording.joints.index(leading)]
    known = known[np.isfinite(known)]
    middle = abs(float(np.median(known))) if len(known) >= _ENOUGH else 0.0
    return middle > 0.0 and float(np.ptp(known)) < _STEADY * middle


def _search_begin(recording: Recording, normal: NormalMotion, left: float) -> float:
    """Return the start of the search for departures [s]: not far into the acceleration, if that was shortly before."""
    clock = recording["speed"].time
    running = normal.progress(recording, clock).running
    ran = int(running.argmax()) if len(running) else 0
    settled = float(clock[ran]) + _SETTLING if len(running) and running[ran] else -math.inf
    return max(left - _BEFORE, min(settled, left - _LEAST_BEFORE))


def in_order(moved: Sequence[Movement], joint: str) -> tuple[Movement, ...]:
    """Sort by time, channels that did not move last; a channel does not precede the one it follows.

    A position, an integral, follows its own speed; another joint follows the signal's.
    """
    speeds = {item.joint: item.time for item in moved if item.channel == "speed" and not math.isnan(item.time)}

    def place(item: Movement) -> tuple[bool, float, int]:
        time = item.time
        if item.channel == "position" and 0.0 < speeds.get(item.joint, -math.inf) - time < _RESOLUTION:
            time = speeds[item.joint]
        if (joint,) != WHOLE_MACHINE and item.joint != joint:
            time += _RESOLUTION
        return math.isnan(time), time, _ORDER.index(item.channel)

    return tuple(sorted(moved, key=place))


def _with_transient(moved: Sequence[Movement], found: Transient, tracks: Sequence[Track]) -> list[Movement]:
    """Return the channels with that of the transient as moved at its beginning; it may be within the runs' spread."""
    others = [item for item in moved if (item.channel, item.joint) != (found.channel, found.joint)]
    movement = Movement(
        found.channel, found.joint, found.start, "up" if found.height > 0.0 else "down", unit=found.unit
    )
    for track in tracks:
        if (track.channel, track.joint) == (found.channel, found.joint):
            part, compared = track.between(found.start, found.end), track.compared
            k = part.start + int(abs(compared.value[part] - compared.mean[part]).argmax())
            value, mean, spread = (float(part[k]) for part in (compared.value, compared.mean, compared.spread))
            movement = replace(movement, value=value, mean=mean, spread=spread)
    return [*others, replace(movement, brief=True)]


__all__ = ["Absence", "CauseKind", "Diagnosis", "NormalMotions", "diagnose_alarm", "diagnose_contact"]
