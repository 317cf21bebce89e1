"""JSON messages: any object that Python's json module reads (MCAP, "Well-known message encodings").

No schema is used. A field that all messages of a batch have, with the same names of elements and the same number of
them, is collected at once; otherwise the field language is applied to each message.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.formats.messages.batch import Batch
from cdtool.formats.messages.decoded_batch import (
    MOST_FIELDS,
    DecodedBatch,
    Decoder,
    Found,
    MessageGroup,
    UndecodableError,
)
from cdtool.formats.messages.fields import (
    STAMPS,
    Field,
    FieldMissingError,
    element_names,
    is_element_number,
    joint_order,
    numeric_fields,
    parse_field,
)

# The longest message that is read [bytes]: its objects may take twenty times as much memory.
_LONGEST = 16 << 20
Messages = dict[int, dict[str, Any]]  # by row


@dataclass
class JsonDecoder(Decoder):
    """Decoder of JSON."""

    _fields: dict[str, None] = field(default_factory=dict)

    def fields(self, batch: Batch) -> list[str]:
        """Return every numeric field of the messages so far, in order of first appearance."""
        for message in _load(batch)[0].values():
            self._fields.update(dict.fromkeys(numeric_fields(message)))
            if len(self._fields) > MOST_FIELDS:
                raise UndecodableError(f"its messages have more than {MOST_FIELDS} different fields")
        return list(self._fields)

    def groups(self, batch: Batch) -> tuple[list[MessageGroup], dict[int, str]]:
        """Return the messages of a batch that are objects, and the reasons why the others are not, by row."""
        messages, reasons = _load(batch)
        rows = np.array(list(messages), np.int64)
        return [_Single(rows[k : k + 1], message) for k, message in enumerate(messages.values())], reasons

    def decode(
        self,
        batch: Batch,
        wanted: Sequence[Field],
        joints: Sequence[str] = (),
        stamps: bool = False,
        longest: int | None = None,
    ) -> DecodedBatch:
        """Decode all messages as one group, if none needs the rules of the field language."""
        try:
            alike = _alike(batch, wanted, joints, stamps)
        except Exception:  # a message that cannot be read, or is not like the first: the field language says which
            return super().decode(batch, wanted, joints, stamps, longest)
        return self._values(len(batch), [alike], {}, wanted, joints, stamps, longest)


class _Single(MessageGroup):
    """One message."""

    def find(self, field: Field, joints: Sequence[str]) -> Found:
        try:
            return field.of(self.content, joints)
        except FieldMissingError as fault:
            return fault

    def read(self, found: Sequence[float]) -> FloatArray:
        return np.array([found], dtype=np.float64)


@dataclass(eq=False)
class _AlikeJson(MessageGroup):
    """Messages with the same names and sizes at the wanted fields, whose numbers are in a `table` (rows, k)."""

    columns: dict[Field, list[float]]
    table: FloatArray

    def find(self, field: Field, joints: Sequence[str]) -> float | list[float]:  # noqa: ARG002  in their order
        return self.columns[field] if field.whole else self.columns[field][0]

    def read(self, found: Sequence[float]) -> FloatArray:
        return self.table[:, [int(column) for column in found]]


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


class _NumbersOf:
    """The numbers of one field, message after message, at the place where the first message has them.

    `add` raises LookupError, TypeError or ValueError for a message that has no such place, or other names of elements.
    """

    def __init__(self, field: Field, first: Any, joints: Sequence[str]) -> None:
        self.keys: list[str | int] = []
        self.width: int | None = None  # of a whole array
        self.order: list[int] | None = None
        self.parent: int | None = None  # the number of keys to the object with the names of the elements
        self.names: Any = None
        self.values: list[Any] = []
        value = first
        for name, index in field.steps:
            parent, value = value, value[name]
            if index is not None and (joints or not is_element_number(index)):
                self.parent, self.names = len(self.keys), parent.get("name")
            self.keys.append(name)
            if index == ":":
                self.width = len(value)
                self.order = joint_order(len(value), element_names(parent), joints)
                break
            if index is not None:
                self.keys.append(int(index) if is_element_number(index) else element_names(parent).index(index))
                value = value[self.keys[-1]]

    def add(self, message: Any) -> None:
        value = message
        for number, key in enumerate(self.keys):
            if number == self.parent and value.get("name") != self.names:
                raise ValueError
            value = value[key]
        if self.width is None:
            self.values.append(value)
        elif len(value) == self.width:
            self.values += value
        else:
            raise ValueError

    def table(self, rows: int) -> FloatArray:
        """Return the numbers (rows, k)."""
        if not set(map(type, self.values)) <= {int, float, bool}:
            raise TypeError
        table = np.array(self.values, np.float64).reshape(rows, -1)
        return table if self.order is None else table[:, self.order]


def _alike(batch: Batch, wanted: Sequence[Field], joints: Sequence[str], stamps: bool) -> _AlikeJson:
    """Read the wanted numbers message by message, so that no more than one message is held as objects.

    Raises what a message raises that is not like the first one.
    """
    content, decode = batch.data.data, json.JSONDecoder().raw_decode
    if int(batch.length.max(initial=0)) > _LONGEST:
        raise ValueError
    first, _ = decode(str(batch.payload(0), "utf-8"))
    names = next(pair for pair in STAMPS if {*pair} <= {*first["header"]["stamp"]}) if stamps else ()
    stamp = [parse_field(f"header.stamp.{name}", "") for name in names]
    numbers = [_NumbersOf(field, first, joints) for field in (*wanted, *stamp)]
    adding = [each.add for each in numbers]
    for start, stop in zip(batch.start.tolist(), (batch.start + batch.length).tolist(), strict=True):
        text = str(content[start:stop], "utf-8")
        message, end = decode(text)
        if end < len(text) and text[end:].strip(" \t\r\n"):
            raise ValueError
        for add in adding:
            add(message)
    tables = [each.table(len(batch)) for each in numbers]
    ends = np.cumsum([table.shape[1] for table in tables]).tolist()
    columns: list[list[float]] = [[*range(end - table.shape[1], end)] for end, table in zip(ends, tables, strict=True)]
    times = {name: found[0] for name, found in zip(names, columns[len(wanted) :], strict=True)}
    of_field = dict(zip(wanted, columns, strict=False))
    return _AlikeJson(np.arange(len(batch)), {"header": {"stamp": times}}, of_field, np.hstack(tables))
