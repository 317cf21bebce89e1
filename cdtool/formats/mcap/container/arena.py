"""The memory that is being filled: consecutive decompressed chunks, and the table of their messages."""

from __future__ import annotations

from collections.abc import Generator, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from cdtool.formats.mcap.container import walk_kernel
from cdtool.formats.mcap.container.damage import DamageError
from cdtool.formats.mcap.container.definitions import Definitions
from cdtool.formats.mcap.container.messages import NO_DATE, MessageTable
from cdtool.formats.mcap.container.walk_kernel import Bytes
from cdtool.messages.batch import Batch


@dataclass(frozen=True)
class MessageBlock:
    """Messages in one memory block, channel by channel.

    `covered`: a CRC covers the bytes. `cuts` maps channels whose definition changes to the offset in `data` where it
    changes.
    """

    data: Bytes
    batches: tuple[tuple[int, Batch], ...]
    covered: bool
    cuts: Mapping[int, int]


@dataclass(frozen=True)
class WalkResult:
    """End and reason of a walk (walk_kernel), the span of log times [ns] if known, and faults of definitions."""

    at: int
    reason: int
    times: tuple[int, int] | None
    faults: tuple[str, ...]


class Arena:
    """Memory that is filled with chunks, walked for messages, and yielded as blocks."""

    def __init__(self, definitions: Definitions) -> None:
        self.first_time: int | None = None  # log time [ns] of the file's first message
        self._definitions = definitions
        self._table = MessageTable()
        self._data = np.empty(0, np.uint8)
        self._used = 0
        self._covered = False
        self._cuts: dict[int, int] = {}

    def fits(self, size: int, covered: bool) -> bool:
        """Return whether `size` more bytes have space, and a CRC covers both these and earlier bytes, or neither."""
        return self._covered == covered and size <= len(self._data) - self._used

    def reserve(self, size: int) -> Bytes:
        """Return memory for the next chunk, which is part of the arena after a call of `walk`."""
        return self._data[self._used : self._used + size]

    def reset(self, memory: Bytes, covered: bool) -> None:
        """Start again with `memory`, after `flush`."""
        self._data, self._covered = memory, covered

    def walk(self, size: int, top_level: bool = False) -> Generator[MessageBlock, None, WalkResult]:
        """Add the messages of the next `size` bytes; yield blocks if the table is full, and return the result."""
        at, end, before = self._used, self._used + size, self._table.count
        faults: list[str] = []
        emptied = False
        while True:
            at, reason, definitions = self._table.walk(self._data, at, end, top_level)
            faults += self._define(definitions)
            if reason != walk_kernel.FULL:
                break
            emptied = True
            yield from self.blocks()
        times = None if emptied else self._table.times(before)
        begin, self._used = self._used, end
        return WalkResult(at - begin, reason, times, tuple(faults))

    def take_window(self, window: Bytes) -> Generator[MessageBlock, None, WalkResult]:
        """Start again with records outside of chunks; yield their blocks, and return the result of the walk."""
        yield from self.flush()
        self._data, self._covered = window, False
        walked = yield from self.walk(len(window), top_level=True)
        yield from self.flush()
        return walked

    def flush(self) -> Iterator[MessageBlock]:
        """Yield the messages in memory, and release the memory."""
        yield from self.blocks()
        self._data, self._used, self._cuts = np.empty(0, np.uint8), 0, {}

    def _define(self, definitions: list[tuple[int, int, int]]) -> Iterator[str]:
        """Add definitions, note where a channel's definition changes, and yield the faults of definitions."""
        data = self._data.data
        for opcode, start, size in definitions:
            body = data[start : start + size]
            if self._definitions.is_known(opcode, bytes(body), self._covered):
                continue
            before = set(self._definitions.ambiguous)
            try:
                self._definitions.add(opcode, body, self._covered)
            except DamageError as fault:
                yield str(fault)
            self._cuts.update(dict.fromkeys(set(self._definitions.ambiguous) - before, start))

    def blocks(self) -> Iterator[MessageBlock]:
        """Yield the messages added since the last block."""
        if not self._table.count:
            return
        self._note_first_time(self._table.first_time())
        cuts = {channel: self._cuts.get(channel, 0) for channel in self._definitions.ambiguous}
        yield MessageBlock(self._data, tuple(self._table.by_channel(self._data)), self._covered, cuts)

    def _note_first_time(self, time: int) -> None:
        """Set the first time; a valid one replaces an invalid one, so that the sizes of blocks do not matter."""
        if self.first_time is None or (self.first_time >= NO_DATE and time < NO_DATE):
            self.first_time = time
