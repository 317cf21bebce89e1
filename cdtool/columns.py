"""The content of a file before channels are mapped: columns of numbers with times, whole or in pieces."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cdtool.recording import FloatArray


def as_float64(values: npt.ArrayLike) -> FloatArray:
    """Return numbers of a file as a contiguous float64 array, without a copy if they are one.

    Some NaN of 32 bits, such as those of damaged bytes, raise the processor's flag for an invalid operation as they are
    converted: NumPy would warn of it.
    """
    with np.errstate(invalid="ignore"):
        return np.ascontiguousarray(values, dtype=np.float64)


@dataclass(frozen=True)
class Column:
    """One stream of numbers: `values` (n,) or (n, k) as in the file.

    `time` (n,) [s] if the format has a time per message, else None (in a table the clock is a column).
    """

    name: str
    values: FloatArray
    time: FloatArray | None = None
    unit: str | None = None


@dataclass(frozen=True)
class Piece:
    """Rows (`rows` = n) of the columns that share one clock, in the file's order.

    `time` (n,) [s] counts from the source's `origin` [s]; None for the columns of a table, whose clock is a column or
    unknown. `values` are (n,) or (n, k) by column; a column of this clock that is not among them has no value in these
    rows. Messages of a topic (`clock` is its name) are in order of time within a piece.
    """

    clock: str
    time: FloatArray | None
    values: Mapping[str, FloatArray]
    rows: int
    origin: float = 0.0
