"""JSON messages: any object that Python's json module reads (MCAP, "Well-known message encodings").

No schema is used. A field that all messages of a batch have, with the same names of elements and the same number of
them, is collected at once; otherwise the field language is applied to each message.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import chain
from typing import Any

import numpy as np

from cdtool.messages.batch import Batch
from cdtool.messages.decoded_batch import MOST_FIELDS, Decoder, Group, IntArray, UndecodableError
from cdtool.messages.fields import (
    Field,
    FieldMissingError,
    element_names,
    is_element_number,
    joint_order,
    numeric_fields,
)
from cdtool.recording import FloatArray

# The longest message that is read [bytes]: its objects may take twenty times as much memory.
_LONGEST = 16 << 20
Messages = dict[int, dict[str, Any]]  # by row


@dataclass
class JsonDecoder(Decoder):
    """Decoder of JSON."""

    _fields: dict[str, None] = field(default_factory=dict)
    _rows: IntArray = field(default_factory=lambda: np.empty(0, np.int64))  # of the objects of the last batch

    def fields(self, batch: Batch) -> list[str]:
        """Return every numeric field of the messages so far, in order of first appearance."""
        for message in _load(batch)[0].values():
            self._fields.update(dict.fromkeys(numeric_fields(message)))
            if len(self._fields) > MOST_FIELDS:
                raise UndecodableError(f"its messages have more than {MOST_FIELDS} different fields")
        return list(self._fields)

    def groups(self, batch: Batch) -> tuple[list[Group], dict[int, str]]:
        """Return the messages of a batch that are objects, and the reasons why the others are not, by row."""
        messages, reasons = _load(batch)
        self._rows = rows = np.array(list(messages), np.int64)
        return [_Single(rows[k : k + 1], message) for k, message in enumerate(messages.values())], reasons

    def of_field(self, groups: list[Group], field: Field, joints: Sequence[str]) -> list[Group]:
        """Return all messages as one group, if no message needs the rules of the field language."""
        table = _together([group.content for group in groups], field, joints)
        return groups if table is None else [_Together(self._rows, None, table)]


class _Single(Group):
    """One message."""

    def find(self, field: Field, joints: Sequence[str]) -> float | list[float] | FieldMissingError | None:
        try:
            return field.of(self.content, joints)
        except FieldMissingError as fault:
            return fault

    def read(self, found: Sequence[float]) -> FloatArray:
        return np.array([found], dtype=np.float64)


@dataclass(eq=False)
class _Together(Group):
    """All messages, for one field, whose numbers are in a `table` (rows, k)."""

    table: FloatArray

    def find(self, field: Field, joints: Sequence[str]) -> float | list[float]:  # noqa: ARG002  it is in the table
        return list(range(self.table.shape[1])) if field.whole else 0

    def read(self, found: Sequence[float]) -> FloatArray:  # noqa: ARG002  all of it
        return self.table


def _load(batch: Batch) -> tuple[Messages, dict[int, str]]:
    """Return the objects, and the reasons why the other messages are not, by row."""
    messages: Messages = {}
    reasons: dict[int, str] = {}
    content, load = batch.data.data, json.loads
    for row, (start, length) in enumerate(zip(batch.start.tolist(), batch.length.tolist(), strict=True)):
        try:
            if length > _LONGEST:
                raise ValueError(f"{length} bytes, more than {_LONGEST >> 20} MiB")
            value = load(bytes(content[start : start + length]))
        except Exception as fault:  # RecursionError too
            reasons[row] = " ".join(f"{type(fault).__name__}: {fault}".split())[:200]
            continue
        if isinstance(value, dict):
            messages[row] = value
        else:
            reasons[row] = "ValueError: the JSON is not an object"
    return messages, reasons


def _together(messages: Sequence[Any], field: Field, joints: Sequence[str]) -> FloatArray | None:
    """Return the numbers (n, k) of a field; None if a message needs the rules of the field language."""
    values = messages
    order = None
    try:
        for name, index in field.steps:
            parents, values = values, [value[name] for value in values]
            if index is None:
                continue
            if set(map(type, values)) != {list}:
                return None
            if index == ":":
                if joints:
                    order = joint_order(len(values[0]), _common_names(parents), joints)
                break
            element = int(index) if is_element_number(index) else _common_names(parents).index(index)
            values = [value[element] for value in values]
        numbers = list(chain.from_iterable(values)) if field.whole else values
        if field.whole and set(map(len, values)) != {len(values[0])}:
            return None
        if not set(map(type, numbers)) <= {int, float, bool}:
            return None
        table = np.array(numbers, dtype=np.float64).reshape(len(values), -1)
    except (LookupError, TypeError, ValueError, OverflowError, FieldMissingError):
        return None
    return table if order is None else table[:, order]


def _common_names(parents: Sequence[Any]) -> list[str]:
    """Return the names of the elements, if all messages have the same ones; raises ValueError."""
    first = parents[0].get("name")
    if any(parent.get("name") != first for parent in parents):
        raise ValueError
    return element_names(parents[0])
