"""A file as bytes at places: read, never mapped, so that a file that shrinks or a lost drive is an error, no crash."""

from __future__ import annotations

from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np

from cdtool.formats.mcap.container.checksums import crc32
from cdtool.formats.mcap.container.damage import DamageError
from cdtool.formats.mcap.container.walk_kernel import Bytes

_PIECE, _SMALL = 1 << 20, 1 << 12


class FileBytes:
    """`size` bytes, read where they are asked for."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._file = path.open("rb", buffering=0)
        self.size = self._file.seek(0, 2)
        self._scratch = np.empty(0, np.uint8)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, fault: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Read no more."""
        self._file.close()

    def read(self, at: int, length: int) -> memoryview:
        """Up to `length` bytes from `at`, fewer only at the file's end."""
        if length > _SMALL:
            return self.array(at, length).data
        # A chunk has a handful of records' heads around it: each costs a tenth of what an array of its own does.
        there = max(0, min(length, self.size - at))
        self._file.seek(at)
        found = self._file.read(there)
        return memoryview(found) if len(found) == there else self.array(at, length).data

    def array(self, at: int, length: int) -> Bytes:
        """The same as an array of its own."""
        target = np.empty(max(0, min(length, self.size - at)), np.uint8)
        self.read_into(at, target)
        return target

    def read_scratch(self, at: int, length: int) -> Bytes:
        """The same in memory that the next call uses again; raises DamageError where the file ends before."""
        if length > len(self._scratch):
            self._scratch = np.empty(max(length, _PIECE), np.uint8)
        self.read_into(at, self._scratch[:length])
        return self._scratch[:length]

    def read_into(self, at: int, target: Bytes) -> None:
        """Fill `target` from `at` on; raises DamageError where the file ends before."""
        self._file.seek(at)
        view, filled = target.data, 0
        while filled < len(view):
            got = self._file.readinto(view[filled:])
            if not got:
                raise DamageError("the file became shorter while it was read")
            filled += got

    def crc(self, at: int, end: int) -> int:
        """CRC-32 of the bytes from `at` to `end`."""
        crc, target = 0, np.empty(_PIECE, np.uint8)
        while at < end:
            piece = target[: min(_PIECE, end - at)]
            self.read_into(at, piece)
            crc = crc32(piece, crc)
            at += len(piece)
        return crc
