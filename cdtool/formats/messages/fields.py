"""The field language: `data`, `wrench.force.z`, `position[0]`, `position[:]`, `position[shoulder_joint]`."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from cdtool.base.errors import RecordingError, nearest

_STEP = re.compile(r"(?P<name>[^.\[\]]+)(?:\[(?P<index>[^\[\]]*)\])?")
LONGEST_ARRAY = 16  # a survey lists only arrays up to this length
STAMPS = (("sec", "nanosec"), ("sec", "nsec"), ("secs", "nsecs"))  # members of a header stamp: ROS 2, Gazebo, ROS 1

Value = float | Sequence[float] | None
# In place of a nested message that is not there: all its numbers are NaN.
NO_MESSAGE = object()


class FieldMissingError(Exception):
    """The message has no such field; `known` are the members at this level, `advice` is the next step."""

    def __init__(self, problem: str, known: Sequence[str] = (), advice: str = "") -> None:
        super().__init__(problem)
        self.problem = problem
        self.known = tuple(known)
        self.advice = advice


@dataclass(frozen=True)
class Field:
    """A parsed field of the field language.

    A whole array (`[:]`) whose elements are named is returned in the order of `joints`.
    """

    text: str
    steps: tuple[tuple[str, str | None], ...]

    @property
    def whole(self) -> bool:
        """True if the field is a whole array."""
        return any(index == ":" for _, index in self.steps)

    def of(self, message: Any, joints: Sequence[str] = ()) -> Value:
        """Return the field's value in one message: a number, or a list for a whole array.

        An element of an empty array is NaN; an element whose name the message does not list is None. Raises
        FieldMissingError.
        """
        value = message
        for name, index in self.steps:
            parent = value
            if parent is NO_MESSAGE:
                return [] if self.whole else math.nan
            value = _member(parent, name)
            if index is None:
                continue
            if not _is_array(value):
                raise FieldMissingError(f"'{name}' is not an array", [name])
            if index == ":":
                return self._in_order(value, element_names(parent), joints)
            element = _element_number(index, name, value, parent)
            if element is None:
                return None
            if element >= len(value):
                return math.nan
            value = value[element]
        if _is_array(value):
            raise FieldMissingError(f"'{self.text}' is an array", [f"{self.text}[0]", f"{self.text}[:]"])
        return math.nan if value is NO_MESSAGE else _number(value, self.text)

    def _in_order(self, array: Any, names: Sequence[str], joints: Sequence[str]) -> Sequence[float]:
        """Return a whole array's numbers, in the order of the joints if its elements are named."""
        # A range stands for the numbers of a message with its layout: those of an image are not listed.
        plain = isinstance(array, range) or {*map(type, array)} == {float}  # much quicker for long arrays
        numbers = array if plain else [_number(item, self.text) for item in array]
        order = joint_order(len(numbers), names, joints)
        return numbers if order is None else [numbers[element] for element in order]


def _element_number(index: str, name: str, array: Any, parent: Any) -> int | None:
    """Return the number of the element that an index selects by number or name; None if no element has the name.

    The number may lie beyond the end of an empty array, or of one with more names than numbers: its value is NaN.
    """
    if is_element_number(index):
        if 0 < len(array) <= int(index):
            raise FieldMissingError(f"'{name}' has {len(array)} elements", [f"{name}[0] to {name}[{len(array) - 1}]"])
        return int(index)
    if not _is_array(_member(parent, "name")):
        raise FieldMissingError("'name' is not an array", ["name"])
    names = element_names(parent)
    return names.index(index) if index in names else None


def is_element_number(index: str) -> bool:
    """Return True if an index is an element's number; any other index is a name, including \u00b2."""
    return index.isascii() and index.isdigit()


def parse_field(text: str, where: str) -> Field:
    """Return the parsed field of a machine file; raises RecordingError if its syntax is wrong."""
    steps = []
    for part in re.split(r"\.(?![^\[]*\])", text):
        match = _STEP.fullmatch(part)
        if match is None or match["index"] == "":
            raise RecordingError(
                f"{where}: field '{text}' cannot be understood",
                "give a field such as data, wrench.force.z, position[0], position[:] or position[joint_name]",
            )
        steps.append((match["name"], match["index"]))
    return Field(text, tuple(steps))


def numeric_fields(message: Any, prefix: str = "") -> dict[str, float | list[float]]:
    """Return every numeric field of a message except the header stamp; arrays as `name[:]`, cut after 17 numbers."""
    found: dict[str, float | list[float]] = {}
    for name in _member_names(message):
        value = _member(message, name)
        full = f"{prefix}{name}"
        if full == "header.stamp":
            continue
        if _is_array(value):
            if all(_is_number(item) for item in value[: LONGEST_ARRAY + 1]):  # longer ones are only named
                found[f"{full}[:]"] = [_float(item) for item in value[: LONGEST_ARRAY + 1]]
        elif _is_number(value):
            found[full] = _float(value)
        elif _member_names(value):
            found.update(numeric_fields(value, f"{full}."))
    return found


def stamp_parts(message: Any) -> tuple[Any, Any] | None:
    """Return seconds and nanoseconds of the header's time stamp; None if the message has no header stamp."""
    try:
        stamp = _member(_member(message, "header"), "stamp")
    except FieldMissingError:
        return None
    for seconds, nanoseconds in STAMPS:
        names = _member_names(stamp)
        if seconds in names and nanoseconds in names:
            return _member(stamp, seconds), _member(stamp, nanoseconds)
    return None


def missing_field(where: str, text: str, fault: FieldMissingError) -> RecordingError:
    """Return the error for a missing field, with the nearest known fields."""
    return RecordingError(f"{where}: no field '{text}': {fault.problem}", fault.advice or nearest(text, fault.known))


def element_names(message: Any) -> list[str]:
    """Return the texts of the array `name`, which name the elements of the arrays next to it."""
    names = _member(message, "name") if "name" in _member_names(message) else ()
    return [str(name) for name in names] if _is_array(names) else []


def joint_order(count: int, names: Sequence[str], joints: Sequence[str]) -> list[int] | None:
    """Return the element numbers of the joints, in joint order, among `count` elements with `names`.

    None means that the order stays as it is: the message does not name its elements, or there are no joint names.
    Raises FieldMissingError.
    """
    if not joints or not count or not names:
        return None
    if len(names) != count:
        raise FieldMissingError(
            f"its messages have {len(names)} names for {count} elements, so the names cannot be assigned",
            advice="select elements by number, e.g. position[0]",
        )
    numbers = {name: number for number, name in reversed(list(enumerate(names)))}  # of equal names the first
    absent = [joint for joint in joints if joint not in numbers]
    if absent:
        raise FieldMissingError(
            f"its messages name {', '.join(names)}, not '{absent[0]}' of machine.joints",
            advice="name machine.joints as the log does (a URDF's other names go into machine.joint_map)",
        )
    return [numbers[joint] for joint in joints]


def _member(value: Any, name: str) -> Any:
    known = _member_names(value)
    if name not in known:
        raise FieldMissingError(f"there is no '{name}'", known)
    return value[name]


def _member_names(value: Any) -> list[str]:
    return list(value) if isinstance(value, dict) else []


def _is_array(value: Any) -> bool:
    return hasattr(value, "__len__") and hasattr(value, "__getitem__") and not isinstance(value, str | dict)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float)


def _number(value: Any, text: str) -> float:
    if value is None:  # JSON's null
        return math.nan
    if isinstance(value, dict):
        known = [f"{text}.{name}" for name in _member_names(value)]
        raise FieldMissingError(f"'{text}' has members, it is not a number", known)
    if not _is_number(value):
        raise FieldMissingError(f"'{text}' contains {str(value)[:40]!r}, not a number")
    return _float(value)


def _float(value: float) -> float:
    try:
        return float(value)
    except OverflowError:  # an int larger than any float64
        return math.inf if value > 0 else -math.inf
