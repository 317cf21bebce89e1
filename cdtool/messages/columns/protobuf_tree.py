"""Schema -> the tags that are looked for in its messages (protobuf_kernel.py)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cdtool.messages.columns import protobuf_kernel as kernel
from cdtool.messages.columns.gathered import IntArray, UndecodableError
from cdtool.messages.columns.slots import Place
from cdtool.messages.layouts.layout import Layout, Member, Message, Number, Schema

_MOST_TAGS = 20_000
# Fixed-width numbers: what the kernel calls them, and their type.
FIXED = {
    "double": (kernel.EIGHT, "<f8"),
    "fixed64": (kernel.EIGHT, "<u8"),
    "sfixed64": (kernel.EIGHT, "<i8"),
    "float": (kernel.FOUR, "<f4"),
    "fixed32": (kernel.FOUR, "<u4"),
    "sfixed32": (kernel.FOUR, "<i4"),
}


@dataclass(frozen=True)
class TagTree:
    """The kernel's `nodes` and `tags`; for each place its slot, the node that holds it, and if its absence means 0."""

    nodes: IntArray
    tags: IntArray
    oneofs: int
    places: dict[Place, tuple[int, int, Member]]


def tag_tree(schema: Schema, places: tuple[Place, ...]) -> TagTree:
    """The tags that find `places` in a message of `schema`; raises UndecodableError where there are too many."""
    return _Builder(schema, places).tree()


class _Builder:
    """Nodes in the order of a walk from the top, so that all that a tag nests lies side by side."""

    def __init__(self, schema: Schema, places: tuple[Place, ...]) -> None:
        self.schema = schema
        self.places: dict[Place, tuple[int, int, Member]] = {}
        self.rows: list[list[list[int]]] = []
        self.oneofs = 0
        self.slots = 0
        self.message(schema.root, (), places)

    def tree(self) -> TagTree:
        """The tree as arrays."""
        tags = [row for rows in self.rows for row in rows]
        if len(tags) > _MOST_TAGS:
            raise UndecodableError(f"schema '{self.schema.root.name}' is too large")
        lasts = np.cumsum([len(rows) for rows in self.rows])
        nodes = np.column_stack([np.concatenate([[0], lasts[:-1]]), lasts]).astype(np.int64)
        table = np.array(tags, dtype=np.int64).reshape(-1, kernel.COLUMNS)
        return TagTree(nodes, table, self.oneofs, self.places)

    def message(self, layout: Layout, above: Place, wanted: tuple[Place, ...]) -> int:
        """Add a node for a message; `wanted` are the places within it."""
        node = len(self.rows)
        rows: list[list[int]] = []
        self.rows.append(rows)
        known: dict[int, int] = {}
        oneofs = {member.tag.oneof for member in layout.members if member.tag and _within(above, member, wanted)} - {-1}
        for oneof in sorted(oneofs):
            known[oneof] = self.oneofs
            self.oneofs += 1
        for member in layout.members:
            if member.tag is not None:
                self.member(member, node, rows, above, wanted, known.get(member.tag.oneof, -1))
        return node

    def member(
        self, member: Member, node: int, rows: list[list[int]], above: Place, wanted: tuple[Place, ...], oneof: int
    ) -> None:
        tag, place = member.tag, (*above, member.name)
        mine = _within(above, member, wanted)
        if tag is None or (not mine and oneof < 0):
            return
        if not mine:
            self.add(rows, tag.number, kernel.UNWANTED, oneof=oneof)
        for _ in (each for each in mine if each == place):
            holds = kernel.COUNT if isinstance(member.kind, Message) else kernel.TEXTS
            if isinstance(member.kind, Number):
                wire, _ = FIXED.get(tag.wire, (kernel.VARINT, ""))
                holds = wire + (0 if member.array is None else kernel.REPEATED)
            slot = self.slots
            self.slots += 1
            self.places[place] = (slot, node, member)
            self.add(rows, tag.number, holds, slot, oneof=oneof)
        if not isinstance(member.kind, Message):
            return
        depth = len(place)
        elements = {each[depth] for each in mine if len(each) > depth and member.array is not None}
        for element in sorted(elements, key=str) if member.array is not None else [None]:
            inner = place if element is None else (*place, element)
            within = tuple(each for each in mine if len(each) > len(inner) and each[: len(inner)] == inner)
            if not within:
                continue
            row = self.add(rows, tag.number, kernel.GROUP if tag.wire == "group" else kernel.MESSAGE, oneof=oneof)
            row[kernel.ELEMENT] = -1 if element is None else int(element)
            row[kernel.FIRST_SLOT], row[kernel.FIRST_NODE] = self.slots, len(self.rows)
            row[kernel.NODE] = self.message(self.schema.nested(member.kind), inner, within)
            row[kernel.LAST_SLOT], row[kernel.LAST_NODE] = self.slots, len(self.rows)

    def add(self, rows: list[list[int]], number: int, holds: int, slot: int = -1, oneof: int = -1) -> list[int]:
        row = [number, holds, slot, -1, -1, oneof, max(slot, 0), slot + 1 if slot >= 0 else 0, 0, 0]
        rows.append(row)
        return row


def _within(above: Place, member: Member, wanted: tuple[Place, ...]) -> tuple[Place, ...]:
    here = (*above, member.name)
    return tuple(place for place in wanted if place[: len(here)] == here)
