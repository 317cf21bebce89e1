"""Finding the next chunk behind bytes that are no record."""

from __future__ import annotations

import numpy as np

from cdtool.formats.mcap.container.chunks import HEADER_LENGTH, LARGEST, chunk_header
from cdtool.formats.mcap.container.file_bytes import FileBytes
from cdtool.formats.mcap.container.records import PREFIX, Chunk
from cdtool.formats.mcap.container.walk_kernel import Bytes

_WINDOW = 1 << 20


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
