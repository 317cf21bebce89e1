"""Values over time that may be a channel of a log."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cdtool.base.arrays import FloatArray


@dataclass(frozen=True)
class Stream:
    """Values over time that may be a channel: `values` (n, k) at `time` (n,) s, from k columns or one field.

    `joints` are the names of the k joints if the names of the columns contain them.
    """

    name: str
    columns: tuple[str, ...]
    unit: str | None
    time: FloatArray
    values: FloatArray
    topic: str = ""
    field: str = ""
    joints: tuple[str, ...] = ()

    @property
    def width(self) -> int:
        """Return the number of joints it can serve."""
        return int(self.values.shape[1])

    @property
    def moves(self) -> bool:
        """Whether any value changes; False without values."""
        return any(np.ptp(part[np.isfinite(part)], axis=0) > 0.0 for part in self.values.T if np.isfinite(part).any())

    def element(self, index: int) -> Stream:
        """Return one of its columns."""
        values = self.values[:, index : index + 1]
        if self.topic:
            field = self.field.replace("[:]", f"[{index}]")
            return Stream(f"{self.topic} {field}", (), self.unit, self.time, values, self.topic, field)
        column = self.columns[index]
        return Stream(column, (column,), self.unit, self.time, values)
