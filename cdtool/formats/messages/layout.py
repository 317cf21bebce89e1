"""The parsed schema of a message: its members in order, their types, and whether they are arrays."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from cdtool.formats.messages.fields import Field, FieldMissingError

TEXT = "text"  # the kind of a string


class SchemaError(Exception):
    """A schema cannot be parsed; the message is the reason."""


@dataclass(frozen=True)
class Member:
    """One field of a message.

    `kind` is numpy's code of a number without byte order (`?` is a byte that is not 0), TEXT, or the layout of a nested
    message. `length` is that of an array (None: stated in each message). `descriptor` is protobuf's of the field.
    """

    name: str
    kind: str | Layout
    array: bool = False
    length: int | None = None
    descriptor: Any = None

    @property
    def is_number(self) -> bool:
        """Return whether it is a number or an array of numbers."""
        return isinstance(self.kind, str) and self.kind != TEXT


@dataclass(eq=False)
class Layout:
    """A message type: its members in schema order; `is_entry`: it is the entry of a map."""

    name: str
    members: list[Member] = field(default_factory=list, repr=False)
    is_entry: bool = False

    @cached_property
    def by_name(self) -> dict[str, Member]:
        """The members by name."""
        return {member.name: member for member in self.members}

    @cached_property
    def by_number(self) -> dict[int, Member]:
        """The members by their numbers in protobuf."""
        return {member.descriptor.number: member for member in self.members}

    def alternatives(self, member: Member) -> list[Member]:
        """Return the other members of its `oneof`, of which only the last one written counts."""
        oneof = member.descriptor.containing_oneof
        return [self.by_name[other.name] for other in (oneof.fields if oneof else ()) if other.name != member.name]

    def missing(self, field: Field) -> FieldMissingError | None:
        """Return why no message can have a field, even if the arrays that lead to it are empty; None if one can."""
        kind: str | Layout = self
        for name, index in field.steps:
            members = kind.by_name if isinstance(kind, Layout) else {}
            if name not in members:
                return FieldMissingError(f"there is no '{name}'", list(members))
            if index is not None and not members[name].array:
                return FieldMissingError(f"'{name}' is not an array", [name])
            kind = members[name].kind
        return FieldMissingError(f"'{field.text}' is a string, not a number") if kind == TEXT else None

    def numeric_names(self, prefix: str = "", above: tuple[Layout, ...] = ()) -> Iterator[str]:
        """Yield every numeric field except the header's stamp, in schema order; arrays as `name[:]`."""
        if self in above:  # protobuf messages may contain themselves
            return
        for member in self.members:
            full = f"{prefix}{member.name}"
            if full == "header.stamp":
                continue
            if member.is_number:
                yield f"{full}[:]" if member.array else full
            elif isinstance(member.kind, Layout) and not member.array:
                yield from member.kind.numeric_names(f"{full}.", (*above, self))
