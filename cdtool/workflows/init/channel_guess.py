"""Which stream of a log is which channel? Names first, then what the numbers show; each guess says why."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

import numpy as np

from cdtool.workflows.init import motion_evidence as motion
from cdtool.workflows.init.candidates import BY_COURSE, best, named_for, unnamed_for
from cdtool.workflows.init.other_channels import guess_ground_truth, guess_references
from cdtool.workflows.init.quantity_words import is_something_else, word_for
from cdtool.workflows.init.streams import Channels, Stream, joined
from cdtool.workflows.init.units_in_names import label

# The correlation from which on one column is another's derivative.
_FITS = 0.9
# Share of a column's variance that inertia and friction must explain for it to be the drive's.
_DRIVES = 0.6
_MOST_UNNAMED = 48


def guess_channels(streams: list[Stream], topics: bool) -> Channels:
    """The channels of a log, by names and by the numbers; offline, nothing of it is used for detection."""
    joints = _joint_count(streams)
    if joints == 1 and topics:
        streams = [part for stream in streams for part in _elements(stream)]
    channels = Channels(joints, list(streams))
    if not topics and _unnamed(streams):
        _by_place(channels)
    else:
        _motion_by_name(channels)
    _drive(channels)
    _acceleration(channels)
    guess_references(channels)
    guess_ground_truth(channels)
    return channels


def _joint_count(streams: Iterable[Stream]) -> int:
    votes = Counter(
        stream.width
        for stream in streams
        if stream.moves and not is_something_else(stream.name)
        for quantity in ("position", "speed", "torque")
        if word_for(quantity, label(stream))[0]
    )
    several = [(count, width) for width, count in votes.items() if width > 1]
    return max(several)[1] if several else 1


def _elements(stream: Stream) -> list[Stream]:
    return [stream.element(i) for i in range(stream.width)] if stream.field.endswith("[:]") else [stream]


def _unnamed(streams: list[Stream]) -> bool:
    return bool(streams) and all(stream.name.isdigit() for stream in streams)


def _by_place(channels: Channels) -> None:
    """Columns without names: blocks of J positions, J speeds and, where it moves like a drive, J torques."""
    streams = channels.free
    block = motion.blocks(streams[:_MOST_UNNAMED])
    if block is None:
        return
    first, joints, correlation = block
    channels.joints = joints
    parts = [streams[first + i * joints : first + (i + 1) * joints] for i in range(3)]
    fit = f"r = {correlation:.3f}"
    many = "column" if joints == 1 else f"{joints} columns"
    text = f"its derivative fits the {many} behind it, {fit}"
    channels.take("position", joined(parts[0], _places(parts[0])), text)
    text = f"its integral fits the {many} before it, {fit}"
    channels.take("speed", joined(parts[1], _places(parts[1])), text)
    if len(parts[2]) == joints:
        drive = joined(parts[2], _places(parts[2]))
        share = motion.drive_fit(drive, channels.found["speed"].stream)
        text = f"its place behind the speeds; inertia and friction explain {100 * max(share, 0.0):.0f} % of it"
        if motion.rests_and_peaks(drive):
            channels.take("force", drive, "it rests at one level and has short, high peaks", BY_COURSE)
        else:
            channels.take("torque", drive, text, BY_COURSE)
        channels.free = []  # further columns without names would be pure guesswork


def _places(streams: list[Stream]) -> str:
    return f"columns {streams[0].name} to {streams[-1].name}"


def _motion_by_name(channels: Channels) -> None:
    named = {q: named_for(channels, q) for q in ("position", "speed")}
    pairs = [
        (p[0] + s[0] + ((fit := motion.integral_fit(p[2], s[2])).correlation > _FITS) * 3.0, -i - k, p, s, fit)
        for i, p in enumerate(named["position"])
        for k, s in enumerate(named["speed"])
    ]
    if pairs:
        _, _, position, speed, fit = max(pairs, key=lambda pair: pair[:2])
        told = f"; its derivative fits the speed, r = {fit.correlation:.3f}" if fit.correlation > _FITS else ""
        channels.take("position", position[2], f"name ({position[1]}){told}")
        channels.take("speed", speed[2], f"name ({speed[1]})")
        return
    for quantity, other in (("position", "speed"), ("speed", "position")):
        if named[quantity]:
            _, word, stream = named[quantity][0]
            channels.take(quantity, stream, f"name ({word})")
            _partner(channels, stream, other)
            return


def _partner(channels: Channels, stream: Stream, other: str) -> None:
    def fit(candidate: Stream) -> float:
        pair = (stream, candidate) if other == "speed" else (candidate, stream)
        return motion.integral_fit(*pair).correlation

    found = best(unnamed_for(channels, other), fit)
    if found is not None and found[0] > _FITS:
        relation = "integral" if other == "speed" else "derivative"
        channels.take(other, found[1], f"its {relation} fits '{stream.name}', r = {found[0]:.3f}", BY_COURSE)


def _drive(channels: Channels) -> None:
    if "torque" in channels.found:
        return
    named = named_for(channels, "torque")
    speed = channels.found.get("speed")
    if named:
        channels.take("torque", named[0][2], f"name ({named[0][1]})")
    elif moving := speed or channels.found.get("position"):
        rate = moving.stream if speed else _derived(moving.stream)
        found = best(unnamed_for(channels, "torque"), lambda stream: motion.drive_fit(stream, rate))
        if found is not None and found[0] > _DRIVES:
            text = f"it moves as a drive's effort does: inertia and friction explain {100 * found[0]:.0f} % of it"
            channels.take("torque", found[1], text, BY_COURSE)


def _acceleration(channels: Channels) -> None:
    named = [item for item in named_for(channels, "acceleration") if item[2].moves]
    if not named:
        return
    speed = channels.found.get("speed")
    top = [item for item in named if item[0] == named[0][0]]
    if speed is None:
        channels.take("acceleration", top[0][2], f"name ({top[0][1]})")
        return
    chosen = max(top, key=lambda item: abs(motion.derivative_fit(item[2], speed.stream).correlation))
    correlation = motion.derivative_fit(chosen[2], speed.stream).correlation
    fits = f"; its integral fits the speed, r = {correlation:.3f}" if abs(correlation) > _FITS else ""
    channels.take("acceleration", chosen[2], f"name ({chosen[1]}){fits}")


def _derived(position: Stream) -> Stream:
    rate = np.gradient(np.nan_to_num(position.values), position.time, axis=0)
    return Stream(position.name, position.columns, None, position.time, rate)
