"""Random access to the bytes of a file, by reading; of a large one at a URL, by ranges of it.

If the file shrinks or the drive fails, this raises an error; with a memory-mapped file the process would crash.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from cdtool.base.files.bounded_loading import MIB
from cdtool.formats.mcap.chunks import Bytes
from cdtool.formats.mcap.records import DamageError, crc32

_MOST_AT_ONCE = 1 << 30  # macOS refuses to read 2 GiB and more in one call


class FileBytes:
    """A file of `size` bytes that can be read at any position."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._file: Any = path.open("rb", buffering=0)
        self.is_ranged = hasattr(self._file, "expect")
        self.size = self._file.seek(0, 2)

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def expect(self, ranges: Iterable[tuple[int, int]]) -> None:
        """Read these ranges of a file at a URL together, from where they are needed soon; raises OSError."""
        if self.is_ranged:
            self._file.expect(ranges)

    def check_unchanged(self) -> None:
        """Raise OSError if a file at a URL was replaced since it was opened."""
        if self.is_ranged:
            self._file.check_unchanged()

    def read(self, at: int, length: int) -> memoryview:
        """Return up to `length` bytes from `at`, fewer only at the file's end."""
        return self.array(at, length).data

    def array(self, at: int, length: int) -> Bytes:
        """Return the same as a new array."""
        target = np.empty(max(0, min(length, self.size - at)), np.uint8)
        self.read_into(at, target)
        return target

    def read_into(self, at: int, target: Bytes) -> None:
        """Fill `target` with the bytes from `at`; raises DamageError if the file ends before."""
        view, filled = target.data, 0
        while filled < len(view):
            self._file.seek(at + filled)
            count = self._file.readinto(view[filled : filled + _MOST_AT_ONCE])
            if not count:
                raise DamageError("the file became shorter while it was read")
            filled += count

    def crc(self, at: int, end: int) -> int:
        """Return the CRC-32 of the bytes from `at` to before `end`."""
        crc, target = 0, np.empty(MIB, np.uint8)
        while at < end:
            piece = target[: min(MIB, end - at)]
            self.read_into(at, piece)
            crc = crc32(piece, crc)
            at += len(piece)
        return crc
