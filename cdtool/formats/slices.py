"""Read columns that a file stores one after the other, and yield them as pieces of many columns."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.formats.columns import Column, Piece
from cdtool.formats.pieces import VALUES_PER_PIECE

# Read the rows from `start` to before `end`.
ReadRows = Callable[[int, int], FloatArray]


@dataclass(frozen=True)
class SlicedColumn:
    """A column of `rows` values (n,). `clock` names its clock; `time` reads its times [s], None for a table column."""

    name: str
    rows: int
    values: ReadRows
    clock: str = ""
    time: ReadRows | None = None
    unit: str | None = None


def header_of(column: SlicedColumn) -> Column:
    """Return the column without its rows."""
    return Column(column.name, np.empty(0), None if column.time is None else np.empty(0), column.unit)


def interleave(columns: Sequence[SlicedColumn]) -> Iterator[Piece]:
    """Yield the same share of each clock's rows in turn, so that clocks that run in parallel advance together.

    Table columns of equal length form one table.
    """
    clocks: dict[str, list[SlicedColumn]] = {}
    for column in columns:
        clocks.setdefault(column.clock if column.time is not None else f"#{column.rows}", []).append(column)
    cuts = max(1, -(-sum(column.rows for column in columns) // VALUES_PER_PIECE))
    for cut in range(cuts):
        for clock, members in clocks.items():
            rows, read = members[0].rows, members[0].time
            start, end = rows * cut // cuts, rows * (cut + 1) // cuts
            values = {column.name: column.values(start, end) for column in members}
            yield Piece(clock, None if read is None else read(start, end), values, end - start)
