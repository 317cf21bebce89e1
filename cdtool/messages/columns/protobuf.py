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
import numpy.typing as npt

from cdtool.messages.batch import Batch
from cdtool.messages.columns import protobuf_kernel as kernel
from cdtool.messages.columns.gathered import ByteArray, IntArray
from cdtool.messages.columns.protobuf_tree import FIXED, TagTree, tag_tree
from cdtool.messages.columns.slots import Found, Place
from cdtool.messages.columns.typed import TypedDecoder
from cdtool.messages.columns.walk_kernel import all_fit, fetch
from cdtool.messages.layouts.layout import Member, Schema, Text
from cdtool.recording import FloatArray


@dataclass(frozen=True)
class TagSlot:
    """Numbers of one tag: what the kernel found of message i begins at `pool[begin[i]]`; `omitted` (n,) means 0."""

    data: ByteArray
    pool: npt.NDArray[np.uint64]
    begin: IntArray
    count: IntArray
    uniform: int | None
    member: Member
    omitted: npt.NDArray[np.bool_] | None

    def numbers(self, rows: IntArray | None, first: int, width: int) -> FloatArray:
        """(rows, width) float64; an int64 beyond 2^53 is rounded to the nearest."""
        begin, omitted = self.begin, self.omitted
        if rows is not None:
            begin, omitted = begin[rows], None if omitted is None else omitted[rows]
        if omitted is None or not omitted.any():
            return self._meant(self.pool[(begin + first)[:, None] + np.arange(width)])
        values = np.zeros((len(begin), width))
        values[~omitted] = self._meant(self.pool[(begin[~omitted] + first)[:, None] + np.arange(width)])
        return values

    def _meant(self, found: npt.NDArray[np.uint64]) -> FloatArray:
        """What varints mean as the member's type; fixed-width numbers are fetched."""
        wire = self.member.tag.wire if self.member.tag is not None else ""
        if wire in FIXED:
            _, dtype = FIXED[wire]
            at = found.astype(np.int64).reshape(-1)
            raw = np.empty((len(at), np.dtype(dtype).itemsize), dtype=np.uint8)
            fetch(self.data, at, 0, raw)
            values: FloatArray = raw.view(dtype).reshape(found.shape).astype(np.float64)
            return values
        if wire == "bool":
            return np.asarray(found != 0, dtype=np.float64)
        if wire in ("sint32", "sint64"):
            found = found & np.uint64(0xFFFFFFFF) if wire == "sint32" else found
            found = (found >> np.uint64(1)) ^ (~(found & np.uint64(1)) + np.uint64(1))
        narrow = {"int32": np.int32, "sint32": np.int32, "enum": np.int32, "uint32": np.uint32, "uint64": np.uint64}
        return np.asarray(found.astype(narrow.get(wire, np.int64)), dtype=np.float64)


@dataclass
class TagNames:
    """Texts of repeated tags: their first bytes, from the message's, times 2^32 plus their sizes lie in the `pool`."""

    data: ByteArray
    start: IntArray
    begin: IntArray
    count: IntArray
    pool: npt.NDArray[np.uint64]
    _alike: bool | None = None

    def alike(self, rows: IntArray) -> bool:
        """True if all have as many texts of the same bytes."""
        if len(rows) < len(self.start):
            return self._compared(rows)
        if self._alike is None:
            self._alike = self._compared(rows)
        return self._alike

    def _compared(self, rows: IntArray) -> bool:
        counts = self.count[rows]
        if not len(rows) or counts[0] < 0 or not (counts == counts[0]).all():
            return False
        spans = self.pool[self.begin[rows][:, None] + np.arange(int(counts[0]))].astype(np.int64)
        sizes = spans & 0xFFFFFFFF
        if not (sizes == sizes[:1]).all():
            return False
        for k, size in enumerate(sizes[0].tolist()):
            at = self.start[rows] + (spans[:, k] >> 32)
            text = self.data[at[0] : at[0] + size].copy()
            if not all_fit(self.data, at, sizes[:, k], size, np.full(size, 255, dtype=np.uint8), text):
                return False
        return True

    def of(self, row: int) -> tuple[str, ...]:
        """The texts of one message."""
        begin, start = int(self.begin[row]), int(self.start[row])
        spans = self.pool[begin : begin + max(int(self.count[row]), 0)].tolist()
        places = [(start + (span >> 32), span & 0xFFFFFFFF) for span in spans]
        return tuple(self.data[at : at + size].tobytes().decode(errors="replace") for at, size in places)


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
