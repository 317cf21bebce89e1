"""The likely cause of an alarm: a contact, a change of friction, or a sensor that is wrong.

Facts only: kind, channel, joint, time and size. Neither load cell nor labels are used. The conditions, in this order:

contact             the leading axis loses speed permanently while its torque keeps pushing; or the torque of a joint
                    at rest rises permanently and opposes a displacement
changed command     the reference speed leaves its normal band before the alarm
friction change     the torque of the leading joint departs permanently, and the speed has recovered
speed glitch        the speed jumps away and returns within a few samples, and the position shows no motion
torque spike        the same for the torque, and the speed does not respond
accelerometer knock the same for the acceleration, or it rings, and neither speed nor torque departs
lost samples        none of the above, and samples are missing right before the alarm
not clear           none of the above
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from cdtool.recordings.motion import MotionClass
from cdtool.recordings.recording import Recording
from cdtool.results.explanation.departure import Track
from cdtool.results.explanation.transient import MissingSamples, Transient, losses, shown_by_position, transients

# Transients and lost samples this long before the signal's last exit from its band may be the cause [s].
_SHORTLY = 0.3
# A permanent change is present in this last part of the analysed time [s].
_AT_THE_END = 0.15
# Share of the normal speed that a contact removes permanently.
_STOPPED = 0.3
# Share of the normal speed by which a reference has to depart in the mean of the time before the alarm.
_COMMANDED = 0.1
# Spreads by which a level has departed permanently, at the end and at the alarm.
_LASTING, _AT_ALARM = 3.0, 2.0
# A channel's own noise is at least this share of the spread of the impact-free runs.
_LEAST_NOISE = 0.25
# A held joint is displaced and pushed back by at least this many spreads.
_HELD = 5.0


class CauseKind(StrEnum):
    """Possible causes of an alarm."""

    CONTACT = "contact"
    COMMAND = "changed command"
    FRICTION = "friction change"
    SPEED_GLITCH = "speed glitch"
    TORQUE_SPIKE = "torque spike"
    KNOCK = "accelerometer knock"
    LOST = "lost samples"
    UNCLEAR = "not clear"


@dataclass(frozen=True)
class Shift:
    """A permanent deviation of a channel of a joint: its level `value` and its `normal` level, both in `unit`."""

    channel: str
    joint: str
    unit: str
    value: float
    normal: float


@dataclass(frozen=True)
class Cause:
    """The likely cause with its evidence: the permanent shifts, the transient, or the lost samples."""

    kind: CauseKind
    shifts: tuple[Shift, ...] = ()
    transient: Transient | None = None
    loss: MissingSamples | None = None

    @property
    def channel(self) -> str:
        """Return the channel responsible; empty if several agree, or none."""
        found = self.transient or self.loss
        return found.channel if found else ""


@dataclass(frozen=True)
class Event:
    """An alarm at `alarm` [s] of a signal that last left its band at `left` [s]; `inputs`: the detector's inputs.

    `joint` is the signal's: one of the machine's, or the whole machine. `motion` is the operation's.
    """

    joint: str
    left: float
    alarm: float
    inputs: tuple[str, ...]
    motion: MotionClass


def likely_cause(
    recording: Recording, tracks: Sequence[Track], leading: str, direction: int, event: Event, end: float
) -> Cause:
    """Return the likely cause of an alarm.

    Parameters
    ----------
    recording : Recording
        The recording on the load side, without ground truth.
    tracks : sequence of Track
        The channels compared with their normal band, up to `end`.
    leading : str
        The joint that leads the motion.
    direction : int
        The sign of its motion, 1 or -1.
    event : Event
        The alarm. Channels that its detector does not read can neither have caused it nor lost samples that matter.
    end : float
        End of the analysed time [s].

    Returns
    -------
    Cause
        The first cause in the order of this module's table whose condition holds, with its evidence.

    Notes
    -----
    Fails for a contact that ends before the end of the analysed time: it leaves no permanent change, and may appear as
    a transient of a sensor.

    Examples
    --------
    `explain_operation` states the likely cause of each alarm.
    """
    left, alarm, read = event.left, event.alarm, event.inputs
    joints = list(dict.fromkeys(track.joint for track in tracks))
    by_name = {(track.channel, track.joint): track for track in tracks}
    ended = max(end - _AT_THE_END, alarm - 0.02), end
    contact = _contact(by_name, joints, leading, direction, alarm, ended)
    if contact:
        return Cause(CauseKind.CONTACT, contact)
    commanded = _commanded(by_name, leading, alarm)
    if commanded:
        return Cause(CauseKind.COMMAND, commanded)
    friction = _friction(by_name, leading, alarm, ended)
    if friction:
        return Cause(CauseKind.FRICTION, friction)
    window = left - _SHORTLY, alarm
    found = {
        channel: [
            item
            for name, track in by_name.items()
            if name[0] == channel
            for item in _transients(recording, track, window)
        ]
        for channel in ("speed", "torque", "acceleration")
        # A channel that the detector does not read cannot have caused its alarm.
        if channel in read or not read
    }
    return _transient_cause(recording, found) or _lost(recording, read, left, alarm) or Cause(CauseKind.UNCLEAR)


def _contact(
    tracks: dict[tuple[str, str], Track],
    joints: Sequence[str],
    leading: str,
    direction: int,
    alarm: float,
    ended: tuple[float, float],
) -> tuple[Shift, ...]:
    speed, torque = tracks.get(("speed", leading)), tracks.get(("torque", leading))
    if speed is not None:
        normal, change = speed.normal(*ended), speed.change(*ended)
        lost = -direction * change
        pushes = torque is None or direction * _peak(torque, alarm - 0.3, ended[1], direction) >= _LASTING
        if abs(normal) > 0.0 and lost >= _STOPPED * abs(normal) and pushes:
            slowed = Shift("speed", leading, speed.compared.unit, normal + change, normal)
            return (slowed,) if torque is None else (slowed, _shift(torque, ended))
    for joint in joints:
        torque, position = tracks.get(("torque", joint)), tracks.get(("position", joint))
        if joint == leading or torque is None or position is None:
            continue
        pushed, displaced = torque.level_shift(*ended), position.level_shift(*ended)
        if abs(pushed) >= _HELD and abs(displaced) >= _HELD and pushed * displaced < 0.0:
            return _shift(torque, ended), _shift(position, ended)
    return ()


def _commanded(tracks: dict[tuple[str, str], Track], leading: str, alarm: float) -> tuple[Shift, ...]:
    reference, speed = tracks.get(("reference_speed", leading)), tracks.get(("speed", leading))
    if reference is None or speed is None or reference.first == reference.after:
        return ()
    shortly, first = (alarm - _SHORTLY, alarm), float(reference.compared.time[reference.first])
    least = _COMMANDED * abs(speed.normal(*shortly))
    # A reference that deviates throughout is another class of motion, not a change.
    if abs(reference.change(*shortly)) > least > abs(reference.change(first, first + _SHORTLY)):
        return (_shift(reference, shortly),)
    return ()


def _friction(
    tracks: dict[tuple[str, str], Track], leading: str, alarm: float, ended: tuple[float, float]
) -> tuple[Shift, ...]:
    torque, speed = tracks.get(("torque", leading)), tracks.get(("speed", leading))
    if torque is None:
        return ()
    at_end, at_alarm = torque.level_shift(*ended), torque.level_shift(alarm - 0.02, alarm + 0.1)
    lasting = abs(at_end) >= _LASTING and at_end * at_alarm > 0.0 and abs(at_alarm) >= _AT_ALARM
    if not lasting:
        return ()
    return tuple(_shift(track, ended) for track in (torque, speed) if track is not None)


def _transients(recording: Recording, track: Track, window: tuple[float, float]) -> list[Transient]:
    """Return transients of a channel: relative to its own running median, otherwise to its normal curve."""
    series, column = recording[track.channel], recording.joints.index(track.joint)
    spreads = track.compared.spread[track.rows]
    spread = float(np.nanmedian(spreads)) if np.isfinite(spreads).any() else 0.0
    found = transients(series, track.channel, track.joint, column, *window, _LEAST_NOISE * spread)
    if found:
        return found
    brief = track.brief(*window)
    return [brief] if brief else []


def _transient_cause(recording: Recording, found: dict[str, list[Transient]]) -> Cause | None:
    """Return a faulty sensor: the highest transient, if the other channels do not confirm it."""
    speed = [
        item
        for item in found.get("speed", ())
        if "position" not in recording
        or not shown_by_position(item, recording["position"], recording.joints.index(item.joint))
    ]
    named = {
        CauseKind.SPEED_GLITCH: speed,
        CauseKind.TORQUE_SPIKE: found.get("torque", []),
        CauseKind.KNOCK: found.get("acceleration", []),
    }
    best = max(
        ((items[0].noises, kind, items[0]) for kind, items in named.items() if items),
        key=lambda item: item[0],
        default=None,
    )
    return Cause(best[1], transient=best[2]) if best else None


def _lost(recording: Recording, read: tuple[str, ...], left: float, alarm: float) -> Cause | None:
    channels = read or tuple(recording.channels)
    found = losses(recording, channels, left - _SHORTLY, alarm)
    return Cause(CauseKind.LOST, loss=found[0]) if found else None


def _shift(track: Track, when: tuple[float, float]) -> Shift:
    normal = track.normal(*when)
    return Shift(track.channel, track.joint, track.compared.unit, normal + track.change(*when), normal)


def _peak(track: Track, start: float, end: float, direction: int) -> float:
    part = direction * track.level_distances(track.between(start, end))
    return direction * float(np.nanmax(part)) if np.isfinite(part).any() else math.nan
