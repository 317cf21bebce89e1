"""Guess which stream of a log is which channel: by physics and names; each guess states its reason and its doubts."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np

from cdtool.commands.init import motion_evidence as motion
from cdtool.commands.init.certainty import add_doubts
from cdtool.commands.init.column_blocks import Blocks, find_angle, find_blocks, find_efforts
from cdtool.commands.init.names.units_in_names import label, may_be, pressure_unit, quantity_of_unit
from cdtool.commands.init.names.words import (
    is_actual,
    is_current,
    is_one_of_three_axes,
    is_only_a_joint,
    says,
    what_else,
    word_for,
    words,
)
from cdtool.commands.init.stream import Stream
from cdtool.commands.init.streams import Channels, Found
from cdtool.recordings.recording import CONTACT_PRESSURE, MEASURED
from cdtool.recordings.units import find_unit

# Above this correlation one column is treated as another's derivative; above the second one without any name.
_FITS, _FITS_UNNAMED = 0.9, 0.98
# Minimum share of a drive column's variance that inertia and friction explain; and of one whose name is a letter.
_DRIVES, _DRIVES_BY_LETTER = 0.6, 0.3
_MOST_UNNAMED = 48
# From this number of joints on related blocks are better evidence than the circle of a tool.
_ROBOT = 3
_MOST_PAIRS = 32
# Above these correlations one stream is treated as another's set value; the second if its name agrees.
_FOLLOWS, _FOLLOWS_BY_NAME = 0.97, 0.4
# A set value is ahead of its measured value by at least this share of a sample.
_AHEAD = 0.2
# Above this correlation, and without any lead, it is the measured value once more.
_SAME = 0.999999
# A set value that resembles another channel by this much more is not that of this one.
_CLOSER = 0.2
_BY_COURSE = "guessed from its values only"
# Below this correlation a letter alone (`a`, `s`, `n`) is no name of what the physics denies.
_DENIES = 0.5
# A one-letter name is weaker evidence for a quantity than the first; a unit alone is the second, `J1` alone the third.
_SPEAKS, _BY_UNIT, _BY_JOINT = 2.0, 0.8, 0.5
# Physics that agrees counts more than any name.
_PHYSICS = 4.0
_TOLD_UNIT = "its unit"

Named = tuple[float, str, Stream]


def guess_channels(streams: list[Stream], topics: bool) -> Channels:
    """Guess the channels of a log by values and names; offline, not used for detection."""
    joints = _joint_count(streams)
    if joints == 1 and topics:
        streams = [part for stream in streams for part in _elements(stream)]
    channels = Channels(joints, list(streams))
    if not topics and _unnamed(streams):
        _by_place(channels)
    else:
        _motion_by_name(channels)
        if not channels.found:
            _motion_by_values(channels)
    _drive(channels)
    _acceleration(channels)
    _references(channels)
    _ground_truth(channels)
    add_doubts(channels)
    return channels


def name_strength(quantity: str, stream: Stream) -> tuple[float, str]:
    """Return how strongly name and unit of a stream indicate a quantity, with the word; 0 if they indicate another.

    A unit counts only if no word does: `Beschl. [m/s²]`; a name that is only that of a joint may be a position.
    """
    if what_else(stream.name) or _is_sensor_of_force(stream) or not may_be(quantity, stream):
        return 0.0, ""
    name = label(stream)
    strength, word = word_for(quantity, name)
    others = [word_for(other, name)[0] for other in (*MEASURED, "force") if other != quantity and may_be(other, stream)]
    if strength:
        force = quantity == "torque" and word == "drive force"
        return (strength, word) if force or strength >= max(others, default=0.0) else (0.0, "")
    if any(others):
        return 0.0, ""
    if quantity_of_unit(stream) == quantity:
        return _BY_UNIT, _TOLD_UNIT
    if quantity == "position" and stream.width > 2 and is_only_a_joint(name):
        return _BY_JOINT, "joints"
    return 0.0, ""


def _joint_count(streams: Iterable[Stream]) -> int:
    """Return the width of the families with the most quantities; of several such widths the largest.

    Families of efforts alone are several motors of one joint if a single position or speed is named.
    """
    quantities: dict[int, set[str]] = {}
    for stream in streams:
        for quantity in ("position", "speed", "torque"):
            strength, word = name_strength(quantity, stream) if stream.moves and stream.width > 1 else (0.0, "")
            if strength and (word != _TOLD_UNIT or stream.width > 2):
                quantities.setdefault(stream.width, set()).add(quantity)
    if all(found == {"torque"} for found in quantities.values()) and _has_single_motion(streams):
        return 1
    several = [(len(found), width) for width, found in quantities.items()]
    return max(several)[1] if several else 1


def _has_single_motion(streams: Iterable[Stream]) -> bool:
    """Whether a column of no family has the name of a measured position or speed that moves."""
    listed = list(streams)
    of_families = {column for stream in listed if stream.width > 1 for column in stream.columns}
    return any(
        stream.width == 1
        and stream.moves
        and not of_families & set(stream.columns)
        and not says("reference", stream.name)
        and any(name_strength(quantity, stream)[0] >= _SPEAKS for quantity in ("position", "speed"))
        for stream in listed
    )


def _elements(stream: Stream) -> list[Stream]:
    return [stream.element(i) for i in range(stream.width)] if stream.field.endswith("[:]") else [stream]


def _unnamed(streams: list[Stream]) -> bool:
    return bool(streams) and all(stream.name.isdigit() for stream in streams)


def _by_place(channels: Channels) -> None:
    """Guess from columns without names: blocks of J columns that are related as positions, speeds and efforts."""
    streams = channels.free[:_MOST_UNNAMED]
    found, angle = find_blocks(streams), find_angle(streams)
    if angle is not None and (found is None or found.joints < _ROBOT):
        _by_circle(channels, *angle)
    elif found is not None:
        _by_blocks(channels, found)
    if angle is not None or (found is not None and found.joints > 1):
        channels.free = []  # other columns without names are not guessed


def _by_blocks(channels: Channels, found: Blocks) -> None:
    channels.joints = found.joints
    fit = f"r = {found.correlation:.3f}"
    reasons = {
        "position": f"its derivative fits the {found.streams['speed'].name}, {fit}",
        "speed": f"its integral fits the {found.streams['position'].name}, {fit}",
        "torque": f"inertia, friction and weight explain {100 * found.explained:.0f} % of it",
    }
    for channel, stream in found.streams.items():
        why = reasons.get(channel, f"the same course as the {channel.removeprefix('reference_')}, and not behind it")
        channels.take(channel, stream, why, _BY_COURSE)


def _by_circle(channels: Channels, position: Stream, places: tuple[Stream, ...]) -> None:
    """Guess an angle by the coordinates that move on its circle, and the first column that moves like its drive."""
    circle = " and ".join(place.name for place in places[:2])
    channels.take("position", position, f"columns {circle} move on a circle of this angle", _BY_COURSE)
    if efforts := find_efforts(channels.free[:_MOST_UNNAMED], position, motion.derived(position)):
        others = "".join(f"; or column {other.name}?" for other in efforts[1:3])
        channels.take("torque", efforts[0], "moves like the force of a drive", _BY_COURSE + others)


def _motion_by_name(channels: Channels) -> None:
    named = {q: _named_for(channels, q) for q in ("position", "speed")}
    pairs = [
        (_pair_score(p, s, fit.correlation), -i - k, p, s, fit)
        for i, p in enumerate(named["position"][:_MOST_PAIRS])
        for k, s in enumerate(named["speed"][:_MOST_PAIRS])
        if p[2] is not s[2] and (fit := motion.integral_fit(p[2], s[2]))
    ]
    if pairs:
        _, _, position, speed, fit = max(pairs, key=lambda pair: pair[:2])
        weaker = min(position, speed, key=lambda item: item[0])
        if abs(fit.correlation) < _DENIES and weaker[0] < _SPEAKS and position[0] != speed[0]:
            _take_one(channels, "speed" if weaker is position else "position", named)
            return
        told = f"; its derivative fits the speed, r = {fit.correlation:.3f}" if fit.correlation > _FITS else ""
        _take_named(channels, "position", position, _without(speed[2], named["position"]), told)
        _take_named(channels, "speed", speed, _without(position[2], named["speed"]))
        return
    for quantity in ("position", "speed"):
        if named[quantity]:
            _take_one(channels, quantity, named)
            return


def _take_one(channels: Channels, quantity: str, named: dict[str, list[Named]]) -> None:
    """Take a position or a speed by its name alone, and look for the other one by values."""
    chosen = max(named[quantity], key=lambda item: item[0] + is_actual(item[2].name))
    _take_named(channels, quantity, chosen, named[quantity])
    _partner(channels, chosen[2], "speed" if quantity == "position" else "position")


def _pair_score(position: Named, speed: Named, correlation: float) -> float:
    """Return how well two streams are one joint's position and speed: by physics, then by their names.

    A speed that is ahead of the position's derivative may be a set value.
    """
    measured = is_actual(position[2].name) + is_actual(speed[2].name)
    score = position[0] + speed[0] + measured + _alike(position, speed)
    if abs(correlation) > _FITS:  # of opposite sign if one of them is reversed
        score += _PHYSICS - 0.5 * (motion.integral_lead(position[2], speed[2]) > _AHEAD)
    return score


def _alike(one: Named, other: Named) -> float:
    """Return the share of words that two names have in common, apart from the words for their quantities."""
    first, second = (
        {word for word in words(item[2].name) if word not in item[1] and item[1] not in word} for item in (one, other)
    )
    return len(first & second) / len(first | second) if first | second else 1.0


def _take_named(channels: Channels, quantity: str, chosen: Named, named: list[Named], told: str = "") -> None:
    """Take a stream by its name; others that have such a name as well are mentioned."""
    strength, word, stream = chosen
    others = [item for item in named if item[2] is not stream and not _overlap(item[2], stream)]
    equal = [item[2] for item in others if item[0] >= strength]
    check = f"or '{equal[0].name}'" if equal else ""
    if len(equal) > 1:
        check += f", '{equal[1].name}'" + (" ..." if len(equal) > 2 else "")
    why = _TOLD_UNIT if word == _TOLD_UNIT else f"name ({word})"
    if strength <= _BY_UNIT and not check:
        check = "its name does not say so"
    channels.take(quantity, stream, why + told, f"{check}?" if check.startswith("or") else check)


def _without(stream: Stream, named: list[Named]) -> list[Named]:
    return [item for item in named if item[2] is not stream]


def _overlap(one: Stream, other: Stream) -> bool:
    return bool(set(one.columns) & set(other.columns))


def _motion_by_values(channels: Channels) -> None:
    """Guess position and speed in columns whose names say nothing: one is the integral of the other."""
    streams = [s for s in channels.of_joints() if not any(_is_taken(q, s) for q in ("position", "speed"))]
    streams = [s for s in streams if not motion.is_regular(s)][:_MOST_PAIRS]
    pairs = [
        (fit, p, s)
        for p in streams
        for s in streams
        if p is not s and may_be("position", p) and may_be("speed", s)
        and (fit := motion.integral_fit(p, s).correlation) > _FITS_UNNAMED
    ]  # fmt: skip
    # Of a position, a speed and an acceleration, the speed is the one that has an integral.
    tops = [pair for pair in pairs if not any(other[2] is pair[1] for other in pairs)]
    if not tops:
        return
    correlation, position, speed = max(tops, key=lambda pair: pair[0])
    told = f"r = {correlation:.3f}"
    channels.take("position", position, f"its derivative fits '{speed.name}', {told}", _BY_COURSE)
    channels.take("speed", speed, f"its integral fits '{position.name}', {told}", _BY_COURSE)


def _partner(channels: Channels, stream: Stream, other: str) -> None:
    def fit(candidate: Stream) -> float:
        pair = (stream, candidate) if other == "speed" else (candidate, stream)
        return motion.integral_fit(*pair).correlation

    found = _best([item for item in _unnamed_for(channels, other) if not says("reference", item.name)], fit)
    if found is not None and found[0] > _FITS:
        relation = "integral" if other == "speed" else "derivative"
        channels.take(other, found[1], f"its {relation} fits '{stream.name}', r = {found[0]:.3f}", _BY_COURSE)


def _drive(channels: Channels) -> None:
    if "torque" in channels.found:
        return
    named = _named_for(channels, "torque")
    rate, position = _rate_and_position(channels)
    if rate is None:
        if named:
            _take_named(channels, "torque", named[0], named)
        return
    moving = rate

    def explained(stream: Stream) -> float:
        return motion.drive_fit(stream, moving, position)

    shares = {id(item[2]): explained(item[2]) for item in named[:_MOST_PAIRS]}
    named = [item for item in named[:_MOST_PAIRS] if item[0] >= _SPEAKS or shares[id(item[2])] > _DRIVES_BY_LETTER]
    if named:
        best = max(named, key=lambda item: _drive_score(channels, item, shares[id(item[2])]))
        share = shares[id(best[2])]
        told = f"; inertia, friction and weight explain {100 * share:.0f} % of it" if share > _DRIVES else ""
        _take_named(channels, "torque", best, named, told)
        return
    others = [
        stream
        for stream in _unnamed_for(channels, "torque")
        if not says("reference", stream.name)
        and not _says_more("torque", stream)
        and abs(motion.likeness(moving, stream)) < _FOLLOWS
    ]
    unnamed = _best(others, lambda stream: motion.drive_fit(stream, moving))
    if unnamed is not None and unnamed[0] > _DRIVES:
        text = f"moves like the force of a drive: inertia and friction explain {100 * unnamed[0]:.0f} % of it"
        channels.take("torque", unnamed[1], text, _BY_COURSE)


def _drive_score(channels: Channels, item: Named, share: float) -> float:
    """Rank efforts: those that inertia and friction explain, then by name; a torque before a current."""
    alike = [_alike(item, (0.0, "", found.stream)) for found in channels.found.values()]
    score = (
        item[0]
        + _PHYSICS * (share > _DRIVES_BY_LETTER)
        + max(share, 0.0)
        + max(alike, default=0.0)
        + is_actual(item[2].name)
    )
    return score - 0.6 * is_current(label(item[2]))


def _rate_and_position(channels: Channels) -> tuple[Stream | None, Stream | None]:
    position = channels.found["position"].stream if "position" in channels.found else None
    if "speed" in channels.found:
        return channels.found["speed"].stream, position
    return (motion.derived(position), position) if position is not None else (None, None)


def _acceleration(channels: Channels) -> None:
    named = [item for item in _named_for(channels, "acceleration") if item[2].moves and not motion.is_flag(item[2])]
    if not named:
        return
    speed = channels.found.get("speed")
    top = [item for item in named if item[0] == named[0][0]]
    # Of an accelerometer with three axes none may be the joint's.
    names = [label(stream) for stream in channels.streams if stream.width == top[0][2].width]
    if speed is None and is_one_of_three_axes(label(top[0][2]), names):
        return
    if speed is None:
        _take_named(channels, "acceleration", top[0], named)
        return
    fits = {id(item[2]): motion.derivative_fit(item[2], speed.stream).correlation for item in top}
    chosen = max(top, key=lambda item: abs(fits[id(item[2])]))
    correlation = fits[id(chosen[2])]
    if abs(correlation) < _DENIES and (chosen[0] < _SPEAKS or is_one_of_three_axes(label(chosen[2]), names)):
        return
    told = f"; its integral fits the speed, r = {correlation:.3f}" if abs(correlation) > _FITS else ""
    rivals = [item for item in top if abs(fits[id(item[2])]) > _FITS] if told else top
    _take_named(channels, "acceleration", chosen, rivals, told)


def _references(channels: Channels) -> None:
    """Guess set values by their names, else by the measured channel that follows them."""
    for quantity in ("position", "speed", "torque"):
        name = f"reference_{quantity}"
        named = [item for item in _named_for(channels, quantity, reference=True) if item[2].moves]
        measured = channels.found.get(quantity)
        if named:
            if measured is not None:
                kind = is_current(label(measured.stream))
                alike = {id(item[2]): motion.likeness(measured.stream, item[2]) for item in named}
                same = {id(item[2]): is_current(label(item[2])) == kind for item in named}
                named.sort(key=lambda item: -(item[0] + 3.0 * alike[id(item[2])] + same[id(item[2])]))
            strength, word, stream = named[0]
            why = f"name ({word}, of a set value)"
            rivals = [item[2] for item in named[1:] if item[0] >= strength and not _overlap(item[2], stream)]
            channels.take(name, stream, why, f"or '{rivals[0].name}'?" if rivals else "")
        elif measured is not None and measured.stream.moves:
            _follower(channels, name, quantity, measured)


def _ground_truth(channels: Channels) -> None:
    """Guess the load cell, labels and triggers; the name of a load cell counts more than that of any other force."""
    _contact_pressure(channels)
    singles = [stream for stream in channels.free if stream.width == 1 and stream.moves and may_be("force", stream)]
    named = [(*force_strength(stream), stream) for stream in singles]
    named = [
        item for item in named if item[0] and ".torque." not in item[2].field and not says("reference", item[2].name)
    ]
    if named:
        chosen = max(
            named,
            key=lambda item: (
                item[0] + bool(says("load_cell", _full(item[2]))),
                float(np.ptp(np.nan_to_num(item[2].values))),
            ),
        )
        channels.take("force", chosen[2], _TOLD_UNIT if chosen[1] == _TOLD_UNIT else f"name ({chosen[1]})")
    elif "force" not in channels.found:
        peaking = [
            stream
            for stream in singles
            if not (_is_other("force", stream) or _sides(stream) or channels.is_of_family(stream))
            and motion.rests_and_peaks(stream)
        ]
        if len(peaking) == 1:  # several say nothing about which is the load cell
            channels.take("force", peaking[0], "constant level with short, high peaks", _BY_COURSE)
    questions = {
        "label": "is it that of the test, not the alarm of the controller?",
        "trigger": "is it high during each operation?",
    }
    for quantity, what in questions.items():
        for stream in channels.free:
            seen = np.unique(stream.values[np.isfinite(stream.values)])
            if stream.width == 1 and word_for(quantity, stream.name)[0] and np.array_equal(seen, (0.0, 1.0)):
                channels.take(quantity, stream, f"name ({word_for(quantity, stream.name)[1]}), 0 and 1 only", what)
                break


def _contact_pressure(channels: Channels) -> None:
    """Guess the pressure of the contact: by a name that says so, or by N/cm2, which no oil or air is measured in."""
    for stream in channels.free:
        if stream.width != 1 or not stream.moves or not may_be(CONTACT_PRESSURE, stream):
            continue
        unit, word = pressure_unit(stream), says("contact_pressure", stream.name)
        if unit and (word or find_unit(unit) == find_unit("N/cm2")):
            channels.take(CONTACT_PRESSURE, stream, f"name ({word})" if word else _TOLD_UNIT)
            return


def force_strength(stream: Stream) -> tuple[float, str]:
    """Return how strongly a stream's name, topic or unit indicates a measured force, and the word."""
    if what_else(stream.name):
        return 0.0, ""
    strength, word = word_for("force", _full(stream))
    if word == "wrench" and word_for("torque", label(stream))[0]:
        return 0.0, ""  # the torque of a wrench
    if strength:
        return strength, word
    # An effort in N that is not the drive's is a force: `Effort fermeture (N)`.
    taken = says("twist", label(stream)) or any(
        word_for(quantity, label(stream))[0] >= _SPEAKS for quantity in MEASURED if quantity != "torque"
    )
    return (_BY_UNIT, _TOLD_UNIT) if quantity_of_unit(stream) == "force" and not taken else (0.0, "")


def _full(stream: Stream) -> str:
    """Return topic and name of a stream: a load cell may be named in the topic."""
    return f"{stream.topic} {label(stream)}"


def _follower(channels: Channels, name: str, quantity: str, measured: Found) -> None:
    """Guess the stream that the measured one follows; a name for a measured value (`Drehzahl Ist`) excludes it.

    A set value is ahead in time. Of two streams with the same word for the quantity that do not differ in time, the
    smoother one is the set value. A second measured value, of the other side of a gear, is neither.
    """
    stream = measured.stream
    candidates = [
        other
        for other in _unnamed_for(channels, quantity)
        if not is_actual(other.name) and not _says_more(quantity, other) and not _of_two_sides(stream, other)
    ]
    if quantity == "torque":
        candidates = [other for other in candidates if says("reference", other.name)]
    found = _best(candidates, lambda other: motion.likeness(stream, other))
    if found is None:
        return
    correlation, other = found
    if correlation < (_FOLLOWS_BY_NAME if says("reference", other.name) else _FOLLOWS):
        return
    rest = [channels.found[q].stream for q in ("position", "speed", "torque") if q in channels.found and q != quantity]
    if any(motion.likeness(rival, other) > correlation + _CLOSER for rival in rest):
        return
    own, others = word_for(quantity, label(stream)), word_for(quantity, label(other))
    ahead = motion.lead(stream, other)
    if correlation > _SAME and abs(ahead) < _AHEAD and not says("reference", other.name):
        return  # the same sensor in another unit
    if abs(ahead) < _AHEAD:
        smoother = motion.roughness(other) < motion.roughness(stream)
        alike = own[1] == others[1] or not others[1] or says("reference", other.name)
        text = "is smoother" if smoother else ""
        ahead = 1.0 if smoother and alike else -1.0 if not smoother and own[1] == others[1] and own[1] else 0.0
    else:
        text = f"is ahead of it by {abs(ahead):.1f} samples"
    if ahead > 0.0:
        check = "" if says("reference", other.name) else _BY_COURSE
        channels.take(name, other, f"follows '{stream.name}' with r = {correlation:.3f} and {text}", check)
    elif (
        ahead < 0.0
        and correlation > _FOLLOWS
        and quantity != "torque"
        and not says("reference", stream.name)
        and not is_actual(stream.name)
        and others[0] >= own[0] > 0.0
        and not _of_different_parts(stream, other)
    ):
        reason = "rougher than" if not text.startswith("is ahead") else "behind"
        why = f"{reason} '{stream.name}', which it follows with r = {correlation:.3f}"
        channels.take(quantity, other, why, _BY_COURSE)
        opposite = "smoother than" if reason == "rougher than" else "ahead of"
        channels.found[name] = Found(stream, f"{measured.why}; {opposite} '{other.name}'", _BY_COURSE)


def _of_two_sides(one: Stream, other: Stream) -> bool:
    """Whether two names are those of different sides of a gear: `motor_position` and `load_position`."""
    first, second = _sides(one), _sides(other)
    return bool(first) and bool(second) and first != second


def _sides(stream: Stream) -> set[str]:
    """Return the words of a name for a side of a gear: `motor` of `motor_position`."""
    return {word for word in words(stream.name) if says("gear_side", word)}


def _own_words(name: str) -> set[str]:
    """Return the words of a name that state neither a quantity nor whether it is measured: `hip` of `HipAngle`."""
    kinds = (*MEASURED, "force", "label", "trigger")
    return {
        word
        for word in words(name)
        if len(word) > 2
        and not any(word_for(quantity, word)[0] for quantity in kinds)
        and not (says("reference", word) or is_actual(word) or says("version", word) or says("gear_side", word))
    }


def _of_different_parts(one: Stream, other: Stream) -> bool:
    """Whether each of two names has a word of its own that states no quantity: `leaf angle` and `handle angle`."""
    first, second = _own_words(label(one)), _own_words(label(other))
    return bool(first - second) and bool(second - first)


def _says_more(quantity: str, stream: Stream) -> bool:
    """Whether the name of a stream indicates another quantity more strongly than this one, if only by a letter."""
    name = label(stream)
    own = word_for(quantity, name)[0]
    return any(word_for(other, name)[0] > own for other in (*MEASURED, "force") if other != quantity)


def _named_for(channels: Channels, quantity: str, reference: bool = False) -> list[Named]:
    """Return (strength, word, stream) of the free streams whose name best matches a quantity, the strongest first."""
    found = []
    for stream in channels.of_joints():
        if bool(says("reference", stream.name)) != reference:
            continue
        strength, word = name_strength(quantity, stream)
        if strength:
            found.append((strength, word, stream))
    return sorted(found, key=lambda item: -item[0])


def _unnamed_for(channels: Channels, quantity: str) -> list[Stream]:
    """Return the free streams that may be a quantity by their shape: no name or unit indicates another one, or a force.

    A load cell is ground truth and must never become an input.
    """
    return [
        stream
        for stream in channels.of_joints()
        if may_be(quantity, stream) and not _is_other(quantity, stream) and not says("inertial", stream.name)
    ]


def _best(streams: Iterable[Stream], score: Callable[[Stream], float]) -> tuple[float, Stream] | None:
    """Return the highest score and its stream; None for no streams."""
    return max(((score(stream), stream) for stream in streams), key=lambda item: item[0], default=None)


def _is_other(quantity: str, stream: Stream) -> bool:
    """Whether the name of a stream indicates another quantity, or a load cell."""
    name = label(stream)
    if what_else(stream.name) or _is_sensor_of_force(stream):
        return True
    if quantity != "force" and word_for("force", name)[0]:
        return True
    own = word_for(quantity, name)[0]
    return any(word_for(other, name)[0] >= max(_SPEAKS, own) for other in MEASURED if other != quantity)


def _is_taken(quantity: str, stream: Stream) -> bool:
    """Whether the name of a stream indicates a quantity other than this one, a force, or no channel."""
    return _is_other(quantity, stream) or bool(says("reference", stream.name))


def _is_sensor_of_force(stream: Stream) -> bool:
    return bool(says("load_cell", label(stream)) or says("load_cell", stream.topic))
