"""What decoding a batch gives: numbers, and for each message and field why there is none."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from cdtool.messages.batch import Batch
from cdtool.messages.fast_path import Recipe
from cdtool.messages.fields import Field, FieldMissingError
from cdtool.recording import FloatArray

IntArray = npt.NDArray[np.int64]
ByteArray = npt.NDArray[np.uint8]

# `Gathered.status` of a message.
DECODED, DAMAGED = 0, 1
# `Picked.state` of a field in a message.
THERE, OTHER_JOINTS, ABSENT = 0, 1, 2


class UndecodableError(Exception):
    """There is no decoder for a channel; says why."""


@dataclass(frozen=True)
class Picked:
    """One wanted field over a batch of n messages.

    `values` (n,) or, for a whole array, (n, k): NaN where there is none; k is the width of the first row that is not
    empty, and rows of another width are NaN. `count` (n,) are the widths of a whole array's rows (0: empty, -1: not
    there), None for a field that is one number. `state` (n,): THERE, OTHER_JOINTS or ABSENT; `fault` says why the first
    ABSENT one is. `alike`: all are THERE, and no row has another width.
    """

    values: FloatArray
    count: IntArray | None
    state: ByteArray
    fault: FieldMissingError | None = None
    alike: bool = False


@dataclass(frozen=True)
class Gathered:
    """The wanted fields of a batch, `picked` in their order.

    `status` (n,) is DECODED or DAMAGED: such a message has no value in any field; `reason` is that of the first.
    `stamps` (n,) are the header's in ns, valid where `has_stamp`; both None where they were not asked for.
    """

    picked: tuple[Picked, ...]
    status: ByteArray
    reason: str = ""
    stamps: IntArray | None = None
    has_stamp: npt.NDArray[np.bool_] | None = None


class Decoder(Protocol):
    """Messages of one schema -> columns; it may be used for one batch after another, but not by two threads at once."""

    def fields(self, batch: Batch) -> list[str]:
        """Every numeric field but the header's stamp, as `wrench.force.z`, `position[:]`."""
        ...

    def gather(
        self, batch: Batch, wanted: Sequence[Field], joints: Sequence[str] = (), stamps: bool = False
    ) -> Gathered:
        """The wanted fields of all messages; whole arrays whose elements are named come in the order of `joints`."""
        ...

    def recipe(self, wanted: Sequence[Field], joints: Sequence[str] = (), stamps: bool = False) -> Recipe | None:
        """How more messages like the last ones become the same fields; None where they do not at once."""
        ...

    def names(self, batch: Batch, field: Field) -> list[str]:
        """The names that the first messages give to the elements of a field's array, sorted."""
        ...

    def element_names(self, batch: Batch) -> tuple[str, ...]:
        """The array of texts `name` of the first message, in its order; empty where there is none."""
        ...
