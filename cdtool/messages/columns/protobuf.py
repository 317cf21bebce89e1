"""protobuf messages (MCAP, "Well-known message encodings"; protobuf.dev, "Encoding" and "Field Presence").

A number that is not written is 0 where the schema cannot tell its absence from zero (proto3, neither `optional` nor in
a `oneof`), provided that the message which holds it is there; else it is NaN: an `optional` field, a member of a
`oneof` that is not the chosen one, any of proto2, and all of a nested message that is absent. A wanted field written as
another type, a field cut off and a varint without an end damage the message. An int64 or uint64 beyond 2^53 is rounded
to the nearest float64.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from cdtool.messages.batch import Batch
from cdtool.messages.columns import protobuf_kernel as kernel
from cdtool.messages.columns.gathered import ByteArray
from cdtool.messages.columns.protobuf_slots import TagNames, TagSlot
from cdtool.messages.columns.protobuf_tree import TagTree, tag_tree
from cdtool.messages.columns.slots import Found, Place
from cdtool.messages.columns.typed import TypedDecoder
from cdtool.messages.layouts.layout import Schema, Text


def protobuf_decoder(schema: Schema) -> TypedDecoder:
    """The decoder of protobuf messages."""
    return TypedDecoder(schema, TagFinder(schema))


@dataclass
class TagFinder:
    """Places of protobuf messages."""

    schema: Schema
    _trees: dict[tuple[Place, ...], TagTree] = field(default_factory=dict)
    _room: int = 8  # numbers of a message

    def find(self, batch: Batch, places: tuple[Place, ...]) -> Found:
        """The places of all messages; raises UndecodableError for a schema that is too large."""
        if places not in self._trees:
            self._trees[places] = tag_tree(self.schema, places)
        tree, n = self._trees[places], len(batch)
        begin, count = (np.zeros((n, len(places)), dtype=np.int64) for _ in range(2))
        seen, status = np.empty((n, len(tree.nodes)), dtype=np.uint8), np.empty(n, dtype=np.uint8)
        scratch = np.zeros((6, kernel.SCRATCH + len(places) + len(tree.tags) + tree.oneofs), dtype=np.int64)
        while True:
            pool = np.empty(n * self._room + 64, dtype=np.uint64)
            used = kernel.read_tags(
                batch.data,
                batch.start,
                batch.length,
                tree.nodes,
                tree.tags,
                tree.oneofs,
                begin,
                count,
                seen,
                pool,
                status,
                scratch,
            )
            if used >= 0:
                break
            self._room *= 2
        damaged = status != kernel.WHOLE
        count[damaged] = -1
        slots, names = {}, {}
        for place, (slot, node, member) in tree.places.items():
            counts, omitted = count[:, slot], None
            if member.tag is not None and not member.tag.presence and member.array is None:
                omitted = (counts == 0) & (seen[:, node] != 0)
                counts = counts + omitted
            first = int(counts[0]) if n else 0
            uniform = first if first > 0 and bool((counts == first).all()) else None
            slots[place] = TagSlot(batch.data, pool, begin[:, slot], counts, uniform, member, omitted)
            if isinstance(member.kind, Text):
                names[place] = TagNames(batch.data, batch.start, begin[:, slot], counts, pool)
        reason = _reason(batch, status) if damaged.any() else ""
        return Found(damaged.astype(np.uint8), reason, slots, names, whole=not damaged.any())

    def pattern(self, places: tuple[Place, ...]) -> None:
        """None: where a field lies depends on the numbers before it."""


def _reason(batch: Batch, status: ByteArray) -> str:
    first = int(np.flatnonzero(status)[0])
    if status[first] == kernel.WRONG:
        return "a decoding error: a field is written as another type than the schema's"
    return f"a decoding error: its {int(batch.length[first])} bytes end within a field, or are no protobuf"
