"""A file at a URL that is read by ranges: what is asked for, and little more.

Small reads are answered from blocks that were read ahead. A block is small at first, and twice as large as the last
one where it continues that; what is known to be needed is asked for together with `expect`. The file must not change
while it is read: `check_unchanged`.
"""

from __future__ import annotations

import errno
import io
import threading
from bisect import bisect_right
from collections.abc import Iterable
from typing import Any

from cdtool.base.remote import staging, storage
from cdtool.base.remote.storage_error import StorageError

# Smaller files are copied: that is one request.
SMALLEST_BY_RANGES = 16 << 20
# A block that is read ahead [bytes].
_SMALLEST_BLOCK, _LARGEST_BLOCK = 1 << 13, 4 << 20
_MOST_BLOCKS = 16
# Expected ranges: so many bytes of them are kept, and those that are nearer than this are one range.
_MOST_EXPECTED, _NEAR = 64 << 20, 1 << 12
# Requests at the same time.
_TOGETHER = 4


class RangedBytes:
    """A file of `size` bytes at a URL that can be read at any position, by several threads."""

    def __init__(self, url: str) -> None:
        self.url = url
        self.info = staging.current_info(url)
        self.size = self.info.size
        self._lock = threading.Lock()
        self._starts: list[int] = []
        self._expected: dict[int, bytes] = {}
        self._blocks: dict[int, bytes] = {}
        self._last_end, self._block = -2 * _SMALLEST_BLOCK, _SMALLEST_BLOCK

    def read(self, at: int, length: int) -> bytes:
        """Return up to `length` bytes from `at`, fewer only at the file's end; raises StorageError."""
        end = min(at + length, self.size)
        if at >= end:
            return b""
        with self._lock:
            found = self._kept(at, end)
            if found is not None:
                return found
            if end - at <= self._next_block(at):
                return self._ahead(at)[: end - at]
        return storage.read_range(self.url, at, end)

    def expect(self, ranges: Iterable[tuple[int, int]]) -> None:
        """Read ranges that will be needed, several at the same time; raises StorageError."""
        wanted = _joined(sorted(ranges), self.size)
        kept = sum(map(len, self._expected.values()))
        for first in range(0, len(wanted), _TOGETHER):
            some = wanted[first : first + _TOGETHER]
            kept += sum(end - start for start, end in some)
            if kept > _MOST_EXPECTED:
                return
            contents = storage.read_ranges(self.url, some)
            with self._lock:
                self._expected |= {start: content for (start, _), content in zip(some, contents, strict=True)}
                self._starts = sorted(self._expected)

    def check_unchanged(self) -> None:
        """Raise StorageError if the file is another version than when it was opened."""
        if staging.current_info(self.url) != self.info:
            raise StorageError(self.url, "changed while it was read", "wait until it is complete", errno.EBUSY)

    def _kept(self, at: int, end: int) -> bytes | None:
        place = bisect_right(self._starts, at) - 1
        if place >= 0:
            start = self._starts[place]
            content = self._expected[start]
            if end <= start + len(content):
                return content[at - start : end - start]
        for start, content in self._blocks.items():
            if start <= at and end <= start + len(content):
                return content[at - start : end - start]
        return None

    def _next_block(self, at: int) -> int:
        """Return the size of the next block [bytes]: larger if it continues the last one."""
        continues = abs(at - self._last_end) < _SMALLEST_BLOCK
        self._block = min(2 * self._block, _LARGEST_BLOCK) if continues else _SMALLEST_BLOCK
        return self._block

    def _ahead(self, at: int) -> bytes:
        """Read a block; only the last ones are kept."""
        end = min(at + self._block, self.size)
        content = storage.read_range(self.url, at, end)
        self._last_end = end
        while len(self._blocks) >= _MOST_BLOCKS or sum(map(len, self._blocks.values())) > 2 * _LARGEST_BLOCK:
            del self._blocks[next(iter(self._blocks))]
        self._blocks[at] = content
        return content


class RangedFile(io.RawIOBase):
    """The same as an open file without a buffer."""

    def __init__(self, url: str) -> None:
        self._bytes = RangedBytes(url)
        self._at = 0

    def readable(self) -> bool:
        """Return True."""
        return True

    seekable = readable

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        """Move to a position, and return it."""
        start = {io.SEEK_SET: 0, io.SEEK_CUR: self._at, io.SEEK_END: self._bytes.size}[whence]
        self._at = max(0, start + offset)
        return self._at

    def tell(self) -> int:
        """Return the position."""
        return self._at

    def readinto(self, target: Any) -> int:
        """Fill `target` from the position on, and return the number of bytes; raises StorageError."""
        view = memoryview(target).cast("B")
        content = self._bytes.read(self._at, len(view))
        view[: len(content)] = content
        self._at += len(content)
        return len(content)


def _joined(ranges: list[tuple[int, int]], size: int) -> list[tuple[int, int]]:
    """Return sorted ranges within the file, those that are near to each other as one."""
    made: list[tuple[int, int]] = []
    for start, end in ranges:
        start, end = max(0, start), min(end, size)
        if start >= end:
            continue
        if made and start - made[-1][1] <= _NEAR:
            made[-1] = made[-1][0], max(made[-1][1], end)
        else:
            made.append((start, end))
    return made
