"""Columns that lie one behind the other in a file, cut into pieces side by side."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from cdtool.columns import Column, Piece
from cdtool.formats.pieces import VALUES_A_PIECE
from cdtool.recording import FloatArray

# Reads the rows from one to before another.
Read = Callable[[int, int], FloatArray]


@dataclass(frozen=True)
class Sliced:
    """A column of `rows` values (n,); `clock` names what gives its `time` [s], None: it is a column of a table."""

    name: str
    rows: int
    values: Read
    clock: str = ""
    time: Read | None = None
    unit: str | None = None


def header_of(column: Sliced) -> Column:
    """The column without its rows."""
    return Column(column.name, np.empty(0), None if column.time is None else np.empty(0), column.unit)


def side_by_side(columns: Sequence[Sliced]) -> Iterator[Piece]:
    """The same share of every clock's rows, then the next: clocks that run side by side stay so.

    Columns of tables that are equally long are one table.
    """
    clocks: dict[str, list[Sliced]] = {}
    for column in columns:
        clocks.setdefault(column.clock if column.time is not None else f"#{column.rows}", []).append(column)
    cuts = max(1, -(-sum(column.rows for column in columns) // VALUES_A_PIECE))
    for cut in range(cuts):
        for clock, members in clocks.items():
            rows, read = members[0].rows, members[0].time
            start, end = rows * cut // cuts, rows * (cut + 1) // cuts
            values = {column.name: column.values(start, end) for column in members}
            yield Piece(clock, None if read is None else read(start, end), values, end - start)
