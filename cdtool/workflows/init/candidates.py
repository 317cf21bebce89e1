"""Streams that may be a channel: by their names, or those whose names tell of nothing else."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from cdtool.recording import MEASURED
from cdtool.workflows.init.quantity_words import is_load_cell, is_reference, is_something_else, word_for
from cdtool.workflows.init.streams import Channels, Stream
from cdtool.workflows.init.units_in_names import label, may_be

BY_COURSE = "its course alone tells it"
# A name of one letter speaks for a quantity less than this.
_SPEAKS = 2.0


def named_for(channels: Channels, quantity: str, reference: bool = False) -> list[tuple[float, str, Stream]]:
    """(strength, word, stream) of the free streams whose name speaks for a quantity most, the strongest first."""
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


def unnamed_for(channels: Channels, quantity: str) -> list[Stream]:
    """The free streams that a quantity may be by their course: no name or unit tells of another, or of a force.

    A load cell is ground truth: nothing makes an input of it.
    """
    return [stream for stream in channels.of_joints() if may_be(quantity, stream) and not is_other(quantity, stream)]


def best(streams: Iterable[Stream], score: Callable[[Stream], float]) -> tuple[float, Stream] | None:
    """The highest score and the stream that has it; None of none."""
    return max(((score(stream), stream) for stream in streams), key=lambda item: item[0], default=None)


def is_other(quantity: str, stream: Stream) -> bool:
    """True for a stream whose name tells of another quantity, or of a load cell."""
    name = label(stream)
    if is_something_else(stream.name) or _is_sensor_of_force(stream):
        return True
    if quantity != "force" and word_for("force", name)[0]:
        return True
    own = word_for(quantity, name)[0]
    return any(word_for(other, name)[0] >= max(_SPEAKS, own) for other in MEASURED if other != quantity)


def _is_sensor_of_force(stream: Stream) -> bool:
    return is_load_cell(label(stream)) or is_load_cell(stream.topic)
