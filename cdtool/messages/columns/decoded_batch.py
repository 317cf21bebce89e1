"""The result of decoding a batch: numbers, and for each message and field why a number is missing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from cdtool.messages.batch import Batch
from cdtool.messages.fast_path import RowLayout
from cdtool.messages.fields import Field, FieldMissingError
from cdtool.recording import FloatArray

IntArray = npt.NDArray[np.int64]
ByteArray = npt.NDArray[np.uint8]

# `DecodedBatch.status` of a message.
DECODED, DAMAGED = 0, 1
# `FieldValues.state` of a field in a message.
PRESENT, OTHER_JOINTS, ABSENT = 0, 1, 2


class UndecodableError(Exception):
    """A channel has no decoder; the message is the reason."""


@dataclass(frozen=True)
class FieldValues:
    """One wanted field over a batch of n messages.

    `values` are (n,) or, for a whole array, (n, k), with NaN for missing numbers; k is the width of the first row that
    is not empty, and rows of another width are NaN. `count` (n,) are the widths of a whole array's rows (0: empty, -1:
    absent); None for a field that is one number. `state` (n,) is PRESENT, OTHER_JOINTS or ABSENT; `fault` is the reason
    of the first ABSENT one. `uniform`: all are PRESENT, and all rows have the same width.
    """

    values: FloatArray
    count: IntArray | None
    state: ByteArray
    fault: FieldMissingError | None = None
    uniform: bool = False


@dataclass(frozen=True)
class DecodedBatch:
    """The wanted fields of a batch, in their order.

    `status` (n,) is DECODED or DAMAGED; a damaged message has no value in any field, and `reason` is that of the first
    one. `stamps` (n,) are header stamps in ns, valid where `has_stamp`; both are None if they were not requested.
    """

    fields: tuple[FieldValues, ...]
    status: ByteArray
    reason: str = ""
    stamps: IntArray | None = None
    has_stamp: npt.NDArray[np.bool_] | None = None


class Decoder(Protocol):
    """Decodes messages of one schema, batch after batch; two threads must not use it at once."""

    def fields(self, batch: Batch) -> list[str]:
        """Return every numeric field except the header's time stamp, as `wrench.force.z`, `position[:]`."""
        ...

    def decode(
        self, batch: Batch, wanted: Sequence[Field], joints: Sequence[str] = (), stamps: bool = False
    ) -> DecodedBatch:
        """Decode the wanted fields of all messages; whole arrays with named elements are in the order of `joints`."""
        ...

    def row_layout(self, wanted: Sequence[Field], joints: Sequence[str] = (), stamps: bool = False) -> RowLayout | None:
        """Return the row layout of further messages like the last ones; None if they must be decoded in full."""
        ...

    def names(self, batch: Batch, field: Field) -> list[str]:
        """Return the element names of a field's array in the first messages, sorted."""
        ...

    def element_names(self, batch: Batch) -> tuple[str, ...]:
        """Return the string array `name` of the first message, in its order; empty if it has no such array."""
        ...
