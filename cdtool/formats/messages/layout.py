"""The parsed schema of a message: its members in order, their types, and whether they are arrays."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

from cdtool.formats.messages.fields import LONGEST_ARRAY, Field, FieldMissingError


class SchemaError(Exception):
    """A schema cannot be parsed; the message is the reason."""


@dataclass(frozen=True)
class Number:
    """A fixed-width number; `code` is numpy's without byte order (`?` is a byte that is not 0)."""

    code: str

    @property
    def size(self) -> int:
        """Size in bytes, which is also the alignment."""
        return 1 if self.code == "?" else int(self.code[1])


@dataclass(frozen=True)
class TextType:
    """A string."""


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
    differs from a zero. `oneof` are the members of which only the last one written counts.
    """

    number: int
    wire: str
    presence: bool
    oneof: tuple[str, ...] = ()


@dataclass(frozen=True)
class Member:
    """One field of a message; `tag` is that of protobuf."""

    name: str
    kind: Number | TextType | Message
    array: Array | None = None
    tag: Tag | None = None


@dataclass(frozen=True)
class Layout:
    """A message type: its members in schema order; `entry`: it is the entry of a map."""

    name: str
    members: tuple[Member, ...]
    entry: bool = False

    @cached_property
    def by_number(self) -> dict[int, Member]:
        """The members by the number of their tag."""
        return {member.tag.number: member for member in self.members if member.tag is not None}


_NO_MEMBERS = Layout("", ())  # of a number or string


@dataclass(frozen=True, eq=False)
class Schema:
    """All layouts of a schema by name, and the layout of the message itself."""

    root: Layout
    layouts: Mapping[str, Layout]

    def missing(self, field: Field) -> FieldMissingError | None:
        """Return why no message can have a field, even if the arrays that lead to it are empty; None if one can."""
        layout, kind = self.root, None
        for name, index in field.steps:
            member = next((member for member in layout.members if member.name == name), None)
            if member is None:
                return FieldMissingError(f"there is no '{name}'", [member.name for member in layout.members])
            if index is not None and member.array is None:
                return FieldMissingError(f"'{name}' is not an array", [name])
            kind = member.kind
            layout = self.layouts[kind.name] if isinstance(kind, Message) else _NO_MEMBERS
        return FieldMissingError(f"'{field.text}' is a string, not a number") if isinstance(kind, TextType) else None

    def numeric_names(self) -> Iterator[str]:
        """Yield every numeric field except the header's stamp, in schema order; arrays only if they may be short."""
        yield from self._names(self.root, "", ())

    def _names(self, layout: Layout, prefix: str, above: tuple[str, ...]) -> Iterator[str]:
        if layout.name in above:  # protobuf messages may contain themselves
            return
        for member in layout.members:
            full = f"{prefix}{member.name}"
            if full == "header.stamp":
                continue
            if isinstance(member.kind, Number):
                if member.array is None:
                    yield full
                elif (member.array.length or 0) <= LONGEST_ARRAY:
                    yield f"{full}[:]"
            elif isinstance(member.kind, Message) and member.array is None:
                yield from self._names(self.layouts[member.kind.name], f"{full}.", (*above, layout.name))
