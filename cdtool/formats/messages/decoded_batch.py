"""The result of decoding a batch: numbers, and for each message and field why a number is missing."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from cdtool.base.arrays import FloatArray
from cdtool.formats.messages.batch import Batch
from cdtool.formats.messages.fields import Field, FieldMissingError, stamp_parts

IntArray = npt.NDArray[np.int64]
ByteArray = npt.NDArray[np.uint8]

# `DecodedBatch.status` of a message.
DECODED, DAMAGED = 0, 1
# `FieldValues.state` of a field in a message.
PRESENT, OTHER_JOINTS, ABSENT = 0, 1, 2
# The most fields of a topic in a survey: no recorder writes as many, but each is a column.
MOST_FIELDS = 4096


# What the field language finds in a message: a number, an array, or why it finds none.
Found = float | Sequence[float] | FieldMissingError | None


class UndecodableError(Exception):
    """A channel has no decoder; the message is the reason."""


@dataclass(frozen=True)
class FieldValues:
    """One wanted field over a batch of n messages.

    `values` are (n,) or, for a whole array, (n, k), with NaN for missing numbers; k is the width of the first row that
    is not empty, and rows of another width are NaN. `count` (n,) are the widths of a whole array's rows (0: empty, -1:
    absent); None for a field that is one number. `state` (n,) is PRESENT, OTHER_JOINTS or ABSENT; `fault` is the reason
    of the first ABSENT one.
    """

    values: FloatArray
    count: IntArray | None
    state: ByteArray
    fault: FieldMissingError | None = None


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


@dataclass(eq=False)
class MessageGroup(ABC):
    """Messages `rows` of a batch that one object of the field language describes.

    The object has a number, or in place of each number what `read` needs to return those of all messages.
    """

    rows: IntArray
    content: Any

    @abstractmethod
    def find(self, field: Field, joints: Sequence[str]) -> Found:
        """Return what the field language finds in the object."""

    @abstractmethod
    def read(self, found: Sequence[float]) -> FloatArray:
        """Return the numbers (rows, k) of k found ones; NaN for NaN."""


class Decoder(ABC):
    """Decodes messages of one schema, batch after batch."""

    @abstractmethod
    def fields(self, batch: Batch) -> list[str]:
        """Return every numeric field except the header's time stamp, as `wrench.force.z`, `position[:]`."""

    @abstractmethod
    def groups(self, batch: Batch) -> tuple[list[MessageGroup], dict[int, str]]:
        """Return the messages that can be decoded, and the reasons why the others cannot, by row."""

    def absent(self, field: Field) -> FieldMissingError | None:  # noqa: ARG002  unknown without a schema
        """Return why no message can have a field."""
        return None

    def contents(self, batch: Batch) -> list[dict[str, Any]]:
        """Return the messages of a batch that can be decoded, as objects of the field language."""
        return [group.content for group in sorted(self.groups(batch)[0], key=lambda group: int(group.rows[0]))]

    def decode(
        self,
        batch: Batch,
        wanted: Sequence[Field],
        joints: Sequence[str] = (),
        stamps: bool = False,
        longest: int | None = None,
    ) -> DecodedBatch:
        """Decode the wanted fields of all messages; whole arrays with named elements are in the order of `joints`.

        Of arrays that are longer than `longest`, as the bytes of an image, only the width is returned.
        """
        return self._values(len(batch), *self.groups(batch), wanted, joints, stamps, longest)

    def _values(
        self,
        n: int,
        groups: Sequence[MessageGroup],
        reasons: dict[int, str],
        wanted: Sequence[Field],
        joints: Sequence[str],
        stamps: bool,
        longest: int | None,
    ) -> DecodedBatch:
        """Return the wanted fields of the n messages of these groups, and of those that are damaged for a reason."""
        fields = tuple(
            absent_field(n, fault) if (fault := self.absent(each)) else field_values(n, groups, each, joints, longest)
            for each in wanted
        )
        status = np.zeros(n, np.uint8)
        status[list(reasons)] = DAMAGED
        reason = reasons[min(reasons)] if reasons else ""
        return DecodedBatch(fields, status, reason, *(_header_times(n, groups) if stamps else ()))


def absent_field(n: int, fault: FieldMissingError) -> FieldValues:
    """Return the values of a field that is absent in all of n messages."""
    return FieldValues(np.full(n, math.nan), None, np.full(n, ABSENT, np.uint8), fault)


def field_values(
    n: int, groups: Sequence[MessageGroup], field: Field, joints: Sequence[str], longest: int | None = None
) -> FieldValues:
    """Return one field of n messages; of arrays longer than `longest` only the width."""
    state, count = np.zeros(n, np.uint8), np.full(n, -1)
    parts: list[tuple[IntArray, FloatArray]] = []
    singles: dict[int, list[tuple[IntArray, FloatArray]]] = {}  # messages that are alone in their group, by width
    faults: dict[int, FieldMissingError] = {}
    for group in groups:
        found = group.find(field, joints)
        if isinstance(found, FieldMissingError):
            state[group.rows], faults[int(group.rows[0])] = ABSENT, found
        elif found is None:
            state[group.rows] = OTHER_JOINTS
        else:
            if isinstance(found, int | float):
                found = [] if field.whole else [found]
            count[group.rows] = len(found)
            if longest is not None and len(found) > longest:
                continue
            values = group.read(found)
            (parts if len(group.rows) > 1 else singles.setdefault(len(found), [])).append((group.rows, values))
    for same in singles.values():
        parts.append((np.concatenate([rows for rows, _ in same]), np.concatenate([values for _, values in same])))
    fault = faults[min(faults)] if faults else None
    wide = np.flatnonzero((count > 0) if longest is None else (count > 0) & (count <= longest))
    table = _joined(n, int(count[wide[0]]) if len(wide) else 1, parts)
    return FieldValues(table, count, state, fault) if field.whole else FieldValues(table[:, 0], None, state, fault)


def _joined(n: int, width: int, parts: Sequence[tuple[IntArray, FloatArray]]) -> FloatArray:
    if len(parts) == 1 and parts[0][1].shape == (n, width) and (np.diff(parts[0][0]) > 0).all():
        return parts[0][1]
    table = np.full((n, width), math.nan)
    for rows, values in parts:
        if values.shape[1] == width:
            table[rows] = values
    return table


def _header_times(n: int, groups: Sequence[MessageGroup]) -> tuple[IntArray, npt.NDArray[np.bool_]]:
    """Return the header stamps [ns], and which messages have one; float64 represents all integers below 2^53."""
    times, has_stamp = np.zeros(n, np.int64), np.zeros(n, np.bool_)
    for group in groups:
        try:
            parts = stamp_parts(group.content)
            pair = group.read([float(part) for part in parts]) if parts is not None else np.empty((0, 2))
        except (TypeError, ValueError, OverflowError):  # seconds or nanoseconds are not numbers
            continue
        # The largest stamp in ns that fits an int64.
        usable = (np.abs(pair[:, 0]) <= 9_223_372_035) & (np.abs(pair[:, 1]) <= 2**53)
        rows, whole = group.rows[: len(pair)][usable], pair[usable].astype(np.int64)
        times[rows], has_stamp[rows] = whole[:, 0] * 10**9 + whole[:, 1], True
    return times, has_stamp
