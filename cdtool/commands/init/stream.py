"""Values over time that may be a channel of a log."""

from __future__ import annotations

from dataclasses import dataclass, replace

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
    def known(self) -> FloatArray:
        """Return its finite values."""
        return self.values[np.isfinite(self.values)]

    @property
    def moves(self) -> bool:
        """Whether any value changes; False without values."""
        return any(np.ptp(part[np.isfinite(part)], axis=0) > 0.0 for part in self.values.T if np.isfinite(part).any())

    @property
    def reach(self) -> float:
        """Return its largest absolute value."""
        return float(np.nanmax(np.abs(self.values)))

    def at(self, clock: FloatArray) -> FloatArray:
        """Return its values at other times, by linear interpolation."""
        if len(self.time) == len(clock) and np.array_equal(self.time, clock):
            return self.values
        return np.column_stack([np.interp(clock, self.time, column) for column in self.values.T])

    def with_values(self, values: FloatArray) -> Stream:
        """Return other values at the same times, without a unit."""
        return replace(self, unit=None, values=values)

    def elements(self) -> list[Stream]:
        """Return a stream for each element of a list in messages; itself if it is not one."""
        return [self.element(i) for i in range(self.width)] if self.field.endswith("[:]") else [self]

    def element(self, index: int) -> Stream:
        """Return one of its columns."""
        values = self.values[:, index : index + 1]
        if self.topic:
            field = self.field.replace("[:]", f"[{index}]")
            return Stream(f"{self.topic} {field}", (), self.unit, self.time, values, self.topic, field)
        column = self.columns[index]
        return Stream(column, (column,), self.unit, self.time, values)


def joined(streams: list[Stream], name: str, joints: tuple[str, ...] = ()) -> Stream:
    """Join streams of one column each, on one clock, to one of several columns."""
    values = np.hstack([stream.values for stream in streams])
    columns = tuple(stream.columns[0] for stream in streams)
    return Stream(name, columns, streams[0].unit, streams[0].time, values, joints=joints)
