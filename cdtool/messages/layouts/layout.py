"""What a schema says about a message: its members in order, their types, and whether they are arrays."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

_NUMBERS = {
    "bool": "u1",
    "int8": "i1",
    "uint8": "u1",
    "int16": "i2",
    "uint16": "u2",
    "int32": "i4",
    "uint32": "u4",
    "int64": "i8",
    "uint64": "u8",
    "float32": "f4",
    "float64": "f8",
}


class SchemaError(Exception):
    """A schema cannot be understood; says why."""


@dataclass(frozen=True)
class Number:
    """A number of a fixed width: `name` as in ROS 2 (float64, uint8, bool, ...)."""

    name: str

    @property
    def dtype(self) -> str:
        """numpy's code without byte order; a bool is a byte that is not 0."""
        return _NUMBERS[self.name]

    @property
    def size(self) -> int:
        """Bytes, which is its alignment too."""
        return int(self.dtype[1])


@dataclass(frozen=True)
class Text:
    """A string; `wide`: of wide characters, whose width depends on who wrote it."""

    wide: bool = False


@dataclass(frozen=True)
class Message:
    """A nested message, by the name of its layout."""

    name: str


@dataclass(frozen=True)
class Array:
    """An array of `length` elements, or where that is None a sequence with its length in the message."""

    length: int | None = None


@dataclass(frozen=True)
class Tag:
    """What protobuf says of a member: its number, how it is written, whether its absence can be told from zero.

    `wire` is the type's name in the descriptor (double, sint32, message, group, ...); `oneof` < 0: of none.
    """

    number: int
    wire: str
    presence: bool
    oneof: int = -1


@dataclass(frozen=True)
class Member:
    """One field of a message."""

    name: str
    kind: Number | Text | Message
    array: Array | None = None
    tag: Tag | None = None


@dataclass(frozen=True)
class Layout:
    """A message type: its members in the order of the schema; `entry`: that of a map."""

    name: str
    members: tuple[Member, ...]
    entry: bool = False

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The members' names."""
        return tuple(member.name for member in self.members)

    def member(self, name: str) -> Member | None:
        """The member of that name."""
        return next((member for member in self.members if member.name == name), None)


@dataclass(frozen=True)
class Schema:
    """All layouts of a schema by name, and which is the message's own."""

    root: Layout
    layouts: Mapping[str, Layout]

    def nested(self, kind: Message) -> Layout:
        """The layout of a nested message."""
        return self.layouts[kind.name]

    def walk(self) -> Iterator[Member]:
        """Every member of the message and of all that it nests, each layout once."""
        seen, waiting = {self.root.name}, [self.root]
        while waiting:
            for member in waiting.pop().members:
                yield member
                if isinstance(member.kind, Message) and member.kind.name not in seen:
                    seen.add(member.kind.name)
                    waiting.append(self.nested(member.kind))
