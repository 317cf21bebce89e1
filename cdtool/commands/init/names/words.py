"""Find the words of words.toml in the name of a column: its quantity, set or measured, or none of a joint.

Names are compared in lower case and without accents (`Velocità` is `velocita`, `Türwinkel` is `turwinkel`).
"""

from __future__ import annotations

import re
import tomllib
import unicodedata
from collections.abc import Iterable, Iterator, Mapping
from functools import lru_cache
from importlib.resources import files

_TABLES: Mapping[str, Mapping[str, list[str]]] = tomllib.loads(
    files(__package__).joinpath("words.toml").read_text(encoding="utf-8")
)
_LISTS: Mapping[str, Mapping[str, tuple[str, ...]]] = {
    table: {name: tuple(" ".join(lines).split()) for name, lines in part.items()} for table, part in _TABLES.items()
}
#: How strongly a word indicates a quantity: one that is enough anywhere, one that is bound to ends of words, a letter.
_ANYWHERE, BOUND, _LETTER = 3.0, 2.0, 1.0
QUANTITIES = ("torque", "speed", "position", "acceleration", "force")
_PRESENT = ("current", "curr", "cur")
_OF_EFFORTS = "an external or modelled effort"
_TIME = "a time"
_SPLIT = re.compile(r"[\W\d_]+")
_CAMEL = re.compile(r"(?<=[a-z])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])")
# The last part of a path in quotes, as TDMS files have.
_IN_GROUP = re.compile(r"^/'.*'/'(.*)'$")


@lru_cache(maxsize=4096)
def words(name: str) -> tuple[str, ...]:
    """Return the words of a name, in lower case, without accents and numbers."""
    # Accents only: Japanese voicing marks belong to their letters.
    letters = (letter for letter in unicodedata.normalize("NFKD", name) if not 0x300 <= ord(letter) <= 0x36F)
    plain = unicodedata.normalize("NFC", "".join(letters))
    return tuple(word for word in _SPLIT.split(_CAMEL.sub(" ", plain).lower()) if word)


@lru_cache(maxsize=65536)
def says(group: str, name: str) -> str:
    """Return the first word of a group that a name contains; empty without one."""
    return next(_found(_LISTS["group"][group], name), "")


@lru_cache(maxsize=65536)
def word_for(quantity: str, name: str) -> tuple[float, str]:
    """Return how strongly a name indicates a quantity, and the word that does; 0 and an empty word without one."""
    if quantity == "torque":
        if says("load_cell", name):
            return 0.0, ""
        if says("drive", name) and says("force_of_drive", name):
            return _ANYWHERE, "drive force"
    strengths = [
        (_ANYWHERE if "_" not in word else _LETTER if len(word.strip("_")) == 1 else BOUND, word.strip("_"))
        for word in _found(_LISTS["quantity"][quantity], name)
        if word.strip("_") not in _PRESENT or not _means_present(name)
    ]
    return max(strengths, key=lambda item: item[0], default=(0.0, ""))


def is_current(name: str) -> bool:
    """Whether the name is that of a motor's current; not `current_pos`, the present position."""
    found = [word for word in _found(_LISTS["group"]["current"], name) if word.strip("_") not in _PRESENT]
    return bool(found) or (bool(says("current", name)) and not _means_present(name))


def is_actual(name: str) -> bool:
    """Whether the name is that of a measured value: `actual_q_0`, `Istposition`, `n_act`, `实际位置`."""
    return bool(says("actual", name)) or (any(word in words(name) for word in _PRESENT) and _means_present(name))


def what_else(name: str) -> str:
    """Return what a name indicates instead of a channel: "a temperature"; an empty text if nothing does."""
    channel = name_in_group(name)
    if (
        channel != name
        and says("clock", channel)
        and not any(word_for(item, channel)[0] for item in _LISTS["quantity"])
    ):
        return _TIME
    is_effort = any(word_for(quantity, name)[0] for quantity in ("torque", "force"))
    return next(
        (
            reason
            for reason, listed in _LISTS["other"].items()
            if (reason != _OF_EFFORTS or is_effort) and any(_found(listed, name))
        ),
        "",
    )


def is_one_of_three_axes(name: str, names: Iterable[str]) -> bool:
    """Whether the name ends with an axis of space, and others are those of the other two: `AccX`, `AccY`, `AccZ`."""
    parts = words(name)
    alike = {other[-1] for other in map(words, names) if len(other) > 1 and other[:-1] == parts[:-1]}
    return alike == {"x", "y", "z"} and parts[-1] in alike


def is_counter(name: str) -> bool:
    """Whether the name is that of a counter: `ticks`, `sample_index`; not `sample time`."""
    return bool(says("counter", name)) and "_" in (says("clock", name) or "_")


def is_only_a_joint(name: str) -> bool:
    """Whether a name is only that of a joint, perhaps with a word for a set or measured value: `J#`, `DestJnt J#`."""
    parts = [part for part in words(name) if not (says("reference", part) or is_actual(part) or part in _PRESENT)]
    return bool(parts) and all(says("joint", part) for part in parts)


def motion_of(name: str) -> str:
    """Return "angle" or "length" for a name of a rotation or a travel, else an empty text."""
    return next((kind for kind in ("angle", "length") if says(kind, name)), "")


def name_in_group(name: str) -> str:
    """Return the channel of a path of group and channel, `/'Forza [N]'/'Time'`; any other name as it is."""
    return _IN_GROUP.sub(r"\1", name)


def _found(listed: Iterable[str], name: str) -> Iterator[str]:
    """Yield the words of a list that a name contains, apart from those that are only a part of a longer word."""
    parts = words(name)
    whole, bound = "".join(parts), f"_{'_'.join(parts)}_|"
    for word in listed:
        longer = _LISTS["longer"].get(word, ())
        if word in (bound if "_" in word else whole) and not any(other in whole for other in longer):
            yield word


def _means_present(name: str) -> bool:
    """Whether `current` in a name means the present one: `current_pos`, `CURRENT_FEEDRATE`."""
    parts = words(name)
    if any(word_for(item, part)[0] >= BOUND for item in ("position", "speed", "acceleration") for part in parts):
        return True
    at = next((i for i, part in enumerate(parts) if part in _PRESENT), len(parts))
    return at + 1 < len(parts) and bool(says("present", parts[at + 1]))
