"""Guess the quantity of a column from its name, by the words of the lexicon.

Names are compared in lower case and without accents (`Velocità` is `velocita`, `Türwinkel` is `turwinkel`).
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable
from functools import lru_cache

from cdtool.commands.init.names import lexicon

_STRONG, _WEAK = 3.0, 2.0
_LETTERS = 2  # a one-letter word is weak evidence
# `current` and its short forms, which may mean the present one: before a noun for the joints, for example.
_PRESENTS, _JOINT_NOUNS = ("current", "cur", "curr"), ("jnt", "joints")
_BEFORE_D = ("q", "dq", "ddq", "j", "tau", "theta", "x", "pos", "vel")
_SPLIT = re.compile(r"[\W\d_]+")
# The last part of a path in quotes, as TDMS files have.
_IN_GROUP = re.compile(r"^/'.*'/'(.*)'$")
_CAMEL = re.compile(r"(?<=[a-z])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])")


def words(name: str) -> list[str]:
    """Return the words of a name, in lower case, without accents and numbers."""
    return list(_words(name))


@lru_cache(maxsize=4096)
def _words(name: str) -> tuple[str, ...]:
    plain = "".join(
        letter for letter in unicodedata.normalize("NFKD", name) if not 0x300 <= ord(letter) <= 0x36F
    )  # accents only: Japanese voicing marks belong to their letters
    plain = unicodedata.normalize("NFC", plain)
    return tuple(word for word in _SPLIT.split(_CAMEL.sub(" ", plain).lower()) if word)


def is_reference(name: str) -> bool:
    """Whether the name is that of a set value: `n_ref`, `target_q_0`, `Solldrehzahl`, `tau_J_d`, `指令位置`."""
    parts = words(name)
    whole = "".join(parts)
    if any(long in whole for long in lexicon.REFERENCE_LONG) or any(part in lexicon.REFERENCE_SHORT for part in parts):
        return True
    if any(_is_joined(part, lexicon.REFERENCE_STARTS) for part in parts):
        return True
    # A d at the end stands for "desired", except after a current or voltage: the direct axis.
    return len(parts) > 1 and parts[-1] == "d" and parts[-2] in _BEFORE_D


def is_actual(name: str) -> bool:
    """Whether the name is that of a measured value: `actual_q_0`, `Istposition`, `n_act`, `实际位置`."""
    parts = words(name)
    if any(long in "".join(parts) for long in lexicon.ACTUAL_LONG) or (
        any(part in _PRESENTS for part in parts) and _is_adjective(parts)
    ):
        return True
    if any(_is_joined(part, lexicon.ACTUAL_STARTS) for part in parts):
        return True
    return any(part.startswith("ist") or part.endswith("istwert") or part in lexicon.ACTUAL_SHORT for part in parts)


def is_load_cell(name: str) -> bool:
    """Whether the name is that of a load cell or force sensor: ground truth, never an input of a detector."""
    parts = words(name)
    if any(long in "".join(parts) for long in lexicon.LOAD_CELL) or "dms" in parts:
        return True
    return "cell" in parts and all(part in ("cell", *lexicon.LONG["force"], *lexicon.SHORT["force"]) for part in parts)


def is_something_else(name: str) -> bool:
    """Whether the name cannot be a joint's channel: a tool's pose, a temperature, a covariance, a following error."""
    return what_else(name) != ""


@lru_cache(maxsize=4096)
def what_else(name: str) -> str:
    """Return what a name indicates instead of a channel: "a temperature"; an empty text if nothing does."""
    channel = name_in_group(name)
    if channel != name and is_clock(channel) and not any(word_for(quantity, channel)[0] for quantity in lexicon.LONG):
        return "a time"
    joined = "_".join(words(name))
    return next((reason for reason, pattern in lexicon.OTHERS if pattern.search(joined)), "")


def contact_pressure_word(name: str) -> str:
    """Return the word of a name for the pressure of a contact; empty for any other pressure, as of oil."""
    whole = "".join(words(name))
    return next((word for word in lexicon.CONTACT_PRESSURES if word in whole), "")


def is_of_body(name: str) -> bool:
    """Whether the name is that of an inertial sensor: it turns and accelerates with a body, not with one joint."""
    return any(part in lexicon.INERTIAL for part in words(name))


def side_of_gear(name: str) -> frozenset[str]:
    """Return the words of a name for a side of a gear: `motor` of `motor_position`."""
    return frozenset(words(name)).intersection(lexicon.GEAR_SIDES)


def is_twist(name: str) -> bool:
    """Whether the name is that of an effort of a rotation: `torque`, `Drehmoment`; not `effort`, `current`."""
    found = word_for("torque", name)[1]
    return found in lexicon.TWISTS or found in ("tau", "trq", "torq", "tq")


def is_one_of_three_axes(name: str, names: Iterable[str]) -> bool:
    """Whether the name ends with an axis of space, and others are those of the other two: `AccX`, `AccY`, `AccZ`."""
    parts = _words(name)
    if parts[-1:] not in (("x",), ("y",), ("z",)) or len(parts) < 2:
        return False
    return {other[-1] for other in map(_words, names) if other[:-1] == parts[:-1]} == {"x", "y", "z"}


def without_kind(name: str) -> frozenset[str]:
    """Return the words of a name that state neither a quantity nor whether it is measured: `hip` of `HipAngle`."""
    return frozenset(
        part
        for part in words(name)
        if len(part) > _LETTERS
        and not any(word_for(quantity, part)[0] for quantity in lexicon.LONG)
        and not is_reference(part)
        and not is_actual(part)
        and part not in lexicon.SIDES
    )


def name_in_group(name: str) -> str:
    """Return the channel of a path of group and channel, `/'Forza [N]'/'Time'`; any other name as it is."""
    return _IN_GROUP.sub(r"\1", name)


def is_clock(name: str) -> bool:
    """Whether the name is that of a time: `Zeit`, `LogTime`, `timestamp`, `t`, `temps`, `时间`."""
    parts = words(name)
    return lexicon.CLOCKS.search("".join(parts)) is not None or any(part in lexicon.CLOCKS_SHORT for part in parts)


def is_counter(name: str) -> bool:
    """Whether the name is that of a counter: `ticks`, `sample_index`; not `sample time`."""
    whole = "".join(words(name))
    return any(word in whole for word in lexicon.COUNTERS) and not lexicon.CLOCKS.search(whole)


def is_only_a_joint(name: str) -> bool:
    """Whether a name is only that of a joint, perhaps with a word for a set or measured value: `J#`, `DestJnt J#`."""
    others = (*lexicon.REFERENCE_SHORT, *lexicon.REFERENCE_LONG, *lexicon.ACTUAL_SHORT, *lexicon.ACTUAL_LONG)
    parts = [part for part in words(name) if part not in others and part not in _PRESENTS]
    return bool(parts) and all(part in lexicon.JOINTS for part in parts)


def motion_of(name: str) -> str:
    """Return "angle" or "length" for a name of a rotation or a travel, else an empty text."""
    parts = words(name)
    if any(long in "".join(parts) for long in lexicon.ANGLES) or any(part in lexicon.ANGLES_SHORT for part in parts):
        return "angle"
    if any(long in "".join(parts) for long in lexicon.LENGTHS) or any(part in lexicon.LENGTHS_SHORT for part in parts):
        return "length"
    return ""


def is_current(name: str) -> bool:
    """Whether the name is that of a motor's current; not `current_pos`, the present position."""
    parts = words(name)
    whole = "".join(parts)
    if any(part in lexicon.CURRENTS_SHORT and not (part in _PRESENTS and _is_adjective(parts)) for part in parts):
        return True
    if any(long in whole for long in lexicon.CURRENTS):
        return True
    return "current" in whole and not _is_adjective(parts)


def word_for(quantity: str, name: str) -> tuple[float, str]:
    """Return how strongly a name indicates a quantity, and the word that does; 0 and an empty word without one."""
    parts = words(name)
    whole = "".join(parts)
    if quantity == "torque" and is_load_cell(name):
        return 0.0, ""
    if (
        quantity == "torque"
        and any(word in whole for word in lexicon.DRIVES)
        and any(word in whole for word in lexicon.FORCES)
    ):
        return _STRONG, "drive force"
    for long in lexicon.LONG[quantity]:
        if long in whole and not _is_part_of_another(long, whole):
            if long == "current" and _is_adjective(parts):
                continue
            return _STRONG, long
    for part in parts:
        if part in lexicon.SHORT[quantity] and not (part in _PRESENTS and _is_adjective(parts)):
            return (_WEAK if len(part) >= _LETTERS else _WEAK - 1.0), part
    for ending in lexicon.ENDINGS.get(quantity, ()):
        if any(part.endswith(ending) and part != ending and not _is_part_of_another(ending, part) for part in parts):
            return _WEAK, ending
    return 0.0, ""


def _is_joined(part: str, starts: tuple[str, ...]) -> bool:
    """Whether a word is one of these and a quantity written together: `setpos`, `actvelo`."""
    return any(
        part == start + ending for start in starts for endings in lexicon.ENDINGS.values() for ending in endings
    )  # only whole words: `actuator` is no measured value


def _is_part_of_another(word: str, whole: str) -> bool:
    """Whether a word is only part of another quantity's: 力 in 力矩, 速度 in 加速度."""
    return any(other in whole for other in lexicon.LONGER.get(word, ()))


def _is_adjective(parts: list[str]) -> bool:
    """Whether `current` in a name means the present one: `current_pos`, `CURRENT_FEEDRATE`."""
    others = [
        part
        for quantity in ("position", "speed", "acceleration")
        for part in parts
        if (part in lexicon.SHORT[quantity] and len(part) >= _LETTERS)
        or any(long in part for long in lexicon.LONG[quantity])
    ]
    if others:
        return True
    at = next((i for i, part in enumerate(parts) if part in _PRESENTS), len(parts))
    return at + 1 < len(parts) and parts[at + 1] in (*lexicon.PRESENT, *lexicon.PRESENT_EFFORTS, *_JOINT_NOUNS)
