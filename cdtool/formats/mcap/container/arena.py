"""The piece of memory under way: decompressed chunks side by side, and the table of their messages."""

from __future__ import annotations

from collections.abc import Generator, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from cdtool.formats.mcap.container import walk_kernel as why
from cdtool.formats.mcap.container.damage import DamageError
from cdtool.formats.mcap.container.definitions import Definitions
from cdtool.formats.mcap.container.messages import NO_DATE, MessageTable
from cdtool.formats.mcap.container.walk_kernel import Bytes
from cdtool.messages.batch import Batch
from cdtool.messages.taken import Taken


@dataclass(frozen=True)
class MessageBlock:
    """Messages in one piece of memory, channel by channel.

    `covered`: a CRC covers the bytes; `cuts`: channels whose definition changes at a place of `data`. `taken`: chunks
    whose messages are columns already; then there are no batches.
    """

    data: Bytes
    batches: tuple[tuple[int, Batch], ...]
    covered: bool
    cuts: Mapping[int, int]
    taken: tuple[Taken, ...] = ()


@dataclass(frozen=True)
class WalkResult:
    """Where a walk ended and why (walk_kernel), the log times' span [ns] where it is known, and definitions' faults."""

    at: int
    why: int
    times: tuple[int, int] | None
    faults: tuple[str, ...]


class Arena:
    """Memory that is filled, walked and handed out: `flush` leaves it to those who got it."""

    def __init__(self, definitions: Definitions) -> None:
        self.first_time: int | None = None  # log time [ns] of the file's first message
        self._definitions = definitions
        self._table = MessageTable()
        self._data = np.empty(0, np.uint8)
        self._used = 0
        self._covered = False
        self._cuts: dict[int, int] = {}
        self._taken: list[Taken] = []

    def fits(self, size: int, covered: bool) -> bool:
        """`size` more bytes can lie beside what is there, and a CRC covers both or neither."""
        return self._covered == covered and size <= len(self._data) - self._used

    def reserve(self, size: int) -> Bytes:
        """Memory for the next chunk; it counts once `walk` is told of it."""
        return self._data[self._used : self._used + size]

    def reset(self, memory: Bytes, covered: bool) -> None:
        """Start again with `memory`, once what is there was handed out."""
        self._data, self._covered = memory, covered

    def add_decoded(self, size: int, taken: Taken) -> Iterator[MessageBlock]:
        """The next `size` bytes are a chunk whose messages are columns already."""
        if self._table.count:
            yield from self._hand_out()
        self._taken.append(taken)
        self._used += size

    def walk(self, size: int, top_level: bool = False) -> Generator[MessageBlock, None, WalkResult]:
        """Take the records of the next `size` bytes; gives a WalkResult. Hands out pieces where the table is full."""
        if self._taken:
            yield from self._hand_out()
        at, end, before = self._used, self._used + size, self._table.count
        faults: list[str] = []
        emptied = False
        while True:
            at, reason, definitions = self._table.walk(self._data, at, end, top_level)
            faults += self._define(definitions)
            if reason != why.FULL:
                break
            emptied = True
            yield from self._hand_out()
        times = None if emptied else self._table.times(before)
        begin, self._used = self._used, end
        return WalkResult(at - begin, reason, times, tuple(faults))

    def take_window(self, window: Bytes) -> Generator[MessageBlock, None, WalkResult]:
        """Start again with records that stand in the file itself, outside of chunks; gives a WalkResult."""
        yield from self.flush()
        self._data, self._covered = window, False
        walked = yield from self.walk(len(window), top_level=True)
        yield from self.flush()
        return walked

    def flush(self) -> Iterator[MessageBlock]:
        """Hand out what is there."""
        yield from self._hand_out()
        self._data, self._used, self._cuts = np.empty(0, np.uint8), 0, {}

    def _define(self, definitions: list[tuple[int, int, int]]) -> Iterator[str]:
        """Take definitions and note where a channel's changes; gives what is wrong with them."""
        data = self._data.data
        for opcode, start, size in definitions:
            body = data[start : start + size]
            if self._definitions.knows(opcode, bytes(body), self._covered):
                continue
            before = set(self._definitions.ambiguous)
            try:
                self._definitions.take(opcode, body, self._covered)
            except DamageError as fault:
                yield str(fault)
            self._cuts.update(dict.fromkeys(set(self._definitions.ambiguous) - before, start))

    def _hand_out(self) -> Iterator[MessageBlock]:
        if self._taken:
            taken, self._taken = tuple(self._taken), []
            if self.first_time is None or self.first_time >= NO_DATE:
                self.first_time = taken[0].first_time
            yield MessageBlock(self._data, (), self._covered, {}, taken)
        if not self._table.count:
            return
        if self.first_time is None or self.first_time >= NO_DATE:
            self.first_time = self._table.first_time()
        cuts = {channel: self._cuts.get(channel, 0) for channel in self._definitions.ambiguous}
        yield MessageBlock(self._data, tuple(self._table.by_channel(self._data)), self._covered, cuts)
