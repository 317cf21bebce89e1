"""Messages without tags, walked: where the wanted places are, by one look at all messages or one after another.

Nearly always all messages of a batch have the same lengths (of texts, sequences and names) at the same places. Then
what was found in one message holds for all: its lengths and names are compared with those of every other one, the
offsets are common, and the numbers are copied on the way. Where one message differs, all are walked.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from cdtool.formats.mcap.batch import Batch
from cdtool.formats.mcap.columns import walk_kernel
from cdtool.formats.mcap.columns.alike_kernel import WORD, WordArray, compared_words, take_alike, words_of
from cdtool.formats.mcap.columns.gathered import ByteArray, IntArray
from cdtool.formats.mcap.columns.slots import FixedNames, Found, Place, Slot
from cdtool.formats.mcap.columns.walk_program import Program
from cdtool.formats.mcap.layouts.layout import Number
from cdtool.recording import FloatArray

_MOST_LENGTHS = 256  # of a message that others are compared with
_MOST_TAKEN = 64  # numbers of a place that are copied while messages are compared: of more, few may be wanted


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


@dataclass(frozen=True)
class TakenSlot:
    """Numbers of 8 bytes that were copied out of the messages: `words` (n, uniform)."""

    words: WordArray
    kind: Number
    uniform: int

    @property
    def count(self) -> IntArray:
        """(n,)."""
        return np.full(len(self.words), self.uniform)

    def numbers(self, rows: IntArray | None, first: int, width: int) -> FloatArray:
        """(rows, width) float64; an int64 beyond 2^53 is rounded to the nearest."""
        words = self.words[:, first : first + width]
        if words.shape[1] < width:  # no message has them: no rows are asked for
            return np.empty((0, width))
        raw = (words if rows is None else words[rows]).view(f"<{self.kind.dtype}")
        return raw if raw.dtype == np.float64 else raw.astype(np.float64)


@dataclass(frozen=True)
class Pattern:
    """What was found in one message, and the words that another one must have for the same to hold.

    `places` are offset, count and type, `names` the texts, `taken` the places whose numbers are copied, each with how
    many words of a message are copied before it; `shortest` to `copied` are take_alike's,
    `before` and `step` (k,) its `first`, for one message, and `step`.
    """

    places: dict[Place, tuple[int, int, Number | None]]
    names: dict[Place, FixedNames]
    taken: dict[Place, int]
    shortest: int
    longest: int
    compared: WordArray
    mask: WordArray
    pattern: WordArray
    copied: WordArray
    before: IntArray
    step: IntArray

    def found(self, batch: Batch) -> Found | None:
        """The places of all messages; None where it does not hold for all."""
        # Place by place, so that each one's numbers lie side by side.
        n = len(batch)
        copied = np.empty(n * len(self.copied), dtype=np.uint64)
        first = self.before * (n - 1) + np.arange(len(self.copied))
        alike = self.compared, self.mask, self.pattern, self.copied, first, self.step, copied
        if not take_alike(words_of(batch.data), batch.start, batch.length, self.shortest, self.longest, *alike):
            return None
        slots: dict[Place, Slot] = {}
        for place, (offset, count, kind) in self.places.items():
            if place in self.taken and kind is not None:
                begin = n * self.taken[place]
                slots[place] = TakenSlot(copied[begin : begin + n * count].reshape(n, count), kind, count)
            else:
                slots[place] = WalkedSlot(batch.data, batch.start, offset, kind, count)
        return Found(np.zeros(n, dtype=np.uint8), "", slots, self.names, whole=True)


def pattern_of(program: Program, batch: Batch, header: int) -> Pattern | None:
    """The pattern of the batch's first message; None where it is damaged, big-endian, tiny or has too many lengths."""
    one = replace(batch, start=batch.start[:1], length=batch.length[:1])
    walked = _Walked(program, one, header, _MOST_LENGTHS)
    lengths, begin = walked.lengths, int(batch.start[0])
    size = int(lengths[1]) - begin
    if walked.status[0] or walked.swapped[0] or lengths[0] > _MOST_LENGTHS or size < WORD:
        return None
    mask = np.zeros(size, dtype=np.uint8)
    mask[: 2 if header else 0] = 255  # the kind and the byte order
    for at in (lengths[2 : 2 + int(lengths[0])] - begin).tolist():
        mask[at : at + 4] = 255
    places, names, taken = {}, {}, {}
    copied: list[int] = []
    before: list[int] = []
    step: list[int] = []
    for place, (slot, kind) in program.places.items():
        at, count = int(walked.at[0, slot]) - begin, int(walked.count[0, slot])
        places[place] = at, count, kind
        if kind is None:
            names[place] = FixedNames(walked.names(slot, one).of(0))
            mask[at : int(walked.at[0, slot + 1]) - begin if count >= 0 else at] = 255
        elif kind.size == WORD and 0 < count <= _MOST_TAKEN:
            taken[place] = len(copied)
            before += count * [len(copied)]
            step += count * [count]
            copied += range(at, at + count * WORD, WORD)
    compared = compared_words(mask, batch.data[begin : begin + size])
    layout = (np.array(before, dtype=np.int64), np.array(step, dtype=np.int64))
    longest = size + (walk_kernel.PADDING if header else 0)
    return Pattern(places, names, taken, size, longest, *compared, np.array(copied, dtype=np.uint64), *layout)


def walk_all(program: Program, batch: Batch, header: int) -> Found:
    """The places of all messages, one after another; `status` is walk_kernel's."""
    walked = _Walked(program, batch, header, 0)
    swapped = walked.swapped if walked.swapped.any() else None
    slots = {
        place: WalkedSlot(batch.data, walked.at[:, slot], 0, kind, counted=walked.count[:, slot], swapped=swapped)
        for place, (slot, kind) in program.places.items()
    }
    names = {place: walked.names(slot, batch) for place, (slot, kind) in program.places.items() if kind is None}
    return Found(walked.status, "", slots, names)


class _Walked:
    """The walk over messages: `at`, `count` (n, slots), `lengths` (walk_kernel.walk)."""

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
