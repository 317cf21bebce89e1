"""The arrays for the rows of a text table."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from cdtool.formats.csv.row_kernel import Integers
from cdtool.recording import FloatArray


@dataclass
class Rows:
    """The numbers (k, n) and the stamps (m, n) of the requested columns; `not_rows` are the lines that are not rows."""

    numbers: FloatArray
    stamps: Integers
    count: int
    first_line: int
    not_rows: Integers = field(default_factory=lambda: np.empty(0, dtype=np.int64))

    def line(self, row: int) -> int:
        """Return the file's line (from 1) of a row (from 0)."""
        before = self.not_rows - np.arange(len(self.not_rows))
        return self.first_line + row + int(np.searchsorted(before, self.first_line + row, side="right"))
