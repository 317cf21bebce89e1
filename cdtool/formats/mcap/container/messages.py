"""A table of the messages that the walk has found: filled chunk by chunk, then read channel by channel."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from cdtool.formats.mcap.container.walk_kernel import Bytes, sort_by_channel, walk
from cdtool.messages.batch import Batch

# The size of a table in messages and definitions; a walk is interrupted when the table is full.
MOST_MESSAGES, MOST_DEFINITIONS = 1 << 17, 1 << 12
# Times from here [ns] are invalid: relative to them, other times would lose digits.
NO_DATE = 1 << 63

_DTYPES = (np.uint16, np.int64, np.int64, np.uint64)


class MessageTable:
    """Channel, start and length of the payload, and log time of up to MOST_MESSAGES messages."""

    def __init__(self) -> None:
        self._columns = tuple(np.empty(MOST_MESSAGES, dtype) for dtype in _DTYPES)
        self._definitions = np.empty((MOST_DEFINITIONS, 3), np.int64)
        self.count = 0

    def walk(self, data: Bytes, at: int, end: int, top_level: bool) -> tuple[int, int, list[tuple[int, int, int]]]:
        """Add the messages of data[at:end]; return end and reason of the walk, and the definitions.

        A definition is (opcode, start, length) of a schema's or a channel's content.
        """
        self.count, others, at, why = walk(data, at, end, top_level, self.count, *self._columns, 0, self._definitions)
        return at, why, [(kind, start, size) for kind, start, size in self._definitions[:others].tolist()]

    def times(self, first: int) -> tuple[int, int] | None:
        """Return earliest and latest log time [ns] of the messages from number `first`; None without messages."""
        log_time = self._columns[3][first : self.count]
        return (int(log_time.min()), int(log_time.max())) if len(log_time) else None

    def first_time(self) -> int:
        """Return the log time [ns] of the first message in the file's order, preferably one with a valid time."""
        times = self._columns[3][: self.count]
        return int(times[np.argmax(np.less(times, NO_DATE))])

    def by_channel(self, data: Bytes) -> Iterator[tuple[int, Batch]]:
        """Yield the messages channel by channel, in the file's order; the table is empty afterwards."""
        count, self.count = self.count, 0
        columns = [column[:count] for column in self._columns]
        counts = np.bincount(columns[0])
        first = np.cumsum(counts) - counts
        starts, lengths = np.empty(count, np.int64), np.empty(count, np.int64)
        times = np.empty(count, np.uint64)
        sort_by_channel(*columns, starts, lengths, times, first)
        end = 0
        for channel in np.flatnonzero(counts).tolist():
            start, end = end, end + int(counts[channel])
            yield channel, Batch(data, starts[start:end], lengths[start:end], times[start:end])
