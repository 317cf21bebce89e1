"""A table of messages found by the walk: filled chunk by chunk, then handed out channel by channel."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from cdtool.formats.mcap.container.walk_kernel import Bytes, sort_by_channel, walk
from cdtool.messages.batch import Batch

# Messages in one table, and definitions: what a walk is interrupted for.
MOST_MESSAGES, MOST_DEFINITIONS = 1 << 17, 1 << 12
# Times from here on [ns] are of no clock: beside them others would not keep their digits.
NO_DATE = 1 << 63

_DTYPES = (np.uint16, np.int64, np.int64, np.uint64)


class MessageTable:
    """Channel, payload's start and length, and log time of up to MOST_MESSAGES messages."""

    def __init__(self) -> None:
        self._columns = tuple(np.empty(MOST_MESSAGES, dtype) for dtype in _DTYPES)
        self._definitions = np.empty((MOST_DEFINITIONS, 3), np.int64)
        self.count = 0

    def walk(self, data: Bytes, at: int, end: int, top_level: bool) -> tuple[int, int, list[tuple[int, int, int]]]:
        """Add the messages of data[at:end]: where the walk ended, why, and the definitions on the way.

        A definition is (opcode, start, length) of a schema's or a channel's content.
        """
        self.count, found, at, why = walk(data, at, end, top_level, self.count, *self._columns, 0, self._definitions)
        return at, why, [(kind, start, size) for kind, start, size in self._definitions[:found].tolist()]

    def times(self, first: int) -> tuple[int, int] | None:
        """Earliest and latest log time [ns] of the messages from number `first` on; None where there is none."""
        log_time = self._columns[3][first : self.count]
        return (int(log_time.min()), int(log_time.max())) if len(log_time) else None

    def first_time(self) -> int:
        """Log time [ns] of the first message in the file's order; of those before 2262, where there are any."""
        times = self._columns[3][: self.count]
        return int(times[np.argmax(np.less(times, NO_DATE))])

    def by_channel(self, data: Bytes) -> Iterator[tuple[int, Batch]]:
        """Channel by channel its messages, in the file's order; the table is empty afterwards."""
        count, self.count = self.count, 0
        columns = [column[:count] for column in self._columns]
        counts = np.bincount(columns[0])
        place = np.cumsum(counts) - counts
        starts, lengths = np.empty(count, np.int64), np.empty(count, np.int64)
        times = np.empty(count, np.uint64)
        sort_by_channel(*columns, starts, lengths, times, place)
        end = 0
        for channel in np.flatnonzero(counts).tolist():
            start, end = end, end + int(counts[channel])
            yield channel, Batch(data, starts[start:end], lengths[start:end], times[start:end])
