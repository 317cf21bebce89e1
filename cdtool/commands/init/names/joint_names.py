"""Find the joints of a table by the part in which the names of its columns differ: `elbow_joint/position`, `X1_Pos`."""

from __future__ import annotations

import re
from collections.abc import Sequence

from cdtool.commands.init.names.units_in_names import unit_in_name
from cdtool.commands.init.names.words import BOUND, is_actual, says, what_else, word_for, words
from cdtool.formats.column_names import split_unit

# Words and what is between them; a word in mixed case consists of several: `LeftHipAngle`.
_TOKENS = re.compile(r"[^\W_]+?(?:(?<=[a-z])(?=[A-Z][a-z])|(?<=[A-Z]{2})(?=[A-Z][a-z])|(?![^\W_]))|[\W_]+")
_NUMBER = re.compile(r"\d+")
# More numbers are not those of joints but of samples or taxels.
MOST_JOINTS = 64
_QUANTITIES = ("position", "speed", "torque")
Families = dict[str, tuple[tuple[str, ...], tuple[str, ...]]]
_Key = tuple[str, str]


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
    members: dict[_Key, dict[str, str]] = {}
    for name in names:
        for before, slot, after in _slots(split_unit(name)[0]):
            members.setdefault((before, after), {})[slot] = name
    sets: dict[frozenset[str], list[_Key]] = {}
    for key, parts in members.items():
        # A set value or a spindle beside the axes is none of them: `pos_x`, `pos_y`, `pos_sp`.
        joints = frozenset(part for part in parts if not _is_taken(part))
        if 2 <= len(joints) <= MOST_JOINTS:
            sets.setdefault(joints, []).append(key)
    quantities = {joints: [_quantity(*key) for key in keys] for joints, keys in sets.items()}
    usable = [joints for joints in sets if _are_joints(joints, {item for item in quantities[joints] if item})]
    if not usable:
        return {}

    def rank(joints: frozenset[str]) -> tuple[int, int]:
        # With `q_#` more columns have a quantity by what is not the joint's name than with `q_#_hip`.
        return len(joints) * sum(map(bool, quantities[joints])), len(joints) * len(sets[joints])

    chosen = max(usable, key=rank)
    before, after = sets[chosen][0]
    order = [slot for slot in members[before, after] if slot in chosen]
    return {
        f"{first}#{last}": (_joint_names(order, before, after), tuple(parts[slot] for slot in order))
        for (first, last), parts in members.items()
        if chosen <= parts.keys()
    }


def _slots(name: str) -> list[tuple[str, str, str]]:
    """Return every part of a name that may be a joint's, with what is before and after it."""
    tokens = _TOKENS.findall(name)
    found = []
    for first in range(len(tokens)):
        # The name of a joint has at most three words, and what is between them.
        for last in range(first + 1, min(first + 5, len(tokens)) + 1):
            slot = "".join(tokens[first:last])
            if slot[0].isalpha() and slot[-1].isalnum() and last - first < len(tokens):
                found.append(("".join(tokens[:first]), slot, "".join(tokens[last:])))
    return found


def _joint_names(slots: Sequence[str], before: str, after: str) -> tuple[str, ...]:
    """Return the joints' names with what belongs to their word: of `/elbow_joint/effort`, `elbow_joint`."""
    left, right = re.findall(r"\w*$", before)[0], re.findall(r"^\w*", after)[0]
    whole = [f"{left}{slot}{right}".strip("_") for slot in slots]
    return tuple(slots if any(map(_is_taken, whole)) else whole)


def _are_joints(slots: frozenset[str], quantities: set[str]) -> bool:
    tokens = [_TOKENS.findall(slot) for slot in slots]
    if any(len({part[end] for part in tokens}) == 1 for end in (0, -1)):
        return False  # what all have in common belongs to no joint
    if len({_NUMBER.sub("", slot) for slot in slots}) == 1:
        return False  # names that differ only by a number are families of their own
    if all(says("space", slot) and len(words(slot)) == 1 for slot in slots) and "torque" not in quantities:
        return False
    # Of one quantity alone only names of joints are sure.
    return len(quantities) >= 2 or (
        len(quantities) == 1 and all(says("limb", word) for slot in slots for word in words(slot))
    )


def _quantity(before: str, after: str) -> str:
    """Return the quantity that a name indicates without its joint, by a word or a unit: `hipAct_rad_s`; empty if none.

    A letter must stand alone: `hip.q`.
    """
    name = f"{before} {after}"
    if what_else(name):
        return ""
    strengths = {quantity: word_for(quantity, name)[0] for quantity in _QUANTITIES}
    best = max(strengths, key=lambda quantity: strengths[quantity])
    if strengths[best]:
        return best if strengths[best] >= BOUND or len(words(name)) == 1 else ""
    return next((quantity for quantity in _QUANTITIES if len(unit_in_name(quantity, name)) > 1), "")


def _is_taken(slot: str) -> bool:
    """Whether a part of a name is a quantity, a set value, or a side of the gear rather than a joint."""
    parts = words(slot)
    if parts and all(says("version", part) or says("gear_side", part) for part in parts):
        return True
    if says("reference", slot) or is_actual(slot) or what_else(slot):
        return True
    return any(word_for(quantity, slot)[0] >= BOUND for quantity in (*_QUANTITIES, "acceleration", "force", "label"))
