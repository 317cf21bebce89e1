"""One wanted field of JSON messages, put together from messages of several shapes."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from cdtool.messages.columns.gathered import ABSENT, OTHER_JOINTS, THERE, IntArray, Picked
from cdtool.messages.columns.json_pattern import Resolved
from cdtool.messages.fields import Field, FieldMissingError
from cdtool.recording import FloatArray


@dataclass
class JsonColumn:
    """The field `wanted` of n messages, filled part by part."""

    wanted: Field
    joints: Sequence[str]
    n: int
    _parts: list[tuple[IntArray, FloatArray]] = field(default_factory=list)  # rows, (rows, width)
    _states: list[tuple[IntArray, int]] = field(default_factory=list)
    _first_absent: int | None = None

    def add(self, rows: IntArray, resolved: Resolved, values: Callable[[tuple[int, ...]], FloatArray]) -> None:
        """Messages of one shape: `values(places)` are their numbers."""
        if resolved.fault is not None:
            self._absent(rows)
        elif resolved.places:
            self._parts.append((rows, values(resolved.places)))
        elif resolved.other_joints:
            self._states.append((rows, OTHER_JOINTS))
        else:
            self._parts.append((rows, np.full((len(rows), 0 if self.wanted.whole else 1), math.nan)))

    def add_message(self, row: int, message: dict[str, Any]) -> None:
        """One message that Python has read."""
        rows = np.array([row])
        try:
            value = self.wanted.of(message, self.joints)
        except FieldMissingError:
            self._absent(rows)
            return
        if value is None:
            self._states.append((rows, OTHER_JOINTS))
        elif isinstance(value, list):
            self._parts.append((rows, np.array([value], dtype=np.float64)))
        else:
            self._parts.append((rows, np.full((1, 0 if self.wanted.whole else 1), value)))

    def _absent(self, rows: IntArray) -> None:
        self._states.append((rows, ABSENT))
        first = int(rows[0])
        self._first_absent = first if self._first_absent is None else min(first, self._first_absent)

    def picked(self, message: Callable[[int], dict[str, Any] | str]) -> Picked:
        """All of it; `message(i)` is what Python reads, for the words of the fault."""
        state = np.full(self.n, THERE, dtype=np.uint8)
        for rows, value in self._states:
            state[rows] = value
        fault = None
        if self._first_absent is not None:
            try:
                self.wanted.of(message(self._first_absent), self.joints)
            except FieldMissingError as absent:
                fault = absent
        if not self.wanted.whole:
            return Picked(self._table(1)[:, 0], None, state, fault)
        count = np.full(self.n, -1)
        for rows, values in self._parts:
            count[rows] = values.shape[1]
        wide = np.flatnonzero(count > 0)
        return Picked(self._table(int(count[wide[0]]) if len(wide) else 1), count, state, fault)

    def _table(self, width: int) -> FloatArray:
        if len(self._parts) == 1 and self._parts[0][1].shape == (self.n, width):
            return self._parts[0][1]
        table = np.full((self.n, width), math.nan)
        for rows, values in self._parts:
            if values.shape[1] == width:
                table[rows] = values
        return table
