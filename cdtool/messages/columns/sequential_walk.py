"""Messages without tags, walked one after another to locate the wanted members in each."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from cdtool.columns import as_float64
from cdtool.messages.batch import Batch
from cdtool.messages.columns import walk_kernel
from cdtool.messages.columns.decoded_batch import ByteArray, IntArray
from cdtool.messages.columns.member_locations import MemberLocations
from cdtool.messages.columns.walk_program import Program
from cdtool.messages.layouts.layout import Number
from cdtool.recording import FloatArray


@dataclass(frozen=True)
class SequentialSlot:
    """A slot of numbers of one type in the file's bytes: those of message i begin at byte `at[i] + offset`.

    Either all messages have `uniform` numbers, or message i has `counted[i]`. `swapped` (n,) marks big-endian messages;
    None: no message is big-endian.
    """

    data: ByteArray
    at: IntArray
    offset: int
    kind: Number | None
    uniform: int | None = None
    counted: IntArray | None = None
    swapped: ByteArray | None = None

    @property
    def count(self) -> IntArray:
        """The number of elements (n,)."""
        return np.full(len(self.at), self.uniform) if self.counted is None else self.counted

    def numbers(self, rows: IntArray | None, first: int, width: int) -> FloatArray:
        """Return (rows, width) float64; an int64 beyond 2^53 is rounded to the nearest."""
        if self.kind is None:
            raise TypeError("strings and messages are not numbers")
        at = self.at if rows is None else self.at[rows]
        size, name = self.kind.size, self.kind.name
        fetched = np.empty((len(at), width * size), dtype=np.uint8)
        walk_kernel.fetch(self.data, at, self.offset + first * size, fetched)
        raw = fetched.view(f"<{self.kind.dtype}")
        if name == "bool":
            raw = raw != 0
        elif self.swapped is not None:
            swapped = self.swapped if rows is None else self.swapped[rows]
            raw = np.where(swapped[:, None] != 0, raw.byteswap(), raw)
        return as_float64(raw)


@dataclass(frozen=True)
class SequentialNames:
    """String arrays in the file's bytes, of message i from `begin[i]` to `end[i]`; alignment counts from `body`."""

    data: ByteArray
    begin: IntArray
    end: IntArray
    count: IntArray
    body: IntArray
    aligned: bool
    swapped: ByteArray
    _read: dict[tuple[int, int, bool, bytes], tuple[str, ...]] = field(default_factory=dict)

    def are_equal(self, rows: IntArray) -> bool:
        """Return False for more than one message: their strings would have to be read first."""
        return len(rows) == 1

    def of(self, row: int) -> tuple[str, ...]:
        """Return the strings of one message, without their closing NUL."""
        if self.count[row] < 0:
            return ()
        block = self.data[self.begin[row] : self.end[row]].tobytes()
        phase = int(self.begin[row] - self.body[row]) % 4 if self.aligned else 0
        key = (int(self.count[row]), phase, bool(self.swapped[row]), block)
        if key not in self._read:
            self._read[key] = tuple(_strings(*key, self.aligned))
        return self._read[key]


def _strings(count: int, phase: int, big: bool, block: bytes, aligned: bool) -> Iterator[str]:
    at = 0
    for _ in range(count):
        at += -(at + phase) % 4 if aligned else 0
        size = int.from_bytes(block[at : at + 4], "big" if big else "little")
        text = block[at + 4 : at + 4 + size]
        yield (text.removesuffix(b"\0") if aligned else text).decode(errors="replace")
        at += 4 + size


def locate_all(program: Program, batch: Batch, header: int) -> MemberLocations:
    """Locate the members of all messages, one after another; `status` is that of walk_kernel."""
    walk = SequentialWalk(program, batch, header, 0)
    swapped = walk.swapped if walk.swapped.any() else None
    slots = {
        path: SequentialSlot(batch.data, walk.at[:, slot], 0, kind, counted=walk.count[:, slot], swapped=swapped)
        for path, (slot, kind) in program.members.items()
    }
    names = {path: walk.names(slot, batch) for path, (slot, kind) in program.members.items() if kind is None}
    return MemberLocations(walk.status, "", slots, names)


class SequentialWalk:
    """The result of walk_kernel.walk over messages: `at`, `count` (n, slots), and at most `lengths` lengths."""

    def __init__(self, program: Program, batch: Batch, header: int, lengths: int) -> None:
        n = len(batch.start)
        self.header = header
        self.at = np.zeros((n, program.slots), dtype=np.int64)
        self.count = np.empty((n, program.slots), dtype=np.int64)
        self.lengths = np.zeros(2 + lengths, dtype=np.int64)
        self.status, self.swapped = np.empty(n, dtype=np.uint8), np.empty(n, dtype=np.uint8)
        walk_kernel.walk(
            batch.data,
            np.ndarray((max(0, len(batch.data) - 3),), np.uint32, batch.data, strides=(1,)),
            batch.start,
            batch.length,
            program.steps,
            header,
            self.at,
            self.count,
            self.lengths,
            self.status,
            self.swapped,
            np.empty((2, walk_kernel.DEEPEST), dtype=np.int64),
        )
        self.count[self.status != walk_kernel.WHOLE] = -1

    def names(self, slot: int, batch: Batch) -> SequentialNames:
        """Return the strings of a slot; empty if it is not a slot of strings."""
        return SequentialNames(
            batch.data,
            self.at[:, slot],
            self.at[:, slot + 1],
            self.count[:, slot],
            batch.start + self.header,
            self.header > 0,
            self.swapped,
        )
