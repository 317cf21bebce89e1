"""Messages without tags, walked one after another: where the wanted places are in each."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from cdtool.messages.batch import Batch
from cdtool.messages.columns import walk_kernel
from cdtool.messages.columns.decoded_batch import ByteArray, IntArray
from cdtool.messages.columns.member_locations import Found
from cdtool.messages.columns.walk_program import Program
from cdtool.messages.layouts.layout import Number
from cdtool.recording import FloatArray


@dataclass(frozen=True)
class WalkedSlot:
    """Numbers of one type in the messages themselves: those of message i begin at byte `at[i] + offset`.

    `swapped` (n,): the message is big-endian; None: none is. Either all have `uniform` numbers, or message i
    `counted[i]`.
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
        """(n,)."""
        return np.full(len(self.at), self.uniform) if self.counted is None else self.counted

    def numbers(self, rows: IntArray | None, first: int, width: int) -> FloatArray:
        """(rows, width) float64; an int64 beyond 2^53 is rounded to the nearest."""
        if self.kind is None:
            raise TypeError("texts and messages are no numbers")
        at = self.at if rows is None else self.at[rows]
        size, name = self.kind.size, self.kind.name
        found = np.empty((len(at), width * size), dtype=np.uint8)
        walk_kernel.fetch(self.data, at, self.offset + first * size, found)
        raw = found.view(f"<{self.kind.dtype}")
        if name == "bool":
            raw = raw != 0
        elif self.swapped is not None:
            swapped = self.swapped if rows is None else self.swapped[rows]
            raw = np.where(swapped[:, None] != 0, raw.byteswap(), raw)
        return raw if raw.dtype == np.float64 else raw.astype(np.float64)


@dataclass(frozen=True)
class WalkedNames:
    """Arrays of texts that lie in the messages from byte `begin[i]` to `end[i]`; `body`: alignment's origin."""

    data: ByteArray
    begin: IntArray
    end: IntArray
    count: IntArray
    body: IntArray
    aligned: bool
    swapped: ByteArray
    _read: dict[tuple[int, int, bool, bytes], tuple[str, ...]] = field(default_factory=dict)

    def alike(self, rows: IntArray) -> bool:
        """False where there is more than one message: others have to be read."""
        return len(rows) == 1

    def of(self, row: int) -> tuple[str, ...]:
        """The texts, without their closing NUL."""
        if self.count[row] < 0:
            return ()
        block = self.data[self.begin[row] : self.end[row]].tobytes()
        phase = int(self.begin[row] - self.body[row]) % 4 if self.aligned else 0
        key = (int(self.count[row]), phase, bool(self.swapped[row]), block)
        if key not in self._read:
            self._read[key] = tuple(_texts(*key, self.aligned))
        return self._read[key]


def _texts(count: int, phase: int, big: bool, block: bytes, aligned: bool) -> Iterator[str]:
    at = 0
    for _ in range(count):
        at += -(at + phase) % 4 if aligned else 0
        size = int.from_bytes(block[at : at + 4], "big" if big else "little")
        text = block[at + 4 : at + 4 + size]
        yield (text.removesuffix(b"\0") if aligned else text).decode(errors="replace")
        at += 4 + size


def walk_all(program: Program, batch: Batch, header: int) -> Found:
    """The places of all messages, one after another; `status` is walk_kernel's."""
    walked = Walked(program, batch, header, 0)
    swapped = walked.swapped if walked.swapped.any() else None
    slots = {
        place: WalkedSlot(batch.data, walked.at[:, slot], 0, kind, counted=walked.count[:, slot], swapped=swapped)
        for place, (slot, kind) in program.places.items()
    }
    names = {place: walked.names(slot, batch) for place, (slot, kind) in program.places.items() if kind is None}
    return Found(walked.status, "", slots, names)


class Walked:
    """The walk over messages: `at`, `count` (n, slots), up to so many `lengths` (walk_kernel.walk)."""

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

    def names(self, slot: int, batch: Batch) -> WalkedNames:
        """The texts of a slot, empty where it is none of texts."""
        return WalkedNames(
            batch.data,
            self.at[:, slot],
            self.at[:, slot + 1],
            self.count[:, slot],
            batch.start + self.header,
            self.header > 0,
            self.swapped,
        )
