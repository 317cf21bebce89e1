"""List the columns that a draft does not map, each with the next best guess: none is dropped silently."""

from __future__ import annotations

from dataclasses import dataclass

from cdtool.commands.init import motion_evidence as motion
from cdtool.commands.init.names.name_evidence import named, named_force
from cdtool.commands.init.names.units_in_names import is_foreign, label
from cdtool.commands.init.names.words import says, what_else
from cdtool.commands.init.stream import Stream
from cdtool.commands.init.streams import Channels
from cdtool.recordings.recording import MEASURED


@dataclass(frozen=True)
class Unmapped:
    """Columns of one name, or a topic's field, that no channel uses.

    `guess` is the channel that they may be, or an empty text; `why` is the reason, also for not being one. `low` and
    `high` are the smallest and the largest value, NaN without values.
    """

    columns: tuple[str, ...]
    topic: str
    field: str
    guess: str
    why: str
    low: float
    high: float


def unmapped_columns(channels: Channels) -> tuple[Unmapped, ...]:
    """Return every column that is not mapped, those that differ only by a number or a joint together.

    Parameters
    ----------
    channels : Channels
        The channels found, with all streams of the log.

    Returns
    -------
    tuple of Unmapped
        In the order of the log; a family of columns is at the place of its first one.
    """
    mapped = {column for found in channels.found.values() for column in found.stream.columns}
    fields = {(found.stream.topic, found.stream.field) for found in channels.found.values() if found.stream.topic}
    families = [s for s in channels.streams if len(s.columns) > 1 and not mapped & set(s.columns)]
    if channels.joints == 1:  # numbered channels of an amplifier are not alike
        families = [family for family in families if what_else(family.name) or not family.moves]
    families.sort(key=lambda family: family.width != channels.joints)
    left: list[Stream] = []
    listed = set(mapped)
    for stream in channels.streams:
        if stream.topic:
            left += [] if (stream.topic, stream.field) in fields else [stream]
        elif len(stream.columns) == 1 and stream.columns[0] not in listed:
            unlisted = [family for family in families if not listed & set(family.columns)]
            whole = next((family for family in unlisted if stream.columns[0] in family.columns), stream)
            left.append(whole)
            listed |= set(whole.columns)
    return tuple(_described(stream, channels) for stream in left)


def _described(stream: Stream, channels: Channels) -> Unmapped:
    known = stream.known
    low, high = (float(known.min()), float(known.max())) if len(known) else (float("nan"), float("nan"))
    guess, why = _next_best(stream, channels) if len(known) else ("", "no values")
    return Unmapped(stream.columns, stream.topic, stream.field, guess, why, low, high)


def _next_best(stream: Stream, channels: Channels) -> tuple[str, str]:
    """Return the channel that a stream may be, with the reason; an empty text for neither."""
    if reason := what_else(stream.name):
        return "", f"{reason}, by its name"
    if stream.unit and is_foreign(stream.unit):
        return "", f"its unit is {stream.unit}"
    if not stream.moves:
        return "", "constant"
    known = {quantity: named(quantity, stream) for quantity in MEASURED}
    quantity, best = max(known.items(), key=lambda item: item[1].strength)
    if says("clock", label(stream)) and not best.strength:
        return "", "a time, by its name"
    force = named_force(stream)
    if stream.width == 1 and force.strength and not known["torque"].strength:
        return "force", force.why
    if best.strength:
        return f"reference_{quantity}" if says("reference", stream.name) else quantity, best.why
    alike = [
        (abs(motion.likeness(found.stream, stream)), name)
        for name, found in channels.found.items()
        if name in ("position", "speed", "torque") and found.stream.width == stream.width
    ]
    correlation, quantity = max(alike, default=(0.0, ""))
    if correlation > motion.ALIKE:
        return quantity, f"follows '{channels.found[quantity].stream.name}', r = {correlation:.3f}"
    return "", "neither name nor values indicate a channel"
