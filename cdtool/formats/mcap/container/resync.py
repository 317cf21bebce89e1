"""Finding the next chunk behind bytes that are no record."""

from __future__ import annotations

from bisect import bisect_left, bisect_right

import numpy as np

from cdtool.formats.mcap.container.chunks import HEADER_LENGTH, LARGEST, chunk_header
from cdtool.formats.mcap.container.damage import DamageError
from cdtool.formats.mcap.container.file_bytes import FileBytes
from cdtool.formats.mcap.container.records import MAGIC, PREFIX, Chunk
from cdtool.formats.mcap.container.summary import Summary
from cdtool.formats.mcap.container.walk_kernel import Bytes

_WINDOW = 1 << 20


class Resync:
    """Where reading goes on. `proven`: all before it was given, or a CRC proved it; what lies behind may still be had.

    A wrong length that no CRC covers leads over whole chunks into the midst of something: these lie before the place
    where that shows. The way back is bounded, as a file could be made of such lengths.
    """

    def __init__(self, file: FileBytes, summary: Summary) -> None:
        self.proven = len(MAGIC)
        self._file = file
        self._known = sorted(summary.chunks) if summary.verified else []
        self._back = file.size  # bytes that may still be gone back

    def check(self, at: int, length: int) -> None:
        """Raise DamageError where a record, no chunk, reaches over a chunk that a verified summary names."""
        following = bisect_right(self._known, at)
        if following < len(self._known) and (place := self._known[following]) < at + length:
            header = chunk_header(place, self._file.read(place, HEADER_LENGTH))
            if header is not None and header.consistent:
                raise DamageError(f"a record of {length} bytes reaches over a chunk")

    def after(self, at: int) -> tuple[int, int | None]:
        """Behind byte `at`, which begins no record: from where on bytes are lost, and the next chunk (None: none)."""
        found = self._next(self.proven)
        if found is not None and found <= at:
            self._back -= at - found
            if found == at or self._back < 0:
                found = self._next(at + 1)
        if found is None:
            return at, None
        begin, self.proven = min(at, self.proven) if found < at else at, found + 1
        return begin, found

    def _next(self, at: int) -> int | None:
        place = bisect_left(self._known, at)
        return self._known[place] if place < len(self._known) else next_chunk(self._file, at)


def next_chunk(file: FileBytes, at: int) -> int | None:
    """The first place from byte `at` on that looks like a chunk: its sizes and its compression agree."""
    while at < file.size - HEADER_LENGTH:
        window = file.array(at, _WINDOW + HEADER_LENGTH)
        for place in _candidates(window):
            header = chunk_header(at + place, window[place : place + HEADER_LENGTH].data)
            if header is not None and header.consistent and header.size <= LARGEST:
                return header.at
        at += _WINDOW
    return None


def _candidates(window: Bytes) -> list[int]:
    """Where the opcode of a chunk stands before a length below 4 GiB."""
    last = len(window) - HEADER_LENGTH
    if last <= 0:
        return []
    fits = window[:last] == Chunk.opcode
    for i in range(PREFIX - 4, PREFIX):
        fits &= window[i : i + last] == 0
    return [int(place) for place in np.flatnonzero(fits)]
