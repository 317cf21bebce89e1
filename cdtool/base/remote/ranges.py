"""A file at a URL that is read by ranges with fsspec's cache: what is asked for, and little more."""

from __future__ import annotations

import errno
from bisect import bisect_right
from collections.abc import Iterable

from fsspec.caching import ReadAheadCache
from fsspec.spec import AbstractBufferedFile
from fsspec.utils import merge_offset_ranges

from cdtool.base.remote import staging, storage
from cdtool.base.remote.storage import StorageError

# What is read ahead [bytes]: little after a jump, and twice as much each time that reading continues.
_LEAST_AHEAD, _MOST_AHEAD = 1 << 13, 4 << 20
# Expected ranges are kept in memory: no more bytes of them than this.
_MOST_EXPECTED = 64 << 20


class RangedFile(AbstractBufferedFile):  # type: ignore[misc]
    """An open file at a URL, which must not change while it is read: `check_unchanged`."""

    def __init__(self, url: str) -> None:
        self.info = staging.current_info(url)
        super().__init__(None, url, cache_type="none", size=self.info.size)
        self.cache = _Ahead(_LEAST_AHEAD, lambda start, end: storage.read_range(url, start, end), self.size)

    def expect(self, ranges: Iterable[tuple[int, int]]) -> None:
        """Read ranges that will be needed, several at the same time; raises StorageError."""
        inside = [(start, min(end, self.size)) for start, end in ranges if start < min(end, self.size)]
        starts, ends = [start for start, _ in inside], [end for _, end in inside]
        # Reading 4 KB more takes less time than another request.
        _, starts, ends = merge_offset_ranges([self.path] * len(inside), starts, ends, max_gap=1 << 12)
        if 0 < sum(ends) - sum(starts) <= _MOST_EXPECTED:
            self.cache.expected = starts, storage.read_ranges(self.path, starts, ends)

    def check_unchanged(self) -> None:
        """Raise StorageError if the file is another version than when it was opened."""
        if staging.current_info(self.path).digest != self.info.digest:
            raise StorageError(self.path, "changed while it was read", "wait until it is complete", errno.EBUSY)


class _Ahead(ReadAheadCache):  # type: ignore[misc]
    blocksize: int
    expected: tuple[list[int], list[bytes]] = ([], [])

    def _fetch(self, start: int, end: int) -> bytes:
        starts, contents = self.expected
        place = bisect_right(starts, start) - 1
        if place >= 0 and end <= starts[place] + len(contents[place]):
            return contents[place][start - starts[place] : end - starts[place]]
        if not self.start <= start <= end <= self.end:
            continues = self.start < start <= self.end
            self.blocksize = min(2 * self.blocksize, _MOST_AHEAD) if continues else _LEAST_AHEAD
        return bytes(super()._fetch(start, end))
