"""The parsed schema of a message: its members in order, their types, and whether they are arrays."""

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
    """A schema cannot be parsed; the message is the reason."""


@dataclass(frozen=True)
class Number:
    """A fixed-width number; `name` is that of ROS 2 (float64, uint8, bool, ...)."""

    name: str

    @property
    def dtype(self) -> str:
        """numpy's code without byte order; a bool is a byte that is not 0."""
        return _NUMBERS[self.name]

    @property
    def size(self) -> int:
        """Size in bytes, which is also the alignment."""
        return int(self.dtype[1])


@dataclass(frozen=True)
class Text:
    """A string; `wide`: of wide characters, whose width depends on the writer."""

    wide: bool = False


@dataclass(frozen=True)
class Message:
    """A nested message; `name` is that of its layout."""

    name: str


@dataclass(frozen=True)
class Array:
    """An array of `length` elements; None: a sequence whose length is given in the message."""

    length: int | None = None


@dataclass(frozen=True)
class Tag:
    """The protobuf tag of a member: its field number, its type, and whether its presence is tracked.

    `wire` is the name of the type in the descriptor (double, sint32, message, group, ...). `presence`: an absent member
    differs from a zero. `oneof` is the index of its oneof, negative if it is in none.
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
    """A message type: its members in schema order; `entry`: it is the entry of a map."""

    name: str
    members: tuple[Member, ...]
    entry: bool = False

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The names of the members."""
        return tuple(member.name for member in self.members)

    def member(self, name: str) -> Member | None:
        """Return the member of this name, if it exists."""
        return next((member for member in self.members if member.name == name), None)


@dataclass(frozen=True, eq=False)
class Schema:
    """All layouts of a schema by name, and the layout of the message itself."""

    root: Layout
    layouts: Mapping[str, Layout]

    def nested(self, kind: Message) -> Layout:
        """Return the layout of a nested message."""
        return self.layouts[kind.name]

    def walk(self) -> Iterator[Member]:
        """Yield every member of the message and of its nested messages, each layout once."""
        seen, waiting = {self.root.name}, [self.root]
        while waiting:
            for member in waiting.pop().members:
                yield member
                if isinstance(member.kind, Message) and member.kind.name not in seen:
                    seen.add(member.kind.name)
                    waiting.append(self.nested(member.kind))
