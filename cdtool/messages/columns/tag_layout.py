"""The row layout of protobuf messages: the wanted tags in ascending order, learned from one message.

Numbers of varying size, absent zeros and other tags may differ between messages; the lengths of arrays and the names of
their elements may not (tag_row_kernel.py).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from cdtool.messages.columns import tag_row_kernel as kernel
from cdtool.messages.columns.field_values import FieldPlan, select_elements
from cdtool.messages.columns.member_locations import MemberPath
from cdtool.messages.columns.tag_row_kernel import (
    AFTER,
    ARRAY,
    BOOL,
    CONTENT,
    DEEPEST,
    DOUBLE,
    INT32,
    INT64,
    KEY,
    LITERAL,
    MESSAGE,
    OPTIONAL,
    SINGLE,
    SINT32,
    SINT64,
    SIZE,
    STRING,
    TOKEN,
    TYPE,
    UINT32,
    UINT64,
    VALUE,
)
from cdtool.messages.fast_path import FieldOffsets, StampValues, TokenLayout, TokenTemplate
from cdtool.messages.layouts.layout import Layout, Member, Message, Schema, Text

_MOST_VALUES = 1024  # of one message
_MOST_NAMES = 256
_VARINT, _EIGHT, _LENGTH, _FOUR = 0, 1, 2, 5  # wire types
_FIXED = {
    "double": (_EIGHT, DOUBLE),
    "fixed64": (_EIGHT, UINT64),
    "sfixed64": (_EIGHT, INT64),
    "float": (_FOUR, SINGLE),
    "fixed32": (_FOUR, UINT32),
    "sfixed32": (_FOUR, INT32),
}
_VARINTS = {
    "int32": INT32,
    "enum": INT32,
    "uint32": UINT32,
    "int64": INT64,
    "uint64": UINT64,
    "bool": BOOL,
    "sint32": SINT32,
    "sint64": SINT64,
}


@dataclass(frozen=True)
class ExampleMessage:
    """What a layout is learned from: the number of elements of each array, and the names of elements, by path."""

    counts: Mapping[MemberPath, int]
    names: Mapping[MemberPath, tuple[str, ...]]


def tag_layout(
    schema: Schema,
    example: ExampleMessage,
    plans: Sequence[FieldPlan],
    joints: Sequence[str],
    stamp: tuple[MemberPath, ...],
) -> TokenLayout | None:
    """Return the row layout of the fields and of a header stamp at the paths `stamp`; None if one has no tokens."""
    if any(plan.arrays for plan in plans):
        return None
    paths = dict.fromkeys((*(path for plan in plans for path in plan.paths), *stamp))
    tokens = _Tokens(example)
    if not tokens.add_message(schema, schema.root, (), tuple(paths), 1) or tokens.count > _MOST_VALUES:
        return None
    fields = []
    for plan in plans:
        count = example.counts[plan.path]
        names = () if plan.names is None else example.names[plan.names]
        elements = select_elements(plan, count, names, joints)
        if elements is None:
            return None
        chosen = tokens.first[plan.path] + np.arange(count)[elements]
        # Whether a number was rounded is checked in the column, as for messages that are decoded one by one.
        fields.append(FieldOffsets(tuple(chosen.ravel().tolist()), "f8", single=chosen.ndim == 0, exact=False))
    literals = np.frombuffer(bytes(tokens.literals), np.uint8)
    table = np.array(tokens.rows, np.int64).reshape(-1, TOKEN)
    template = TokenTemplate(table, literals, tokens.count, tagged=True)
    return TokenLayout(template, tuple(fields), StampValues(*(tokens.first[path] for path in stamp)) if stamp else None)


@dataclass
class _Tokens:
    """The tokens of the wanted members, depth first; `first` are the indices of their first values, by path."""

    example: ExampleMessage
    rows: list[list[int]] = field(default_factory=list)
    literals: bytearray = field(default_factory=bytearray)
    first: dict[MemberPath, int] = field(default_factory=dict)
    count: int = 0

    def add_message(
        self, schema: Schema, layout: Layout, above: MemberPath, paths: tuple[MemberPath, ...], depth: int
    ) -> bool:
        """Add the members of a message that `paths` contain; return False if one has no tokens."""
        names = {path[len(above)] for path in paths}
        members = [member for member in layout.members if member.name in names]
        if len(members) < len(names) or depth >= DEEPEST:
            return False
        return all(
            self._add(schema, member, (*above, member.name), paths, depth)
            for member in sorted(members, key=lambda member: member.tag.number if member.tag is not None else 0)
        )

    def _add(self, schema: Schema, member: Member, path: MemberPath, paths: tuple[MemberPath, ...], depth: int) -> bool:
        within = tuple(each for each in paths if each[: len(path)] == path)
        if member.tag is None or member.tag.oneof >= 0:
            return False
        if isinstance(member.kind, Message):
            if member.array is not None or path in within or member.tag.wire == "group":
                return False
            row = self._row(member.tag.number, _LENGTH, MESSAGE)
            complete = self.add_message(schema, schema.nested(member.kind), path, within, depth + 1)
            row[AFTER] = len(self.rows)
            return complete
        if isinstance(member.kind, Text):
            return self._add_names(member.tag.number, self.example.names[path])
        return self._add_numbers(member, path)

    def _add_names(self, number: int, names: tuple[str, ...]) -> bool:
        for name in names:
            row = self._row(number, _LENGTH, STRING)
            row[LITERAL], row[SIZE] = len(self.literals), len(name.encode())
            self.literals += name.encode()
        return 0 < len(names) <= _MOST_NAMES

    def _add_numbers(self, member: Member, path: MemberPath) -> bool:
        assert member.tag is not None
        count, tag = self.example.counts[path], member.tag
        wire, kind = _FIXED.get(tag.wire) or (_VARINT, _VARINTS.get(tag.wire, -1))
        if kind < 0 or count <= 0 or self.count + count > _MOST_VALUES:
            return False
        self.first[path] = self.count
        if member.array is None:
            row = self._row(tag.number, wire, kernel.NUMBER)
            row[OPTIONAL] = not tag.presence
        elif wire == _VARINT:
            return False
        else:
            row = self._row(tag.number, _LENGTH, ARRAY)
            row[SIZE] = count * (8 if wire == _EIGHT else 4)
        row[VALUE], row[TYPE] = self.count, kind
        self.count += count
        return True

    def _row(self, number: int, wire: int, content: int) -> list[int]:
        row = [0] * TOKEN
        row[KEY], row[CONTENT], row[AFTER] = number << 3 | wire, content, len(self.rows) + 1
        self.rows.append(row)
        return row
