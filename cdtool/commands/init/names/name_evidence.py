"""What the names and units of streams say about their quantities."""

from __future__ import annotations

from typing import NamedTuple

from cdtool.commands.init.names.units_in_names import label, may_be, quantity_of_unit
from cdtool.commands.init.names.words import BOUND, QUANTITIES, is_only_a_joint, says, what_else, word_for, words
from cdtool.commands.init.stream import Stream

# A unit alone is weaker evidence than any word, `J1` alone than a unit.
BY_UNIT, _BY_JOINT = 0.8, 0.5
_TOLD_UNIT = "its unit"


class Named(NamedTuple):
    """A stream, how strongly its name indicates a quantity, and the word that does; 0 and no word without a name."""

    strength: float
    word: str
    stream: Stream

    @property
    def why(self) -> str:
        """Return the reason in the draft."""
        return self.word if self.word == _TOLD_UNIT else f"name ({self.word})" if self.word else "its values"


def named(quantity: str, stream: Stream) -> Named:
    """Return how strongly name and unit of a stream indicate a quantity; 0 if they indicate another.

    A unit counts only if no word does: `Beschl. [m/s²]`; a name that is only that of a joint may be a position.
    """
    nothing = Named(0.0, "", stream)
    if what_else(stream.name) or is_load_cell(stream) or not may_be(quantity, stream):
        return nothing
    name = label(stream)
    strength, word = word_for(quantity, name)
    possible = [item for item in QUANTITIES if item != quantity and may_be(item, stream)]
    others = max((word_for(item, name)[0] for item in possible), default=0.0)
    if strength and (strength >= others or word == "drive force"):
        return Named(strength, word, stream)
    if others:
        return nothing
    if quantity_of_unit(stream) == quantity:
        return Named(BY_UNIT, _TOLD_UNIT, stream)
    is_joint = quantity == "position" and stream.width > 2 and is_only_a_joint(name)
    return Named(_BY_JOINT, "joints", stream) if is_joint else nothing


def named_force(stream: Stream) -> Named:
    """Return how strongly a stream's name, topic or unit indicates a measured force."""
    name = label(stream)
    strength, word = word_for("force", full_name(stream))
    if what_else(stream.name) or (word == "wrench" and word_for("torque", name)[0]):
        return Named(0.0, "", stream)  # the torque of a wrench
    if strength:
        return Named(strength, word, stream)
    # An effort in N that is not the drive's is a force: `Effort fermeture (N)`.
    taken = says("twist", name) or any(word_for(item, name)[0] >= BOUND for item in QUANTITIES[1:])
    by_unit = quantity_of_unit(stream) == "force" and not taken
    return Named(BY_UNIT, _TOLD_UNIT, stream) if by_unit else Named(0.0, "", stream)


def full_name(stream: Stream) -> str:
    """Return topic and name of a stream: a load cell may be named in the topic."""
    return f"{stream.topic} {label(stream)}"


def is_load_cell(stream: Stream) -> bool:
    """Whether a stream has the name of a load cell, or a topic that has."""
    return bool(says("load_cell", label(stream)) or says("load_cell", stream.topic))


def is_other(quantity: str, stream: Stream, *, by_letter: bool = False) -> bool:
    """Whether the name of a stream indicates another quantity, or a load cell: no values make it this one.

    `by_letter`: also if only a letter indicates the other quantity.
    """
    name = label(stream)
    if what_else(stream.name) or is_load_cell(stream) or (quantity != "force" and word_for("force", name)[0]):
        return True
    own = word_for(quantity, name)[0]
    others = max(word_for(item, name)[0] for item in QUANTITIES[:-1] if item != quantity)
    return others > own if by_letter else others >= max(BOUND, own)


def sides(stream: Stream) -> set[str]:
    """Return the words of a name for a side of a gear: `motor` of `motor_position`."""
    return {word for word in words(stream.name) if says("gear_side", word)}
