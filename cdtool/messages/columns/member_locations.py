"""Where the members of a batch's messages are: what the encodings pass to the reading of field values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Protocol

import numpy as np

from cdtool.messages.columns.decoded_batch import ByteArray, IntArray
from cdtool.recording import FloatArray

# The path to a member of a message: names of members; after an array of messages the number of its element.
MemberPath = tuple[str | int, ...]
# Element names, and the rows of the messages that have them.
NameGroup = tuple[tuple[str, ...], IntArray]


class Slot(Protocol):
    """One member in n messages; `count` (n,) is its number of elements (1 for a number), -1 where it is absent."""

    @property
    def count(self) -> IntArray:
        """The number of elements (n,)."""
        ...

    @property
    def uniform(self) -> int | None:
        """The count, if it is known to be the same in all messages."""
        ...

    def numbers(self, rows: IntArray | None, first: int, width: int) -> FloatArray:
        """Return `width` elements from `first` on (rows, width) of these messages (None: of all); they must exist."""
        ...


class ElementNames(Protocol):
    """The string array that names the elements of the arrays next to it."""

    def are_equal(self, rows: IntArray) -> bool:
        """Return True if these messages all have the same names."""
        ...

    def of(self, row: int) -> tuple[str, ...]:
        """Return the names of one message; empty if it has none."""
        ...


@dataclass(frozen=True)
class MemberLocations:
    """The located members of a batch: a slot or names by path.

    `status` (n,) is 0 or the kind of damage, `reason` that of the first damaged message; `intact`: none is damaged.
    """

    status: ByteArray
    reason: str
    slots: Mapping[MemberPath, Slot]
    names: Mapping[MemberPath, ElementNames]
    intact: bool = False
    _groups: dict[MemberPath, list[NameGroup]] = field(default_factory=dict)

    @cached_property
    def rows(self) -> IntArray:
        """The messages that are not damaged."""
        return np.arange(len(self.status)) if self.intact else np.flatnonzero(self.status == 0)

    def groups(self, path: MemberPath, rows: IntArray) -> list[NameGroup]:
        """Return messages grouped by the names at `path`, in order of first appearance; nearly always one group."""
        if rows is not self.rows:
            return _group_by_names(self.names[path], rows)
        if path not in self._groups:
            self._groups[path] = _group_by_names(self.names[path], rows)
        return self._groups[path]


@dataclass(frozen=True)
class FixedElementNames:
    """The same names in all messages."""

    names: tuple[str, ...]

    def are_equal(self, rows: IntArray) -> bool:  # noqa: ARG002
        """Return True."""
        return True

    def of(self, row: int) -> tuple[str, ...]:  # noqa: ARG002
        """Return the names."""
        return self.names


def _group_by_names(names: ElementNames, rows: IntArray) -> list[NameGroup]:
    if not len(rows):
        return []
    if names.are_equal(rows):
        return [(names.of(int(rows[0])), rows)]
    groups: dict[tuple[str, ...], list[int]] = {}
    for row in rows.tolist():
        groups.setdefault(names.of(row), []).append(row)
    return [(each, np.array(members, dtype=np.int64)) for each, members in groups.items()]
