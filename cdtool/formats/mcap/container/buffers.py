"""Memory for decompressed chunks: in large pages, and used again once nothing refers to it any more.

Messages lie far apart, and a page of 4 KiB holds few of them: with small pages most of the time goes into finding where
they are (a quarter of decompressing, half of gathering).
"""

from __future__ import annotations

import mmap
import weakref

import numpy as np

from cdtool.formats.mcap.container.walk_kernel import Bytes

_LARGE_PAGE = 2 << 20
_MOST_KEPT = 3


class Buffers:
    """Arrays of `size` bytes, a multiple of a large page; larger ones are made where they are asked for."""

    def __init__(self, size: int) -> None:
        self.size = size
        self._free: list[mmap.mmap] = []

    def take(self, size: int) -> Bytes:
        """An array of at least `size` bytes, with whatever stands in it."""
        if size > self.size:
            return np.empty(size, np.uint8)
        memory = self._free.pop() if self._free else _large_pages(self.size)
        whole: Bytes = np.frombuffer(memory, np.uint8)
        # Every part of it refers to `whole`, which therefore lives as long as any of them.
        weakref.finalize(whole, self._give_back, memory)
        start = -whole.ctypes.data % _LARGE_PAGE
        return whole[start : start + self.size]

    def _give_back(self, memory: mmap.mmap) -> None:
        if len(self._free) < _MOST_KEPT:
            self._free.append(memory)


def _large_pages(size: int) -> mmap.mmap:
    memory = mmap.mmap(-1, size + _LARGE_PAGE)
    if hasattr(mmap, "MADV_HUGEPAGE"):  # Linux
        memory.madvise(mmap.MADV_HUGEPAGE)
    return memory
