"""Which streams are set values, the load cell, labels and triggers? Asked when the measured channels are found."""

from __future__ import annotations

import numpy as np

from cdtool.workflows.init import motion_evidence as motion
from cdtool.workflows.init.candidates import BY_COURSE, best, is_other, named_for, unnamed_for
from cdtool.workflows.init.quantity_words import is_actual, is_load_cell, is_reference, is_something_else, word_for
from cdtool.workflows.init.streams import Channels, Found, Stream
from cdtool.workflows.init.units_in_names import label, may_be

# Correlations from which on one stream follows another as a set value, and where a name tells of set values too.
_FOLLOWS, _FOLLOWS_BY_NAME = 0.97, 0.4


def guess_references(channels: Channels) -> None:
    """Set values, by their names, else the one that a measured channel follows."""
    for quantity in ("position", "speed", "torque"):
        name = f"reference_{quantity}"
        named = [item for item in named_for(channels, quantity, reference=True) if item[2].moves]
        measured = channels.found.get(quantity)
        if named:
            if measured is not None:
                alike = {id(item[2]): motion.likeness(measured.stream, item[2]) for item in named}
                named.sort(key=lambda item: -(item[0] + 3.0 * alike[id(item[2])]))
            channels.take(name, named[0][2], f"name ({named[0][1]}, of a set value)")
        elif measured is not None and measured.stream.moves:
            _follower(channels, name, quantity, measured)


def guess_ground_truth(channels: Channels) -> None:
    """The load cell, labels and triggers; a load cell's name weighs more than one that tells of any force."""
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
            if not is_other("force", stream) and motion.rests_and_peaks(stream):
                channels.take("force", stream, "it rests at one level and has short, high peaks", BY_COURSE)
                break
    for quantity in ("label", "trigger"):
        for stream in channels.free:
            seen = stream.values[np.isfinite(stream.values)]
            if stream.width == 1 and word_for(quantity, stream.name)[0] and np.isin(seen, (0.0, 1.0)).all():
                channels.take(quantity, stream, f"name ({word_for(quantity, stream.name)[1]}), 0 and 1 only")
                break


def _full(stream: Stream) -> str:
    """A topic's name tells of a load cell, too."""
    return f"{stream.topic} {label(stream)}"


def _follower(channels: Channels, name: str, quantity: str, measured: Found) -> None:
    """A stream that the measured one follows; what its name calls measured (`Drehzahl Ist`) is no set value.

    Of two that bear the quantity's name the smoother one is the set value; a stream without its name displaces none.
    """
    stream = measured.stream
    candidates = [other for other in unnamed_for(channels, quantity) if not is_actual(other.name)]
    found = best(candidates, lambda other: motion.likeness(stream, other))
    if found is None:
        return
    correlation, other = found
    if correlation < (_FOLLOWS_BY_NAME if is_reference(other.name) else _FOLLOWS):
        return
    if motion.roughness(other) < motion.roughness(stream):
        check = "" if is_reference(other.name) else BY_COURSE
        channels.take(name, other, f"follows '{stream.name}' with r = {correlation:.3f} and is smoother", check)
    elif (
        correlation > _FOLLOWS
        and quantity != "torque"
        and not is_reference(stream.name)
        and not is_actual(stream.name)
        and word_for(quantity, label(other))[0] >= word_for(quantity, label(stream))[0] > 0.0
    ):
        text = f"rougher than '{stream.name}', which it follows with r = {correlation:.3f}"
        channels.take(quantity, other, text, BY_COURSE)
        channels.found[name] = Found(stream, f"{measured.why}; smoother than '{other.name}'", BY_COURSE)
