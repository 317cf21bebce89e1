"""The fast path of reading: chunks whose messages all match a known layout are written straight into the columns.

These types pass between the container, which reads chunks, the decoders, which know the layouts, and the columns.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from cdtool.recording import FloatArray

Words = npt.NDArray[np.uint64]
# Whether a definition (opcode, content) has been read before.
IsKnownDefinition = Callable[[int, bytes], bool]


@dataclass(frozen=True, eq=False)
class MessageTemplate:
    """What messages must share with a decoded one so that its byte offsets apply to them.

    Their length is from `shortest` to `longest` bytes. In the words at the byte offsets `compared` (m,), the bits set
    in `mask` are as in `pattern`. All words begin at least 8 bytes before `shortest`.
    """

    shortest: int
    longest: int
    compared: Words
    mask: Words
    pattern: Words


@dataclass(frozen=True, eq=False)
class TokenTemplate:
    """The tokens of messages whose numbers are not at fixed bytes, in their order, and the texts that they refer to.

    The numbers of such messages are read into `values` float64. `tagged`: protobuf (tag_rows.py), else JSON
    (json_kernel.py).
    """

    tokens: npt.NDArray[np.int64]
    literals: npt.NDArray[np.uint8]
    values: int
    tagged: bool


@dataclass(frozen=True)
class FieldOffsets:
    """The numbers of one field: where they are in a message, in the order of the column, and their type.

    `at` are byte offsets in messages of a MessageTemplate, indices of values in those of a TokenTemplate. `dtype` is
    numpy's code without byte order; `?` is one byte that is not 0. `single`: the field is one number, not an array.
    `exact`: float64 represents every number of its type.
    """

    at: tuple[int, ...]
    dtype: str
    single: bool
    exact: bool


@dataclass(frozen=True)
class StampOffset:
    """A header's time stamp: the byte offset of its seconds, followed by nanoseconds (uint32); both have 4 bytes."""

    at: int
    signed: bool


@dataclass(frozen=True)
class StampValues:
    """A header's time stamp in messages of a TokenTemplate: the indices of its two values."""

    seconds: int
    nanoseconds: int


@dataclass(frozen=True, eq=False)
class FixedLayout:
    """How messages of a template become rows: the wanted fields in order, and the header's `stamp` if it is wanted."""

    template: MessageTemplate
    fields: tuple[FieldOffsets, ...]
    stamp: StampOffset | None


@dataclass(frozen=True, eq=False)
class TokenLayout:
    """The same for messages whose numbers are not at fixed bytes."""

    template: TokenTemplate
    fields: tuple[FieldOffsets, ...]
    stamp: StampValues | None


RowLayout = FixedLayout | TokenLayout


@dataclass(frozen=True, eq=False)
class Destination:
    """The columns of a topic: `tables` (n,) or (n, k), one per field, and `stamps` (n,) in ns; n may differ.

    Rows before `first` already contain messages.
    """

    tables: tuple[FloatArray, ...]
    stamps: npt.NDArray[Any]
    first: int

    @property
    def free(self) -> range:
        """The rows that may be written: those that all columns have."""
        return range(self.first, min(len(table) for table in (*self.tables, self.stamps)))


# The layout and the columns of a channel. None: its messages are only counted, or it has no layout.
Binding = tuple[RowLayout, Destination] | None


@dataclass(frozen=True, eq=False)
class WrittenRows:
    """The rows of a destination that contain one channel's messages of one chunk.

    `ascending`: their time stamps are in ascending order.
    """

    destination: Destination
    rows: slice
    ascending: bool

    @property
    def count(self) -> int:
        """The number of messages."""
        return int(self.rows.stop - self.rows.start)


def joined_rows(parts: Sequence[WrittenRows]) -> list[WrittenRows]:
    """Return the same rows; those that directly follow the ones before are one with them."""
    joined: list[WrittenRows] = []
    first, stop, ascending = 0, -1, True
    for number, part in enumerate(parts):
        rows = part.rows
        if number > first and (part.destination is not parts[first].destination or rows.start != stop):
            joined.append(_one(parts[first:number], ascending))
            first, ascending = number, True
        stop, ascending = rows.stop, ascending and part.ascending
    if parts:
        joined.append(_one(parts[first:], ascending))
    return joined


def _one(parts: Sequence[WrittenRows], ascending: bool) -> WrittenRows:
    """Return consecutive rows as one; `ascending`: the stamps of each part are in order."""
    destination, rows = parts[0].destination, slice(parts[0].rows.start, parts[-1].rows.stop)
    if ascending and len(parts) > 1:
        borders = np.array([part.rows.start for part in parts[1:]])
        ascending = bool((destination.stamps[borders - 1] <= destination.stamps[borders]).all())
    return WrittenRows(destination, rows, ascending)


@dataclass(frozen=True)
class ChunkRows:
    """A chunk read on the fast path: message counts and written rows by channel id, and log times [ns].

    `times` are the earliest and the latest log time, `first_time` is that of the first message.
    """

    counts: Mapping[int, int]
    parts: Mapping[int, WrittenRows]
    times: tuple[int, int]
    first_time: int


class ChunkReader(Protocol):
    """Reads chunks on the fast path; called by several threads at once."""

    @property
    def is_ready(self) -> bool:
        """True if layouts are known."""
        ...

    def read(
        self, content: npt.NDArray[np.uint8], rows: Mapping[int, range], is_known: IsKnownDefinition
    ) -> ChunkRows | None:
        """Return all messages of a chunk; None if one does not match its layout, or a definition is not known.

        `rows` are, by channel id, the expected row numbers of the chunk's messages among all messages of the channel,
        as computed from the counts in the file's summary.
        """
        ...
