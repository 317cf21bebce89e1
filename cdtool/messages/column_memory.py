"""Memory for the columns of long logs, in large pages."""

from __future__ import annotations

import math
import mmap
from typing import Any

import numpy as np
import numpy.typing as npt

from cdtool.messages.large_pages import Buffers

_SMALLEST = 1 << 18  # smaller arrays are allocated as usual [bytes]
_LINE = 64  # arrays begin at a line of the processor's cache
# Address space that is reserved at once; only pages that are written take memory. Three regions are the columns of five
# minutes of a robot's log.
_REGIONS = Buffers(32 << 20, kept=3)


class ColumnMemory:
    """Allocates arrays one after the other; their memory is released together, when nothing refers to any of them."""

    def __init__(self) -> None:
        self._region = np.empty(0, np.uint8)
        self._used = 0

    def empty(self, shape: tuple[int, ...], dtype: npt.DTypeLike = np.float64) -> npt.NDArray[Any]:
        """Return an uninitialised array."""
        size = math.prod(shape) * np.dtype(dtype).itemsize
        if size < _SMALLEST or not hasattr(mmap, "MADV_HUGEPAGE"):  # Linux has it
            return np.empty(shape, dtype)
        if size > len(self._region) - self._used:
            self._region, self._used = _REGIONS.take(size), 0
        start = self._used
        self._used = min(len(self._region), -(-(start + size) // _LINE) * _LINE)
        return self._region[start : start + size].view(dtype).reshape(shape)
