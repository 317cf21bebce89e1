"""Undecoded messages of one channel, in one buffer, the same for every container format."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt


@dataclass(frozen=True)
class Stream:
    """A channel, identified by its number in the log; several channels may write to one topic.

    `encoding` is the encoding of the messages, such as `cdr`. `definition` is their schema: its language, such as
    `ros2msg`, the message type, such as `sensor_msgs/msg/JointState`, and its text; all three are empty if unknown.
    """

    id: int
    topic: str
    encoding: str
    definition: tuple[str, str, bytes]


@dataclass(frozen=True)
class Batch:
    """Messages of one channel in the order of the file, in one buffer.

    `data` (bytes,) uint8 are decompressed chunks or a section of the file. `start` and `length` (n,) int64 locate the
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
        return numbers_at(self.data, self.start - 8, "<u8")  # the last field before the payload

    @property
    def sequence(self) -> npt.NDArray[np.uint32]:
        """Sequence numbers (n,), read from the message records."""
        return numbers_at(self.data, self.start - 20, "<u4")  # before the log time and the publish time

    def payload(self, row: int) -> bytes:
        """Return the bytes of one message."""
        return self.data[self.start[row] : self.start[row] + self.length[row]].tobytes()

    def rows(self, rows: slice | npt.NDArray[np.intp]) -> Batch:
        """Return a batch of these messages."""
        return Batch(self.data, self.start[rows], self.length[rows], self.log_time[rows])


def numbers_at(data: npt.NDArray[np.uint8], at: npt.NDArray[np.int64], dtype: str) -> npt.NDArray[Any]:
    """Return the number that begins at each of these bytes, which must exist."""
    count = max(0, len(data) + 1 - np.dtype(dtype).itemsize)
    # A number starting at every byte: unaligned reads without a copy per message.
    overlapping: npt.NDArray[Any] = np.ndarray((count,), dtype, data, strides=(1,))
    return overlapping[at]
