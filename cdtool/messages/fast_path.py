"""What travels when the messages of a chunk are laid out as ones before them: rows that stand in columns already."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from cdtool.recording import FloatArray

Words = npt.NDArray[np.uint64]
# Whether a definition (opcode, content) is one that was read before.
Knows = Callable[[int, bytes], bool]


@dataclass(frozen=True, eq=False)
class Alike:
    """Messages of which what was found in one holds.

    They have from `shortest` to `longest` bytes and, in the words at the bytes `compared` (m,), the bits of `mask` as
    in `pattern`. All words begin at least 8 bytes before `shortest`.
    """

    shortest: int
    longest: int
    compared: Words
    mask: Words
    pattern: Words


@dataclass(frozen=True)
class Numbers:
    """The numbers of one field: the bytes of a message where they begin, in the column's order, and their type.

    `dtype` is numpy's code without byte order, `?` one byte that is not 0; `single`: the field is one number.
    """

    at: tuple[int, ...]
    dtype: str
    single: bool


@dataclass(frozen=True)
class Stamp:
    """A header's stamp: the byte where its seconds begin, nanoseconds (uint32) behind them; both have 4 bytes."""

    at: int
    signed: bool


@dataclass(frozen=True, eq=False)
class Recipe:
    """How alike messages become rows: the wanted fields in their order; `stamp` where the header's time is wanted."""

    alike: Alike
    fields: tuple[Numbers, ...]
    stamp: Stamp | None


@dataclass(frozen=True, eq=False)
class Destination:
    """The columns of a topic: `tables` (n,) or (n, k), one a field, and `stamps` (n,) in ns; n need not be the same.

    Rows before `first` hold messages.
    """

    tables: tuple[FloatArray, ...]
    stamps: npt.NDArray[Any]
    first: int

    @property
    def free(self) -> range:
        """The rows that may be written: those which all columns have."""
        return range(self.first, min(len(table) for table in (*self.tables, self.stamps)))


# None: of such a channel messages are counted only, or there is no recipe.
Bound = tuple[Recipe, Destination] | None


@dataclass(frozen=True, eq=False)
class Part:
    """Rows of a destination that hold the messages of one channel in one chunk; `ascending`: their stamps are so."""

    destination: Destination
    rows: slice
    ascending: bool

    @property
    def count(self) -> int:
        """Messages."""
        return int(self.rows.stop - self.rows.start)

    def before(self, other: Part) -> Part | None:
        """Both as one; None where the other one's rows are not the next ones."""
        if other.destination is not self.destination or other.rows.start != self.rows.stop:
            return None
        stamps, border = self.destination.stamps, self.rows.stop
        ascending = self.ascending and other.ascending and bool(stamps[border - 1] <= stamps[border])
        return Part(self.destination, slice(self.rows.start, other.rows.stop), ascending)


@dataclass(frozen=True)
class Taken:
    """A chunk: messages by channel's id, `parts` of those that are wanted, span and first of the log times [ns]."""

    counts: Mapping[int, int]
    parts: Mapping[int, Part]
    times: tuple[int, int]
    first_time: int


class Taker(Protocol):
    """Takes what is wanted out of a chunk's content; called by several threads at once."""

    @property
    def ready(self) -> bool:
        """There is something to go by."""
        ...

    def take(self, content: npt.NDArray[np.uint8], rows: Mapping[int, range], knows: Knows) -> Taken | None:
        """All messages of the chunk; None where one of them is not as expected, or a definition is not known.

        `rows` are, by channel's id, the numbers that its messages in this chunk have among all of the channel, as the
        summary foretells them.
        """
        ...
