"""Where a member lies in each message of a batch: what the encodings hand to the picking of fields."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Protocol

import numpy as np

from cdtool.messages.columns.decoded_batch import ByteArray, IntArray
from cdtool.recording import FloatArray

# A member of a message: names of members, each followed by an element's number where it is one of an array of messages.
Place = tuple[str | int, ...]
# Names and the messages that have them.
Group = tuple[tuple[str, ...], IntArray]


class Slot(Protocol):
    """One place in n messages; `count` (n,) is how many numbers or elements are there, -1: the place is not there."""

    @property
    def count(self) -> IntArray:
        """(n,)."""
        ...

    @property
    def uniform(self) -> int | None:
        """The count, where it is known to be the same in all messages."""
        ...

    def numbers(self, rows: IntArray | None, first: int, width: int) -> FloatArray:
        """(rows, width): the elements from `first` on of these messages (None: of all), which must have them."""
        ...


class Names(Protocol):
    """The array of texts beside an array: what its elements are called."""

    def alike(self, rows: IntArray) -> bool:
        """True if these messages all have the same names."""
        ...

    def of(self, row: int) -> tuple[str, ...]:
        """The names of one message; empty where there are none."""
        ...


@dataclass(frozen=True)
class Found:
    """The places of a batch: `status` (n,), the reason of the first message that is damaged, slots, names by place.

    `whole`: no message is damaged.
    """

    status: ByteArray
    reason: str
    slots: Mapping[Place, Slot]
    names: Mapping[Place, Names]
    whole: bool = False
    _groups: dict[Place, list[Group]] = field(default_factory=dict)

    @cached_property
    def rows(self) -> IntArray:
        """The messages that are whole."""
        return np.arange(len(self.status)) if self.whole else np.flatnonzero(self.status == 0)

    def groups(self, place: Place, rows: IntArray) -> list[Group]:
        """Messages by the names at `place`, in order of first appearance; nearly always one group."""
        if rows is not self.rows:
            return _grouped(self.names[place], rows)
        if place not in self._groups:
            self._groups[place] = _grouped(self.names[place], rows)
        return self._groups[place]


@dataclass(frozen=True)
class FixedNames:
    """The same names in all messages."""

    names: tuple[str, ...]

    def alike(self, rows: IntArray) -> bool:  # noqa: ARG002
        """True."""
        return True

    def of(self, row: int) -> tuple[str, ...]:  # noqa: ARG002
        """The names."""
        return self.names


def _grouped(names: Names, rows: IntArray) -> list[Group]:
    if not len(rows):
        return []
    if names.alike(rows):
        return [(names.of(int(rows[0])), rows)]
    groups: dict[tuple[str, ...], list[int]] = {}
    for row in rows.tolist():
        groups.setdefault(names.of(row), []).append(row)
    return [(each, np.array(members, dtype=np.int64)) for each, members in groups.items()]
