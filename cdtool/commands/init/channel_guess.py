"""Guess which stream of a log is which channel: by physics and names; each guess states its reason and its doubts."""

from __future__ import annotations

from collections.abc import Iterable

from cdtool.commands.init import motion_evidence as motion
from cdtool.commands.init.column_blocks import of_blocks, on_circle
from cdtool.commands.init.confirmation import confirm
from cdtool.commands.init.names.name_evidence import BY_UNIT, Named, full_name, is_other, named, named_force, sides
from cdtool.commands.init.names.units_in_names import label, may_be, pressure_unit
from cdtool.commands.init.names.words import (
    BOUND,
    QUANTITIES,
    is_actual,
    is_current,
    is_one_of_three_axes,
    says,
    word_for,
    words,
)
from cdtool.commands.init.stream import Stream
from cdtool.commands.init.streams import Channels, Found
from cdtool.recordings.recording import CONTACT_PRESSURE
from cdtool.recordings.units import find_unit

# Columns of a kind that are compared, each with each: the time grows with their square.
_MOST_PAIRS = 32
BY_VALUES = "guessed from its values only"
# Below this correlation a letter alone (`a`, `s`, `n`) is no name of what the physics denies.
_DENIES = 0.5
# Physics that agrees counts more than any name.
_PHYSICS = 4.0
_REFERENCED = ("position", "speed", "torque")


def guess_channels(streams: list[Stream], topics: bool) -> Channels:
    """Guess the channels of a log by values and names; offline, not used for detection."""
    if streams and not topics and all(stream.name.isdigit() for stream in streams):
        channels = _without_names(streams)
    else:
        joints = _joint_count(streams)
        if joints == 1 and topics:
            streams = [part for stream in streams for part in stream.elements()]
        channels = Channels(joints, list(streams))
    if not channels.found:
        _motion(channels)
        _drive(channels)
    _acceleration(channels)
    for quantity in _REFERENCED:
        _reference(channels, quantity)
    _ground_truth(channels)
    confirm(channels)
    return channels


def _joint_count(streams: Iterable[Stream]) -> int:
    """Return the width of the families with the most quantities; of several such widths the largest.

    Families of efforts alone are several motors of one joint if a single position or speed is named.
    """
    quantities: dict[int, set[str]] = {}
    moving = [stream for stream in streams if stream.moves]
    for stream in moving:
        for quantity in _REFERENCED if stream.width > 1 else ():
            name = named(quantity, stream)
            if name.strength and (name.strength != BY_UNIT or stream.width > 2):
                quantities.setdefault(stream.width, set()).add(quantity)
    if all(found == {"torque"} for found in quantities.values()):
        of_families = {column for stream in moving if stream.width > 1 for column in stream.columns}
        singles = [stream for stream in moving if stream.width == 1 and not of_families & set(stream.columns)]
        if any(_strong(quantity, stream) for stream in singles for quantity in ("position", "speed")):
            return 1
    return max(((len(found), width) for width, found in quantities.items()), default=(0, 1))[1]


def _strong(quantity: str, stream: Stream) -> bool:
    return named(quantity, stream).strength >= BOUND and not says("reference", stream.name)


def _without_names(streams: list[Stream]) -> Channels:
    """Return the channels of a table without a header: an angle and its drive by a circle, or blocks of columns."""
    blocks, circle = of_blocks(streams), on_circle(streams)
    # With three joints or more related blocks are better evidence than the circle of a tool.
    if circle is None or (blocks and blocks[0].width >= 3):
        channels = Channels(blocks[0].width if blocks else 1, streams)
        channels.free = blocks or channels.free
        return channels
    channels = Channels(1, streams)
    angle, places, drives = circle
    channels.take("position", angle, f"columns {' and '.join(places)} move on a circle of this angle", BY_VALUES)
    if drives:
        others = "".join(f"; or column {other.name}?" for other in drives[1:3])
        channels.take("torque", drives[0], "moves like the force of a drive", BY_VALUES + others)
    channels.free = []  # other columns without names are not guessed
    return channels


def _motion(channels: Channels) -> None:
    """Guess position and speed: by name and as integral of each other, or by one of both if the names are silent."""
    positions, speeds = (_named_for(channels, quantity) for quantity in ("position", "speed"))
    if pair := _best_pair(positions, speeds):
        position, speed, correlation = pair
        weaker = min(position, speed, key=lambda item: item.strength)
        denied = abs(correlation) < _DENIES and weaker.strength < BOUND and position.strength != speed.strength
        if not denied:
            _take(channels, "position", position, positions)
            _take(channels, "speed", speed, speeds)
            return
        positions, speeds = (positions, []) if weaker is speed else ([], speeds)
    if positions or speeds:
        quantity, other = ("position", "speed") if positions else ("speed", "position")
        known = positions or speeds
        chosen = max(known, key=lambda item: item.strength + is_actual(item.stream.name))
        _take(channels, quantity, chosen, known)
        unnamed = _unnamed_for(channels, other)
        pair = _best_pair([chosen], unnamed) if positions else _best_pair(unnamed, [chosen])
        if pair and pair[2] > motion.FITS:
            _take(channels, other, pair[1] if positions else pair[0], ())
        return
    unnamed = _unnamed_for(channels, "position")
    rates = [item for item in unnamed if may_be("speed", item.stream)]
    pair = _best_pair(unnamed, rates)
    for item in unnamed:  # of set and measured values, the measured ones are behind
        if (
            pair
            and motion.same_values(pair[0].stream, item.stream)
            and motion.order(pair[0].stream, item.stream)[0] < 0.0
        ):
            later = _best_pair([item], rates)
            pair = later if later and later[2] > motion.FITS else pair
    if pair and pair[2] > motion.FITS_ALONE:
        _take(channels, "position", pair[0], ())
        _take(channels, "speed", pair[1], ())


def _best_pair(positions: list[Named], speeds: list[Named]) -> tuple[Named, Named, float] | None:
    """Return the position and the speed that are likeliest those of one joint, and their correlation.

    By physics, then by names. Of a position, a speed and an acceleration, the speed has an integral of its own. A speed
    that is ahead of the position's derivative may be a set value.
    """
    pairs = [
        (p, s, motion.integral_fit(p.stream, s.stream).correlation)
        for p in positions[:_MOST_PAIRS]
        for s in speeds[:_MOST_PAIRS]
        if p.stream is not s.stream and (p.word or s.word or motion.stirs(p.stream, s.stream))
    ]
    derived = {
        id(s.stream) for p, s, correlation in pairs if not p.word and not s.word and correlation > motion.FITS_ALONE
    }

    def score(pair: tuple[Named, Named, float]) -> tuple[bool, float]:
        position, speed, correlation = pair
        found = position.strength + speed.strength
        found += is_actual(position.stream.name) + is_actual(speed.stream.name)
        if abs(correlation) > motion.FITS:  # of opposite sign if one of them is reversed
            found += _PHYSICS - 0.5 * (motion.integral_lead(position.stream, speed.stream) > motion.AHEAD)
        if not (position.word and speed.word):
            found += round(correlation, 2)
        return id(position.stream) not in derived, found

    return max(pairs, key=score, default=None)


def _take(channels: Channels, quantity: str, chosen: Named, rivals: Iterable[Named]) -> None:
    """Take a stream; others whose name says as much are mentioned."""
    equal = [
        item.stream.name
        for item in rivals
        if item.stream is not chosen.stream
        and item.strength >= chosen.strength
        and not set(item.stream.columns) & set(chosen.stream.columns)
    ]
    check = ""
    if equal:
        listed = "', '".join(equal[:2])
        check = f"or '{listed}'{' ...' if len(equal) > 2 else ''}?"
    elif chosen.strength <= BY_UNIT:
        check = "its name does not say so" if chosen.word else BY_VALUES
    channels.take(quantity, chosen.stream, chosen.why, check)


def _drive(channels: Channels) -> None:
    """Guess the drive's effort: by name and by what inertia and friction explain; without a name by these alone."""
    found = {name: part.stream for name, part in channels.found.items()}
    position = found.get("position")
    rate = found.get("speed") or (motion.derived(position) if position is not None else None)
    known = _named_for(channels, "torque")[:_MOST_PAIRS]

    def share(item: Named) -> float:
        return motion.drive_fit(item.stream, rate, position) if rate is not None else 1.0

    def score(item: Named) -> float:
        names = item.strength + is_actual(item.stream.name) - 0.6 * is_current(label(item.stream))
        return names + _PHYSICS * share(item)

    if known:
        _take(channels, "torque", max(known, key=score), known)
    elif rate is not None:
        efforts = [
            (share(item), item)
            for item in _unnamed_for(channels, "torque")
            if not (is_other("torque", item.stream, by_letter=True) or named_force(item.stream).strength)
            and all(abs(motion.likeness(part, item.stream)) < motion.ALIKE for part in (rate, *found.values()))
            and not abs(motion.integral_fit(rate, item.stream, centred=True).slope - 1.0) < 0.02  # an acceleration
        ]
        # Of efforts that are explained as well, the first is the measured one.
        explained, chosen = max(efforts, key=lambda item: round(item[0], 1), default=(0.0, None))
        if chosen is not None and explained > motion.DRIVES:
            _take(channels, "torque", chosen, ())


def _acceleration(channels: Channels) -> None:
    known = [item for item in _named_for(channels, "acceleration") if not motion.is_flag(item.stream)]
    if not known:
        return
    top = [item for item in known if item.strength == known[0].strength]
    speed = channels.found.get("speed")

    def fit(item: Named) -> float:
        return abs(motion.integral_fit(speed.stream, item.stream, centred=True).correlation) if speed else 0.0

    fits = {id(item.stream): fit(item) for item in top}
    chosen = max(top, key=lambda item: fits[id(item.stream)])
    # Of an accelerometer with three axes none may be the joint's.
    names = [label(stream) for stream in channels.streams if stream.width == chosen.stream.width]
    doubtful = (speed is not None and chosen.strength < BOUND) or is_one_of_three_axes(label(chosen.stream), names)
    best = fits[id(chosen.stream)]
    if not doubtful or best >= _DENIES:
        _take(
            channels,
            "acceleration",
            chosen,
            [item for item in top if best <= motion.FITS or fits[id(item.stream)] > motion.FITS],
        )


def _reference(channels: Channels, quantity: str) -> None:
    """Guess a set value by its name, else by the measured channel that follows it."""
    known = _named_for(channels, quantity, reference=True)
    measured = channels.found.get(quantity)

    def score(item: Named) -> float:
        if measured is None:
            return item.strength
        same = is_current(label(item.stream)) == is_current(label(measured.stream))
        return item.strength + 3.0 * motion.likeness(measured.stream, item.stream) + same

    if known:
        _take(channels, f"reference_{quantity}", max(known, key=score), known)
    elif measured is not None and measured.stream.moves:
        _follower(channels, quantity, measured)


def _follower(channels: Channels, quantity: str, measured: Found) -> None:
    """Guess the stream that the measured one follows; a name for a measured value (`Drehzahl Ist`) excludes it.

    A set value is ahead in time. Of two streams with the same word for the quantity that do not differ in time, the
    smoother one is the set value. A second measured value, of the other side of a gear, is neither.
    """
    stream = measured.stream
    candidates = [
        (motion.likeness(stream, item.stream), item.stream)
        for item in _unnamed_for(channels, quantity, reference=None)
        if not (is_actual(item.stream.name) or is_other(quantity, item.stream, by_letter=True))
        and not (sides(stream) and sides(item.stream) and sides(stream) != sides(item.stream))
        and (quantity != "torque" or says("reference", item.stream.name))
    ]
    correlation, other = max(candidates, key=lambda item: item[0], default=(0.0, stream))
    is_set = bool(says("reference", other.name))
    if not (correlation > 0.4 if is_set else motion.same_values(stream, other)):  # if its name agrees, too
        return
    own, its = word_for(quantity, label(stream))[1], word_for(quantity, label(other))[1]
    ahead, text = motion.order(stream, other)
    if not is_set and own != its and (its or ahead < 0.0):
        return
    if ahead > 0.0:
        why = f"follows '{stream.name}' with r = {correlation:.3f} and is {text}"
        channels.take(f"reference_{quantity}", other, why, "" if is_set else BY_VALUES)
    elif (
        ahead < 0.0
        and quantity != "torque"
        and not is_set
        and not (says("reference", stream.name) or is_actual(stream.name))
        and not _of_different_parts(stream, other)
    ):
        channels.take(quantity, other, f"follows '{stream.name}' with r = {correlation:.3f}", BY_VALUES)
        channels.found[f"reference_{quantity}"] = Found(stream, f"{measured.why}; '{other.name}' follows it", BY_VALUES)


def _of_different_parts(one: Stream, other: Stream) -> bool:
    """Whether each of two names has a word of its own that states no quantity: `leaf angle` and `handle angle`."""
    first, second = (
        {word for word in words(label(stream)) if len(word) > 2 and not any(word_for(q, word)[0] for q in QUANTITIES)}
        for stream in (one, other)
    )
    return bool(first - second) and bool(second - first)


def _ground_truth(channels: Channels) -> None:
    """Guess the load cell, labels and triggers; the name of a load cell counts more than that of any other force."""
    _contact_pressure(channels)
    singles = [stream for stream in channels.free if stream.width == 1 and stream.moves and may_be("force", stream)]
    known = [
        item
        for item in map(named_force, singles)
        if item.strength and ".torque." not in item.stream.field and not says("reference", item.stream.name)
    ]
    if known:
        chosen = max(
            known,
            key=lambda item: (item.strength + bool(says("load_cell", full_name(item.stream))), item.stream.reach),
        )
        channels.take("force", chosen.stream, chosen.why)
    else:
        peaking = [
            stream
            for stream in singles
            if not (is_other("force", stream) or sides(stream) or channels.is_of_family(stream))
            and motion.rests_and_peaks(stream)
        ]
        if len(peaking) == 1:  # several say nothing about which is the load cell
            channels.take("force", peaking[0], "constant level with short, high peaks", BY_VALUES)
    questions = {
        "label": "is it that of the test, not the alarm of the controller?",
        "trigger": "is it high during each operation?",
    }
    for quantity, what in questions.items():
        flags = [
            stream
            for stream in channels.free
            if stream.width == 1 and word_for(quantity, stream.name)[0] and stream.moves and motion.is_flag(stream)
        ]
        if flags:
            channels.take(quantity, flags[0], f"name ({word_for(quantity, flags[0].name)[1]}), 0 and 1 only", what)


def _contact_pressure(channels: Channels) -> None:
    """Guess the pressure of the contact: by a name that says so, or by N/cm2, which no oil or air is measured in."""
    for stream in channels.free:
        if stream.width == 1 and stream.moves and (unit := pressure_unit(stream)):
            word = says("contact_pressure", stream.name)
            if word or find_unit(unit) == find_unit("N/cm2"):
                channels.take(CONTACT_PRESSURE, stream, f"name ({word})" if word else "its unit")
                return


def _named_for(channels: Channels, quantity: str, reference: bool = False) -> list[Named]:
    """Return the free streams whose name indicates a quantity, measured or set, the strongest first."""
    found = [
        named(quantity, stream) for stream in channels.of_joints() if bool(says("reference", stream.name)) == reference
    ]
    return sorted((item for item in found if item.strength), key=lambda item: -item.strength)


def _unnamed_for(channels: Channels, quantity: str, reference: bool | None = False) -> list[Named]:
    """Return the free streams that may be a quantity by their shape: no name or unit indicates another one, or a force.

    A load cell is ground truth and must never become an input; an inertial sensor moves with a body, not a joint.
    """
    return [
        Named(0.0, "", stream)
        for stream in channels.of_joints()
        if may_be(quantity, stream)
        and not is_other(quantity, stream)
        and not says("inertial", stream.name)
        and reference in (None, bool(says("reference", stream.name)))
    ]
