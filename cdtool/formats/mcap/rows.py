"""Arrays that grow by batches, without a copy where their length was foretold."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

# A foretold length is no more than a hint: this much is reserved at most [bytes].
_MOST_RESERVED = 1 << 28


class Rows:
    """(n,) or (n, k) values; what does not fit the first batch's k is NaN."""

    def __init__(self, expected: int, dtype: npt.DTypeLike = np.float64) -> None:
        self._expected = expected
        self._table: npt.NDArray[Any] | None = None
        self._dtype = dtype
        self.count = 0

    def append(self, values: npt.NDArray[Any]) -> None:
        """Add a batch's rows."""
        if self._table is None:
            width = int(np.prod(values.shape[1:])) * values.itemsize  # bytes of a row
            rows = min(self._expected, _MOST_RESERVED // max(1, width))
            self._table = np.empty((rows, *values.shape[1:]), self._dtype)
        end = self.count + len(values)
        if end > len(self._table):
            grown = np.empty((max(end, 2 * len(self._table)), *self._table.shape[1:]), self._dtype)
            grown[: self.count] = self._table[: self.count]
            self._table = grown
        fits = values.shape[1:] == self._table.shape[1:]
        self._table[self.count : end] = values if fits else np.nan
        self.count = end

    def widen(self, width: int) -> None:
        """Give rows that were all empty so far their width."""
        if self._table is not None and self._table.shape[1:] != (width,):
            self._table = np.full((len(self._table), width), np.nan)

    @property
    def values(self) -> npt.NDArray[Any]:
        """All rows so far."""
        return self._table[: self.count] if self._table is not None else np.empty(0, self._dtype)
