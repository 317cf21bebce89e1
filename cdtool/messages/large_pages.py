"""Memory in large pages for decompressed chunks and for columns, kept for the next ones.

The first write to a page costs as much as copying a part of it, as the system clears it: with new memory for each log,
clearing takes a tenth of the time of reading it.
"""

from __future__ import annotations

import mmap
import sys
import weakref

import numpy as np
import numpy.typing as npt

_LARGE_PAGE = 2 << 20


class Buffers:
    """Arrays of `size` bytes, a multiple of a large page; they are reused when nothing refers to them.

    Larger ones are allocated separately. At most `kept` arrays without a use remain allocated.
    """

    def __init__(self, size: int, kept: int) -> None:
        self.size, self._kept = size, kept
        self._free: list[mmap.mmap] = []

    def take(self, size: int) -> npt.NDArray[np.uint8]:
        """Return an uninitialised array of at least `size` bytes."""
        if size > self.size:
            return _from_large_page(np.frombuffer(_large_pages(size), np.uint8), size)
        try:
            memory = self._free.pop()
        except IndexError:
            memory = _large_pages(self.size)
        whole = np.frombuffer(memory, np.uint8)
        # Every view refers to `whole`, which therefore exists as long as any of them.
        weakref.finalize(whole, self._give_back, memory)
        return _from_large_page(whole, self.size)

    def _give_back(self, memory: mmap.mmap) -> None:
        if len(self._free) < self._kept:
            self._free.append(memory)


def _from_large_page(whole: npt.NDArray[np.uint8], size: int) -> npt.NDArray[np.uint8]:
    start = -whole.ctypes.data % _LARGE_PAGE
    return whole[start : start + size]


def _large_pages(size: int) -> mmap.mmap:
    if sys.platform == "win32":
        return mmap.mmap(-1, size + _LARGE_PAGE)
    # Private: without it, forked workers would write into the same memory as this process and each other.
    memory = mmap.mmap(-1, size + _LARGE_PAGE, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
    if hasattr(mmap, "MADV_HUGEPAGE"):  # Linux
        memory.madvise(mmap.MADV_HUGEPAGE)
    return memory
