"""What travels from the file to the columns: messages of one channel in one piece of memory."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

# Before a payload stand channel id (uint16), sequence (uint32), log and publish time (uint64): Message (op=0x05).
_SEQUENCE, _PUBLISH_TIME = 20, 8


@dataclass(frozen=True)
class Batch:
    """Messages of one channel in the order of the file, in one piece of memory.

    `data` (bytes,) uint8 is a decompressed chunk or a part of the file; `start` and `length` (n,) int64 are where each
    message's payload lies in it; `log_time` (n,) uint64 in ns.
    """

    data: npt.NDArray[np.uint8]
    start: npt.NDArray[np.int64]
    length: npt.NDArray[np.int64]
    log_time: npt.NDArray[np.uint64]

    def __len__(self) -> int:
        return len(self.start)

    @property
    def publish_time(self) -> npt.NDArray[np.uint64]:
        """(n,) in ns, read from the messages' headers."""
        return self._before(_PUBLISH_TIME, "<u8").astype(np.uint64)

    @property
    def sequence(self) -> npt.NDArray[np.uint32]:
        """(n,), read from the messages' headers."""
        return self._before(_SEQUENCE, "<u4").astype(np.uint32)

    def first(self, count: int) -> Batch:
        """The first messages of them."""
        cut = slice(count)
        return Batch(self.data, self.start[cut], self.length[cut], self.log_time[cut])

    def _before(self, distance: int, dtype: str) -> npt.NDArray[Any]:
        """The number that stands so many bytes before each payload; the numbers at all bytes overlap."""
        count = len(self.data) + 1 - np.dtype(dtype).itemsize
        every: npt.NDArray[Any] = np.ndarray((max(0, count),), dtype, self.data, strides=(1,))
        return every[self.start - distance]


NO_BATCH = Batch(np.empty(0, np.uint8), np.empty(0, np.int64), np.empty(0, np.int64), np.empty(0, np.uint64))
