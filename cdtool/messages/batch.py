"""A batch of undecoded messages of one channel, in one buffer."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

# MCAP Message record (op=0x05): channel id (uint16), sequence (uint32), log time, publish time (uint64 each), payload.
# Distances [bytes] of two of these from the start of the payload:
_SEQUENCE, _PUBLISH_TIME = 20, 8


@dataclass(frozen=True)
class Batch:
    """Messages of one channel in the order of the file, in one buffer.

    `data` (bytes,) uint8 is a decompressed chunk or a section of the file. `start` and `length` (n,) int64 locate the
    payload of each message in it. `log_time` (n,) uint64 is in ns.
    """

    data: npt.NDArray[np.uint8]
    start: npt.NDArray[np.int64]
    length: npt.NDArray[np.int64]
    log_time: npt.NDArray[np.uint64]

    def __len__(self) -> int:
        return len(self.start)

    @property
    def publish_time(self) -> npt.NDArray[np.uint64]:
        """Publish times (n,) in ns, read from the message records."""
        return self._before(_PUBLISH_TIME, "<u8").astype(np.uint64)

    @property
    def sequence(self) -> npt.NDArray[np.uint32]:
        """Sequence numbers (n,), read from the message records."""
        return self._before(_SEQUENCE, "<u4").astype(np.uint32)

    def first(self, count: int) -> Batch:
        """Return a batch of the first `count` messages."""
        cut = slice(count)
        return Batch(self.data, self.start[cut], self.length[cut], self.log_time[cut])

    def _before(self, distance: int, dtype: str) -> npt.NDArray[Any]:
        """Return the number `distance` bytes before each payload."""
        count = len(self.data) + 1 - np.dtype(dtype).itemsize
        # A number starting at every byte: unaligned reads without a copy per message.
        overlapping: npt.NDArray[Any] = np.ndarray((max(0, count),), dtype, self.data, strides=(1,))
        return overlapping[self.start - distance]


NO_BATCH = Batch(np.empty(0, np.uint8), np.empty(0, np.int64), np.empty(0, np.int64), np.empty(0, np.uint64))
