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
from cdtool.messages.columns.decoded_batch import ByteArray, IntArray, UndecodableError
from cdtool.messages.columns.member_locations import Found, Place
from cdtool.messages.columns.schema_decoder import TypedDecoder
from cdtool.messages.columns.walk_kernel import all_fit, fetch
from cdtool.messages.layouts.layout import Layout, Member, Message, Number, Schema, Text
from cdtool.recording import FloatArray

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
