"""Find the joints of a table by the part in which the names of its columns differ: `elbow_joint/position`, `X1_Pos`."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

from cdtool.commands.init.names.units_in_names import unit_in_name
from cdtool.commands.init.names.words import is_actual, says, what_else, word_for, words
from cdtool.formats.column_names import split_unit

# Words and what is between them; a word in mixed case consists of several: `LeftHipAngle`.
_TOKENS = re.compile(r"[^\W_]+?(?:(?<=[a-z])(?=[A-Z][a-z])|(?<=[A-Z]{2})(?=[A-Z][a-z])|(?![^\W_]))|[\W_]+")
_NUMBER = re.compile(r"\d+")
# The name of a joint consists of at most this many words, with what is between them.
_LONGEST = 5
_MOST_JOINTS = 64
_QUANTITIES = ("position", "speed", "torque")
Families = dict[str, tuple[tuple[str, ...], tuple[str, ...]]]


def families_by_name(names: Sequence[str]) -> Families:
    """Return the families of columns that differ only by the name of a joint, of one set of joints.

    Parameters
    ----------
    names : sequence of str
        All columns of a table, in its order.

    Returns
    -------
    dict
        By the name with ``#`` in place of the joint: the joints, in the order of the table, and the columns of each.
        Empty if the names do not show several joints with at least two measured quantities each, or with one if they
        are joints of a body: `theta_hip`, `theta_knee`.

    Examples
    --------
    >>> families = families_by_name(["pan/position", "pan/effort", "tilt/position", "tilt/effort"])
    >>> families["#/position"]
    (('pan', 'tilt'), ('pan/position', 'tilt/position'))
    """
    members: dict[tuple[str, str], dict[str, str]] = {}
    for name in names:
        for before, slot, after in _slots(split_unit(name)[0]):
            members.setdefault((before, after), {})[slot] = name
    sets: dict[frozenset[str], list[tuple[str, str]]] = {}
    for key, parts in members.items():
        # A set value or a spindle beside the axes is none of them: `pos_x`, `pos_y`, `pos_sp`.
        joints = frozenset(part for part in parts if not _is_taken(part))
        if 2 <= len(joints) <= _MOST_JOINTS:
            sets.setdefault(joints, []).append(key)
    usable = [(slots, keys) for slots, keys in sets.items() if _are_joints(slots, keys)]
    if not usable:
        return {}
    slots, keys = max(usable, key=lambda item: (_measured(*item), len(item[0]) * len(item[1]), sum(map(len, item[0]))))
    order = tuple(slot for slot in members[keys[0]] if slot in slots)
    names_of_joints = _joint_names(order, *keys[0])
    return {
        f"{before}#{after}": (names_of_joints, tuple(parts[slot] for slot in order))
        for (before, after), parts in members.items()
        if slots <= parts.keys()
    }


def _measured(slots: frozenset[str], keys: Sequence[tuple[str, str]]) -> int:
    """Return how many columns have a quantity by what is not the joint's name: with `q_#` more than with `q_#_hip`."""
    return len(slots) * sum(
        any(_indicates(quantity, f"{before} {after}") for quantity in _QUANTITIES) for before, after in keys
    )


def _slots(name: str) -> list[tuple[str, str, str]]:
    """Return every part of a name that may be a joint's, with what is before and after it."""
    tokens = _TOKENS.findall(name)
    found = []
    for first in range(len(tokens)):
        for last in range(first + 1, min(first + _LONGEST, len(tokens)) + 1):
            slot = "".join(tokens[first:last])
            if slot[0].isalpha() and slot[-1].isalnum() and last - first < len(tokens):
                found.append(("".join(tokens[:first]), slot, "".join(tokens[last:])))
    return found


def _joint_names(slots: Sequence[str], before: str, after: str) -> tuple[str, ...]:
    """Return the names of the joints: without what all have in common, then up to the next separator of a path.

    `joint_states/elbow` in `/joint_states/elbow_joint/effort` is `elbow_joint`.
    """
    common, cores, behind = _split(slots)
    before, after = before + common, behind + after
    left, right = re.findall(r"\w*$", before)[0], re.findall(r"^\w*", after)[0]
    for prefix, suffix in ((left, right), (left, "")):
        names = tuple(f"{prefix}{core}{suffix}".strip("_") for core in cores)
        if not any(_is_taken(name) for name in names):
            return names
    return tuple(cores)


def _cores(slots: Iterable[str]) -> list[str]:
    """Return the parts in which names differ: `gear` and `joint` of `field.gear` and `field.joint`."""
    return _split(list(slots))[1]


def _split(slots: Sequence[str]) -> tuple[str, list[str], str]:
    """Return what names begin with, the part of each in which they differ, and what they end with."""
    tokens = [_TOKENS.findall(slot) for slot in slots]
    before = after = ""
    while min(map(len, tokens)) > 1 and len({part[0] for part in tokens}) == 1:
        before += tokens[0][0]
        tokens = [part[1:] for part in tokens]
    while min(map(len, tokens)) > 1 and len({part[-1] for part in tokens}) == 1:
        after = tokens[0][-1] + after
        tokens = [part[:-1] for part in tokens]
    return before, ["".join(part).strip("_ ./:-") for part in tokens], after


def _are_joints(slots: frozenset[str], keys: Sequence[tuple[str, str]]) -> bool:
    if len({_NUMBER.sub("", slot) for slot in slots}) == 1:
        return False  # names that differ only by a number are families of their own
    if any(_is_taken(slot) for slot in (*slots, *_cores(slots))):
        return False
    quantities = {
        quantity for before, after in keys for quantity in _QUANTITIES if _indicates(quantity, f"{before} {after}")
    }
    if all(says("space", slot) and len(words(slot)) == 1 for slot in slots) and "torque" not in quantities:
        return False
    # Of one quantity alone only names of joints are sure.
    known = all(says("limb", word) for core in _cores(slots) for word in words(core))
    return len(quantities) >= 2 or (len(quantities) == 1 and known)


def _indicates(quantity: str, name: str) -> bool:
    """Whether the name of a column without its joint indicates a quantity, by a word or its unit: `hipAct_rad_s`.

    A letter must stand alone: `hip.q`.
    """
    if what_else(name):
        return False
    strengths = {item: word_for(item, name)[0] for item in _QUANTITIES}
    if any(strengths.values()):
        return strengths[quantity] >= 2.0 or (strengths[quantity] > 0.0 and len(words(name)) == 1)
    return len(unit_in_name(quantity, name)) > 1


def _is_taken(slot: str) -> bool:
    """Whether a part of a name is a quantity, a set value, or a side of the gear rather than a joint."""
    parts = words(slot)
    if parts and all(says("version", part) or says("gear_side", part) for part in parts):
        return True
    if says("reference", slot) or is_actual(slot) or what_else(slot):
        return True
    return any(word_for(quantity, slot)[0] >= 2.0 for quantity in (*_QUANTITIES, "acceleration", "force", "label"))
