"""The arrays for the rows of a text table."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from cdtool.formats.csv.stamps import Integers
from cdtool.recording import FloatArray

# Destination of a file's column: k >= 0 for row k of the numbers, STAMP - k for row k of the stamps, or one of these.
LEFT, EMPTY, STAMP = -1, -2, -3


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

    def part(self, first: int, end: int) -> Rows:
        """Return some of the rows, as views."""
        return Rows(self.numbers[:, first:end], self.stamps[:, first:end], end - first, self.first_line)

    def drop(self, lines: Mapping[int, int]) -> None:
        """Remove rows, given with their lines: the rows after them move up."""
        if lines:
            self.count -= len(lines)
            for table in (self.numbers, self.stamps):
                table[:, : self.count] = np.delete(table, [*lines], axis=1)
            self.numbers, self.stamps = self.numbers[:, : self.count], self.stamps[:, : self.count]
            self.not_rows = np.sort(np.concatenate([self.not_rows, [*lines.values()]]))
