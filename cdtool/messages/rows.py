"""Arrays that grow by batches, without a copy where their length was foretold."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

# A foretold length is no more than a hint: this much is reserved at most [bytes].
_MOST_RESERVED = 1 << 28
# How often an array that others write into is replaced: each time it is copied.
_MOST_REPLACED = 16


class Rows:
    """(n,) or (n, k) values; what does not fit the first batch's k is NaN.

    Others may write into rows behind the last one, each into rows of their own: `share` gives them the array,
    `confirm` tells that some are there. As nobody knows who is still writing, what is appended otherwise goes into a
    copy of it from then on.
    """

    def __init__(self, expected: int, dtype: npt.DTypeLike = np.float64) -> None:
        self._expected = expected
        self._table: npt.NDArray[Any] | None = None
        self._dtype = dtype
        self._shared = False
        self._replaced = 0
        self.count = 0

    def append(self, values: npt.NDArray[Any]) -> None:
        """Add a batch's rows."""
        if self._table is None:
            width = int(np.prod(values.shape[1:])) * values.itemsize  # bytes of a row
            rows = min(self._expected, _MOST_RESERVED // max(1, width))
            self._table = np.empty((rows, *values.shape[1:]), self._dtype)
        end = self.count + len(values)
        if end > len(self._table) or self._shared:
            rows = max(end, 2 * len(self._table)) if end > len(self._table) else len(self._table)
            grown = np.empty((rows, *self._table.shape[1:]), self._dtype)
            grown[: self.count] = self._table[: self.count]
            self._replaced += self._shared
            self._table, self._shared = grown, False
        fits = values.shape[1:] == self._table.shape[1:]
        self._table[self.count : end] = values if fits else np.nan
        self.count = end

    def share(self, shape: tuple[int, ...]) -> npt.NDArray[Any] | None:
        """The array, so that others write rows of this shape into it; None where it has none of them."""
        if self._table is None or self._table.shape[1:] != shape or self._replaced > _MOST_REPLACED:
            return None
        self._shared = True
        return self._table

    def confirm(self, table: npt.NDArray[Any], rows: slice) -> None:
        """Add these rows of an array that was shared, at some time."""
        present = self._table
        if present is None or rows.start != self.count or rows.stop > len(present):
            self.append(table[rows])
            return
        if table is not present:  # of the present one nobody else has these rows
            present[rows] = table[rows]
        self.count = int(rows.stop)

    def widen(self, width: int) -> None:
        """Give rows that were all empty so far their width."""
        if self._table is not None and self._table.shape[1:] != (width,):
            self._table = np.full((len(self._table), width), np.nan)

    @property
    def values(self) -> npt.NDArray[Any]:
        """All rows so far."""
        return self._table[: self.count] if self._table is not None else np.empty(0, self._dtype)
