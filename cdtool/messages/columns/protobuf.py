"""protobuf messages (MCAP, "Well-known message encodings"; protobuf.dev, "Encoding" and "Field Presence").

A number that is not written is 0 if its schema does not track presence (proto3, neither `optional` nor in a `oneof`)
and the message that contains it is present. Otherwise it is NaN: an `optional` field, a member of a `oneof` other than
the chosen one, any field of proto2, and all fields of an absent nested message. A wanted field written as another type,
a truncated field and a varint without an end damage the message. An int64 or uint64 beyond 2^53 is rounded to the
nearest float64.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from cdtool.columns import as_float64
from cdtool.messages.batch import Batch
from cdtool.messages.columns import protobuf_kernel as kernel
from cdtool.messages.columns.decoded_batch import ByteArray, IntArray, UndecodableError
from cdtool.messages.columns.field_values import FieldPlan
from cdtool.messages.columns.member_locations import MemberLocations, MemberPath
from cdtool.messages.columns.schema_decoder import SchemaDecoder, StampPaths
from cdtool.messages.columns.tag_rows import ExampleMessage, tag_layout
from cdtool.messages.columns.walk_kernel import all_match, fetch
from cdtool.messages.fast_path import RowLayout
from cdtool.messages.layouts.layout import Layout, Member, Message, Number, Schema, Text
from cdtool.recording import FloatArray

_MOST_TAGS = 20_000
# Fixed-width numbers: their code in the kernel, and their type.
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
    """The kernel's `nodes` and `tags`; for each path its slot, the node that contains it, and its member."""

    nodes: IntArray
    tags: IntArray
    oneofs: int
    members: dict[MemberPath, tuple[int, int, Member]]


def build_tag_tree(schema: Schema, paths: tuple[MemberPath, ...]) -> TagTree:
    """Return the tags that locate `paths` in a message of `schema`; raises UndecodableError if there are too many."""
    return _Builder(schema, paths).tree()


class _Builder:
    """Builds the nodes depth first, so that the slots and nodes nested in a tag are contiguous."""

    def __init__(self, schema: Schema, paths: tuple[MemberPath, ...]) -> None:
        self.schema = schema
        self.members: dict[MemberPath, tuple[int, int, Member]] = {}
        self.rows: list[list[list[int]]] = []
        self.oneofs = 0
        self.slots = 0
        self.add_message(schema.root, (), paths)

    def tree(self) -> TagTree:
        """Return the tree as arrays."""
        tags = [row for rows in self.rows for row in rows]
        if len(tags) > _MOST_TAGS:
            raise UndecodableError(f"schema '{self.schema.root.name}' is too large")
        lasts = np.cumsum([len(rows) for rows in self.rows])
        nodes = np.column_stack([np.concatenate([[0], lasts[:-1]]), lasts]).astype(np.int64)
        table = np.array(tags, dtype=np.int64).reshape(-1, kernel.COLUMNS)
        return TagTree(nodes, table, self.oneofs, self.members)

    def add_message(self, layout: Layout, above: MemberPath, wanted: tuple[MemberPath, ...]) -> int:
        """Add a node for a message and return its number; `wanted` are the paths within it."""
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
                self.add_member(member, node, rows, above, wanted, known.get(member.tag.oneof, -1))
        return node

    def add_member(
        self,
        member: Member,
        node: int,
        rows: list[list[int]],
        above: MemberPath,
        wanted: tuple[MemberPath, ...],
        oneof: int,
    ) -> None:
        tag, path = member.tag, (*above, member.name)
        mine = _within(above, member, wanted)
        if tag is None or (not mine and oneof < 0):
            return
        if not mine:
            self.add_tag(rows, tag.number, kernel.UNWANTED, oneof=oneof)
        for _ in (each for each in mine if each == path):
            content = kernel.COUNT if isinstance(member.kind, Message) else kernel.TEXTS
            if isinstance(member.kind, Number):
                wire, _ = FIXED.get(tag.wire, (kernel.VARINT, ""))
                content = wire + (0 if member.array is None else kernel.REPEATED)
            slot = self.slots
            self.slots += 1
            self.members[path] = (slot, node, member)
            self.add_tag(rows, tag.number, content, slot, oneof=oneof)
        if not isinstance(member.kind, Message):
            return
        depth = len(path)
        elements = {each[depth] for each in mine if len(each) > depth and member.array is not None}
        for element in sorted(elements, key=str) if member.array is not None else [None]:
            inner = path if element is None else (*path, element)
            within = tuple(each for each in mine if len(each) > len(inner) and each[: len(inner)] == inner)
            if not within:
                continue
            row = self.add_tag(rows, tag.number, kernel.GROUP if tag.wire == "group" else kernel.MESSAGE, oneof=oneof)
            row[kernel.ELEMENT] = -1 if element is None else int(element)
            row[kernel.FIRST_SLOT], row[kernel.FIRST_NODE] = self.slots, len(self.rows)
            row[kernel.NODE] = self.add_message(self.schema.nested(member.kind), inner, within)
            row[kernel.LAST_SLOT], row[kernel.LAST_NODE] = self.slots, len(self.rows)

    def add_tag(self, rows: list[list[int]], number: int, content: int, slot: int = -1, oneof: int = -1) -> list[int]:
        row = [number, content, slot, -1, -1, oneof, max(slot, 0), slot + 1 if slot >= 0 else 0, 0, 0]
        rows.append(row)
        return row


def _within(above: MemberPath, member: Member, wanted: tuple[MemberPath, ...]) -> tuple[MemberPath, ...]:
    here = (*above, member.name)
    return tuple(path for path in wanted if path[: len(here)] == here)


@dataclass(frozen=True)
class TagSlot:
    """A slot of numbers of one tag: those of message i begin at `pool[begin[i]]`; `omitted` (n,) ones are 0."""

    data: ByteArray
    pool: npt.NDArray[np.uint64]
    begin: IntArray
    count: IntArray
    uniform: int | None
    member: Member
    omitted: npt.NDArray[np.bool_] | None

    def numbers(self, rows: IntArray | None, first: int, width: int) -> FloatArray:
        """Return (rows, width) float64; an int64 beyond 2^53 is rounded to the nearest."""
        begin, omitted = self.begin, self.omitted
        if rows is not None:
            begin, omitted = begin[rows], None if omitted is None else omitted[rows]
        if omitted is None or not omitted.any():
            return self._convert(self.pool[(begin + first)[:, None] + np.arange(width)])
        values = np.zeros((len(begin), width))
        values[~omitted] = self._convert(self.pool[(begin[~omitted] + first)[:, None] + np.arange(width)])
        return values

    def _convert(self, entries: npt.NDArray[np.uint64]) -> FloatArray:
        """Convert entries of the pool: varints to the member's type, byte positions to fixed-width numbers."""
        wire = self.member.tag.wire if self.member.tag is not None else ""
        if wire in FIXED:
            _, dtype = FIXED[wire]
            at = entries.astype(np.int64).reshape(-1)
            raw = np.empty((len(at), np.dtype(dtype).itemsize), dtype=np.uint8)
            fetch(self.data, at, 0, raw)
            return as_float64(raw.view(dtype).reshape(entries.shape))
        if wire == "bool":
            return np.asarray(entries != 0, dtype=np.float64)
        if wire in ("sint32", "sint64"):
            entries = entries & np.uint64(0xFFFFFFFF) if wire == "sint32" else entries
            entries = (entries >> np.uint64(1)) ^ (~(entries & np.uint64(1)) + np.uint64(1))
        narrow = {"int32": np.int32, "sint32": np.int32, "enum": np.int32, "uint32": np.uint32, "uint64": np.uint64}
        return np.asarray(entries.astype(narrow.get(wire, np.int64)), dtype=np.float64)


@dataclass
class TagNames:
    """Strings of repeated tags; a `pool` entry is the first byte, relative to the message, times 2^32 plus the size."""

    data: ByteArray
    start: IntArray
    begin: IntArray
    count: IntArray
    pool: npt.NDArray[np.uint64]
    _all_equal: bool | None = None

    def are_equal(self, rows: IntArray) -> bool:
        """Return True if these messages have the same strings."""
        if len(rows) < len(self.start):
            return self._compare(rows)
        if self._all_equal is None:
            self._all_equal = self._compare(rows)
        return self._all_equal

    def _compare(self, rows: IntArray) -> bool:
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
            if not all_match(self.data, at, sizes[:, k], size, np.full(size, 255, dtype=np.uint8), text):
                return False
        return True

    def of(self, row: int) -> tuple[str, ...]:
        """Return the strings of one message."""
        begin, start = int(self.begin[row]), int(self.start[row])
        spans = self.pool[begin : begin + max(int(self.count[row]), 0)].tolist()
        ranges = [(start + (span >> 32), span & 0xFFFFFFFF) for span in spans]
        return tuple(self.data[at : at + size].tobytes().decode(errors="replace") for at, size in ranges)


def protobuf_decoder(schema: Schema) -> SchemaDecoder:
    """Return the decoder of protobuf messages."""
    return SchemaDecoder(schema, TagLocator(schema))


@dataclass
class TagLocator:
    """Locates the members of protobuf messages."""

    schema: Schema
    _trees: dict[tuple[MemberPath, ...], TagTree] = field(default_factory=dict)
    _pool_entries: int = 8  # per message, at first
    _example: bytes = b""  # the first message of the last batch

    def locate(self, batch: Batch, paths: tuple[MemberPath, ...]) -> MemberLocations:
        """Return the members of all messages; raises UndecodableError for a schema that is too large."""
        if paths not in self._trees:
            self._trees[paths] = build_tag_tree(self.schema, paths)
        tree, n = self._trees[paths], len(batch)
        if n:
            self._example = batch.data[batch.start[0] : batch.start[0] + batch.length[0]].tobytes()
        begin, count = (np.zeros((n, len(paths)), dtype=np.int64) for _ in range(2))
        seen, status = np.empty((n, len(tree.nodes)), dtype=np.uint8), np.empty(n, dtype=np.uint8)
        scratch = np.zeros((6, kernel.SCRATCH + len(paths) + len(tree.tags) + tree.oneofs), dtype=np.int64)
        while True:
            pool = np.empty(n * self._pool_entries + 64, dtype=np.uint64)
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
            self._pool_entries *= 2
        damaged = status != kernel.WHOLE
        count[damaged] = -1
        slots, names = {}, {}
        for path, (slot, node, member) in tree.members.items():
            counts, omitted = count[:, slot], None
            if member.tag is not None and not member.tag.presence and member.array is None:
                omitted = (counts == 0) & (seen[:, node] != 0)
                counts = counts + omitted
            first = int(counts[0]) if n else 0
            uniform = first if first > 0 and bool((counts == first).all()) else None
            slots[path] = TagSlot(batch.data, pool, begin[:, slot], counts, uniform, member, omitted)
            if isinstance(member.kind, Text):
                names[path] = TagNames(batch.data, batch.start, begin[:, slot], counts, pool)
        reason = _reason(batch, status) if damaged.any() else ""
        return MemberLocations(damaged.astype(np.uint8), reason, slots, names, intact=not damaged.any())

    def row_layout(
        self, paths: tuple[MemberPath, ...], plans: Sequence[FieldPlan], joints: Sequence[str], stamp: StampPaths
    ) -> RowLayout | None:
        """Return the row layout of the plans' fields in messages like the first one of the last batch."""
        content = np.frombuffer(self._example, np.uint8)
        zero = np.zeros(1, np.int64)
        locations = self.locate(Batch(content, zero, zero + len(content), zero.view(np.uint64)), paths)
        if not self._example or not locations.intact:
            return None
        counts = {path: int(slot.count[0]) for path, slot in locations.slots.items()}
        names = {path: each.of(0) for path, each in locations.names.items()}
        return tag_layout(self.schema, ExampleMessage(counts, names), plans, joints, stamp)


def _reason(batch: Batch, status: ByteArray) -> str:
    first = int(np.flatnonzero(status)[0])
    if status[first] == kernel.WRONG:
        return "a decoding error: a field is written as another type than the schema's"
    return f"a decoding error: its {int(batch.length[first])} bytes end within a field, or are not protobuf"
