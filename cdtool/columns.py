"""What a file holds before it has channels: columns of numbers with their times, whole or in pieces."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from cdtool.recording import FloatArray


@dataclass(frozen=True)
class Column:
    """One stream of numbers: `values` (n,) or (n, k) as the file has them.

    `time` (n,) in seconds where the format carries a time for each message, else None (a table: the clock is a column).
    """

    name: str
    values: FloatArray
    time: FloatArray | None = None
    unit: str | None = None


@dataclass(frozen=True)
class Piece:
    """Some rows (`rows` = n) of the columns that share one clock, in the file's order.

    `time` (n,) [s] counts from the source's `origin` [s]; None where the columns are a table, whose clock is one of
    them or not known. `values` are (n,) or (n, k) by column; a column of this clock that is not among them has no
    value in these rows. Messages of a topic (`clock` is its name) are in the order of their times within a piece.
    """

    clock: str
    time: FloatArray | None
    values: Mapping[str, FloatArray]
    rows: int
    origin: float = 0.0
