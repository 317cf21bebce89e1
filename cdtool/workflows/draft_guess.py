"""Which stream of a log is which channel? Names first, then what the numbers show; each guess says why."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable

import numpy as np

from cdtool.recording import MEASURED
from cdtool.workflows import draft_motion as motion
from cdtool.workflows.draft_streams import Channels, Found, Stream, joined
from cdtool.workflows.draft_words import is_reference, is_something_else, word_for

# Correlations from which on the numbers are evidence: of a derivative; of a set value with what follows it,
# and where a topic's or column's name tells of set values too.
_FITS, _FOLLOWS, _FOLLOWS_BY_NAME = 0.9, 0.97, 0.4
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
    _references(channels)
    _ground_truth(channels)
    return channels


def _joint_count(streams: Iterable[Stream]) -> int:
    votes = Counter(
        stream.width
        for stream in streams
        if stream.moves and not is_something_else(stream.name)
        for quantity in ("position", "speed", "torque")
        if word_for(quantity, _own_name(stream))[0]
    )
    several = [(count, width) for width, count in votes.items() if width > 1]
    return max(several)[1] if several else 1


def _elements(stream: Stream) -> list[Stream]:
    return [stream.element(i) for i in range(stream.width)] if stream.field.endswith("[:]") else [stream]


def _own_name(stream: Stream) -> str:
    """A field's name; a topic's name says something only where the field's does not (`data`)."""
    if not stream.topic:
        return stream.name
    plain = stream.field.split("[")[0] == "data"
    return f"{stream.topic} {stream.field}" if plain else stream.field


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
    channels.take(
        "position", joined(parts[0], _places(parts[0])), f"its derivative fits the {joints} columns behind it, {fit}"
    )
    channels.take(
        "speed", joined(parts[1], _places(parts[1])), f"its integral fits the {joints} columns before it, {fit}"
    )
    if len(parts[2]) == joints:
        drive = joined(parts[2], _places(parts[2]))
        share = motion.drive_fit(drive, channels.found["speed"].stream)
        text = f"its place behind the speeds; inertia and friction explain {100 * max(share, 0.0):.0f} % of it"
        channels.take("torque", drive, text)
        channels.free = []  # further columns without names would be pure guesswork


def _places(streams: list[Stream]) -> str:
    return f"columns {streams[0].name} to {streams[-1].name}"


def _motion_by_name(channels: Channels) -> None:
    named = {q: _named(channels, q) for q in ("position", "speed")}
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

    best = _best(channels.of_joints(), fit)
    if best is not None and best[0] > _FITS:
        relation = "integral" if other == "speed" else "derivative"
        channels.take(other, best[1], f"its {relation} fits '{stream.name}', r = {best[0]:.3f}")


def _drive(channels: Channels) -> None:
    if "torque" in channels.found:
        return
    named = _named(channels, "torque")
    speed = channels.found.get("speed")
    if named:
        channels.take("torque", named[0][2], f"name ({named[0][1]})")
    elif moving := speed or channels.found.get("position"):
        rate = moving.stream if speed else _derived(moving.stream)
        best = _best(channels.of_joints(), lambda stream: motion.drive_fit(stream, rate))
        if best is not None and best[0] > _DRIVES:
            text = f"it moves as a drive's effort does: inertia and friction explain {100 * best[0]:.0f} % of it"
            channels.take("torque", best[1], text)


def _acceleration(channels: Channels) -> None:
    named = [item for item in _named(channels, "acceleration") if item[2].moves]
    if not named:
        return
    speed = channels.found.get("speed")
    top = [item for item in named if item[0] == named[0][0]]
    if speed is None:
        channels.take("acceleration", top[0][2], f"name ({top[0][1]})")
        return
    best = max(top, key=lambda item: abs(motion.derivative_fit(item[2], speed.stream).correlation))
    correlation = motion.derivative_fit(best[2], speed.stream).correlation
    fits = f"; its integral fits the speed, r = {correlation:.3f}" if abs(correlation) > _FITS else ""
    channels.take("acceleration", best[2], f"name ({best[1]}){fits}")


def _references(channels: Channels) -> None:
    for quantity in ("position", "speed", "torque"):
        name = f"reference_{quantity}"
        named = [item for item in _named(channels, quantity, reference=True) if item[2].moves]
        measured = channels.found.get(quantity)
        if named:
            if measured is not None:
                alike = {id(item[2]): motion.likeness(measured.stream, item[2]) for item in named}
                named.sort(key=lambda item: -(item[0] + 3.0 * alike[id(item[2])]))
            channels.take(name, named[0][2], f"name ({named[0][1]}, of a set value)")
        elif measured is not None and measured.stream.moves:
            _follower(channels, name, quantity, measured.stream)


def _follower(channels: Channels, name: str, quantity: str, measured: Stream) -> None:
    best = _best(channels.of_joints(), lambda stream: motion.likeness(measured, stream))
    if best is None:
        return
    correlation, other = best
    if correlation < (_FOLLOWS_BY_NAME if is_reference(other.name) else _FOLLOWS):
        return
    text = f"follows '{measured.name}' with r = {best[0]:.3f} and is smoother"
    if motion.roughness(other) < motion.roughness(measured):
        channels.take(name, other, text)
    elif correlation > _FOLLOWS and quantity != "torque" and not is_reference(measured.name):
        why = channels.found[quantity].why
        channels.take(quantity, other, f"rougher than '{measured.name}', which it follows with r = {best[0]:.3f}")
        channels.found[name] = Found(measured, f"{why}; smoother than '{other.name}'")


def _ground_truth(channels: Channels) -> None:
    singles = [stream for stream in channels.free if stream.width == 1 and stream.moves]
    named = [(*word_for("force", stream.name), stream) for stream in singles if not is_something_else(stream.name)]
    named = [item for item in named if item[0] and ".torque." not in item[2].field and not is_reference(item[2].name)]
    if named:
        best = max(named, key=lambda item: (item[0], float(np.ptp(np.nan_to_num(item[2].values)))))
        channels.take("force", best[2], f"name ({best[1]})")
    elif channels.found:
        for stream in singles:
            if not is_something_else(stream.name) and motion.rests_and_peaks(stream):
                channels.take("force", stream, "it rests at one level and has short, high peaks")
                break
    for quantity in ("label", "trigger"):
        for stream in channels.free:
            seen = stream.values[np.isfinite(stream.values)]
            if stream.width == 1 and word_for(quantity, stream.name)[0] and np.isin(seen, (0.0, 1.0)).all():
                channels.take(quantity, stream, f"name ({word_for(quantity, stream.name)[1]}), 0 and 1 only")
                break


def _named(channels: Channels, quantity: str, reference: bool = False) -> list[tuple[float, str, Stream]]:
    """(strength, word, stream) of the free streams whose name speaks for a quantity most, the strongest first."""
    found = []
    for stream in channels.of_joints():
        name = _own_name(stream)
        if is_reference(stream.name) != reference or is_something_else(stream.name):
            continue
        strength, word = word_for(quantity, name)
        if strength and strength >= max(word_for(other, name)[0] for other in MEASURED):
            found.append((strength, word, stream))
    return sorted(found, key=lambda item: -item[0])


def _best(streams: Iterable[Stream], score: Callable[[Stream], float]) -> tuple[float, Stream] | None:
    return max(((score(stream), stream) for stream in streams), key=lambda item: item[0], default=None)


def _derived(position: Stream) -> Stream:
    rate = np.gradient(np.nan_to_num(position.values), position.time, axis=0)
    return Stream(position.name, position.columns, None, position.time, rate)
