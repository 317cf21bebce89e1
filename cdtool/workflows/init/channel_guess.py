"""Guess which stream of a log is which channel: by name, then by values; each guess states its reason."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable

import numpy as np

from cdtool.recording import MEASURED
from cdtool.workflows.init import motion_evidence as motion
from cdtool.workflows.init.quantity_words import is_actual, is_load_cell, is_reference, is_something_else, word_for
from cdtool.workflows.init.streams import Channels, Found, Stream, joined
from cdtool.workflows.init.units_in_names import label, may_be

# Above this correlation one column is treated as another's derivative.
_FITS = 0.9
# Minimum share of a drive column's variance that inertia and friction explain.
_DRIVES = 0.6
_MOST_UNNAMED = 48
# Above these correlations one stream is treated as another's set value; the second if its name agrees.
_FOLLOWS, _FOLLOWS_BY_NAME = 0.97, 0.4
_BY_COURSE = "guessed from its values only"
# A one-letter name is weaker evidence for a quantity than this.
_SPEAKS = 2.0


def guess_channels(streams: list[Stream], topics: bool) -> Channels:
    """Guess the channels of a log by names and values; offline, not used for detection."""
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
        if word_for(quantity, label(stream))[0]
    )
    several = [(count, width) for width, count in votes.items() if width > 1]
    return max(several)[1] if several else 1


def _elements(stream: Stream) -> list[Stream]:
    return [stream.element(i) for i in range(stream.width)] if stream.field.endswith("[:]") else [stream]


def _unnamed(streams: list[Stream]) -> bool:
    return bool(streams) and all(stream.name.isdigit() for stream in streams)


def _by_place(channels: Channels) -> None:
    """Guess from columns without names: blocks of J positions, J speeds and, if they move like a drive, J torques."""
    streams = channels.free
    block = motion.blocks(streams[:_MOST_UNNAMED])
    if block is None:
        return
    first, joints, correlation = block
    channels.joints = joints
    parts = [streams[first + i * joints : first + (i + 1) * joints] for i in range(3)]
    fit = f"r = {correlation:.3f}"
    many = "column" if joints == 1 else f"{joints} columns"
    text = f"its derivative fits the {many} after it, {fit}"
    channels.take("position", joined(parts[0], _places(parts[0])), text)
    text = f"its integral fits the {many} before it, {fit}"
    channels.take("speed", joined(parts[1], _places(parts[1])), text)
    if len(parts[2]) == joints:
        drive = joined(parts[2], _places(parts[2]))
        share = motion.drive_fit(drive, channels.found["speed"].stream)
        text = f"its position after the speeds; inertia and friction explain {100 * max(share, 0.0):.0f} % of it"
        if motion.rests_and_peaks(drive):
            channels.take("force", drive, "constant level with short, high peaks", _BY_COURSE)
        else:
            channels.take("torque", drive, text, _BY_COURSE)
        channels.free = []  # other columns without names are not guessed


def _places(streams: list[Stream]) -> str:
    return f"columns {streams[0].name} to {streams[-1].name}"


def _motion_by_name(channels: Channels) -> None:
    named = {q: _named_for(channels, q) for q in ("position", "speed")}
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

    found = _best(_unnamed_for(channels, other), fit)
    if found is not None and found[0] > _FITS:
        relation = "integral" if other == "speed" else "derivative"
        channels.take(other, found[1], f"its {relation} fits '{stream.name}', r = {found[0]:.3f}", _BY_COURSE)


def _drive(channels: Channels) -> None:
    if "torque" in channels.found:
        return
    named = _named_for(channels, "torque")
    speed = channels.found.get("speed")
    if named:
        channels.take("torque", named[0][2], f"name ({named[0][1]})")
    elif moving := speed or channels.found.get("position"):
        rate = moving.stream if speed else _derived(moving.stream)
        found = _best(_unnamed_for(channels, "torque"), lambda stream: motion.drive_fit(stream, rate))
        if found is not None and found[0] > _DRIVES:
            text = f"moves like the force of a drive: inertia and friction explain {100 * found[0]:.0f} % of it"
            channels.take("torque", found[1], text, _BY_COURSE)


def _acceleration(channels: Channels) -> None:
    named = [item for item in _named_for(channels, "acceleration") if item[2].moves]
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


def _references(channels: Channels) -> None:
    """Guess set values by their names, else by the measured channel that follows them."""
    for quantity in ("position", "speed", "torque"):
        name = f"reference_{quantity}"
        named = [item for item in _named_for(channels, quantity, reference=True) if item[2].moves]
        measured = channels.found.get(quantity)
        if named:
            if measured is not None:
                alike = {id(item[2]): motion.likeness(measured.stream, item[2]) for item in named}
                named.sort(key=lambda item: -(item[0] + 3.0 * alike[id(item[2])]))
            channels.take(name, named[0][2], f"name ({named[0][1]}, of a set value)")
        elif measured is not None and measured.stream.moves:
            _follower(channels, name, quantity, measured)


def _ground_truth(channels: Channels) -> None:
    """Guess the load cell, labels and triggers; the name of a load cell counts more than that of any other force."""
    singles = [stream for stream in channels.free if stream.width == 1 and stream.moves and may_be("force", stream)]
    named = [(*word_for("force", _full(stream)), stream) for stream in singles if not is_something_else(stream.name)]
    named = [item for item in named if item[0] and ".torque." not in item[2].field and not is_reference(item[2].name)]
    if named:
        chosen = max(
            named,
            key=lambda item: (item[0] + is_load_cell(_full(item[2])), float(np.ptp(np.nan_to_num(item[2].values)))),
        )
        channels.take("force", chosen[2], f"name ({chosen[1]})")
    elif "force" not in channels.found:
        for stream in singles:
            if not _is_other("force", stream) and motion.rests_and_peaks(stream):
                channels.take("force", stream, "constant level with short, high peaks", _BY_COURSE)
                break
    for quantity in ("label", "trigger"):
        for stream in channels.free:
            seen = stream.values[np.isfinite(stream.values)]
            if stream.width == 1 and word_for(quantity, stream.name)[0] and np.isin(seen, (0.0, 1.0)).all():
                channels.take(quantity, stream, f"name ({word_for(quantity, stream.name)[1]}), 0 and 1 only")
                break


def _full(stream: Stream) -> str:
    """Return topic and name of a stream: a load cell may be named in the topic."""
    return f"{stream.topic} {label(stream)}"


def _follower(channels: Channels, name: str, quantity: str, measured: Found) -> None:
    """Guess the stream that the measured one follows; a name for a measured value (`Drehzahl Ist`) excludes it.

    If two streams bear the quantity's name, the smoother one is the set value; one without the name does not replace
    it.
    """
    stream = measured.stream
    candidates = [other for other in _unnamed_for(channels, quantity) if not is_actual(other.name)]
    found = _best(candidates, lambda other: motion.likeness(stream, other))
    if found is None:
        return
    correlation, other = found
    if correlation < (_FOLLOWS_BY_NAME if is_reference(other.name) else _FOLLOWS):
        return
    if motion.roughness(other) < motion.roughness(stream):
        check = "" if is_reference(other.name) else _BY_COURSE
        channels.take(name, other, f"follows '{stream.name}' with r = {correlation:.3f} and is smoother", check)
    elif (
        correlation > _FOLLOWS
        and quantity != "torque"
        and not is_reference(stream.name)
        and not is_actual(stream.name)
        and word_for(quantity, label(other))[0] >= word_for(quantity, label(stream))[0] > 0.0
    ):
        text = f"rougher than '{stream.name}', which it follows with r = {correlation:.3f}"
        channels.take(quantity, other, text, _BY_COURSE)
        channels.found[name] = Found(stream, f"{measured.why}; smoother than '{other.name}'", _BY_COURSE)


def _named_for(channels: Channels, quantity: str, reference: bool = False) -> list[tuple[float, str, Stream]]:
    """Return (strength, word, stream) of the free streams whose name best matches a quantity, the strongest first."""
    found = []
    for stream in channels.of_joints():
        name = label(stream)
        if is_reference(stream.name) != reference or is_something_else(stream.name) or _is_sensor_of_force(stream):
            continue
        if not may_be(quantity, stream):
            continue
        strength, word = word_for(quantity, name)
        if strength and strength >= max(word_for(other, name)[0] for other in MEASURED if may_be(other, stream)):
            found.append((strength, word, stream))
    return sorted(found, key=lambda item: -item[0])


def _unnamed_for(channels: Channels, quantity: str) -> list[Stream]:
    """Return the free streams that may be a quantity by their shape: no name or unit indicates another one, or a force.

    A load cell is ground truth and must never become an input.
    """
    return [stream for stream in channels.of_joints() if may_be(quantity, stream) and not _is_other(quantity, stream)]


def _best(streams: Iterable[Stream], score: Callable[[Stream], float]) -> tuple[float, Stream] | None:
    """Return the highest score and its stream; None for no streams."""
    return max(((score(stream), stream) for stream in streams), key=lambda item: item[0], default=None)


def _is_other(quantity: str, stream: Stream) -> bool:
    """Whether the name of a stream indicates another quantity, or a load cell."""
    name = label(stream)
    if is_something_else(stream.name) or _is_sensor_of_force(stream):
        return True
    if quantity != "force" and word_for("force", name)[0]:
        return True
    own = word_for(quantity, name)[0]
    return any(word_for(other, name)[0] >= max(_SPEAKS, own) for other in MEASURED if other != quantity)


def _is_sensor_of_force(stream: Stream) -> bool:
    return is_load_cell(label(stream)) or is_load_cell(stream.topic)
