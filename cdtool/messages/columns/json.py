"""JSON messages: any object that Python's json module reads (MCAP, "Well-known message encodings").

No schema is used. Messages of the same shape (json_shape.py) are decoded together. Python's json module decodes
messages of a unique shape and numbers that the kernel cannot convert: the values are the same by construction.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from cdtool.messages.batch import Batch
from cdtool.messages.columns import json_kernel as kernel
from cdtool.messages.columns.decoded_batch import (
    ABSENT,
    DAMAGED,
    DECODED,
    OTHER_JOINTS,
    PRESENT,
    ByteArray,
    DecodedBatch,
    FieldValues,
    IntArray,
)
from cdtool.messages.columns.json_shape import JsonShape, Resolved, learn_shape
from cdtool.messages.fast_path import FieldOffsets, RowLayout, StampValues, TokenLayout, TokenTemplate
from cdtool.messages.fields import Field, FieldMissingError, header_stamp, numeric_fields
from cdtool.recording import FloatArray

_MOST_SHAPES = 64
_NEW_SHAPES = 8  # learned from one batch; messages of further shapes are decoded singly
_MOST_TOKENS = 2000  # of a message on the fast path
_ENDS = np.isin(np.arange(256), list(b"}\0 \t\n\r"))
_LATEST = 9_223_372_035  # s: the largest time stamp in ns that fits an int64


@dataclass
class JsonColumn:
    """The values of the field `wanted` in n messages, filled part by part."""

    wanted: Field
    joints: Sequence[str]
    n: int
    _parts: list[tuple[IntArray, FloatArray]] = field(default_factory=list)  # rows, (rows, width)
    _states: list[tuple[IntArray, int]] = field(default_factory=list)
    _first_absent: int | None = None

    def add(self, rows: IntArray, resolved: Resolved, values: Callable[[tuple[int, ...]], FloatArray]) -> None:
        """Add messages of one shape; `values(indices)` returns their numbers."""
        if resolved.fault is not None:
            self._mark_absent(rows)
        elif resolved.indices:
            self._parts.append((rows, values(resolved.indices)))
        elif resolved.other_joints:
            self._states.append((rows, OTHER_JOINTS))
        else:
            self._parts.append((rows, np.full((len(rows), 0 if self.wanted.whole else 1), math.nan)))

    def add_message(self, row: int, message: dict[str, Any]) -> None:
        """Add one message that Python has decoded."""
        rows = np.array([row])
        try:
            value = self.wanted.of(message, self.joints)
        except FieldMissingError:
            self._mark_absent(rows)
            return
        if value is None:
            self._states.append((rows, OTHER_JOINTS))
        elif isinstance(value, list):
            self._parts.append((rows, np.array([value], dtype=np.float64)))
        else:
            self._parts.append((rows, np.full((1, 0 if self.wanted.whole else 1), value)))

    def _mark_absent(self, rows: IntArray) -> None:
        self._states.append((rows, ABSENT))
        first = int(rows[0])
        self._first_absent = first if self._first_absent is None else min(first, self._first_absent)

    def field_values(self, message: Callable[[int], dict[str, Any] | str]) -> FieldValues:
        """Return the values of all messages; `message(i)` is message i decoded by Python, for the text of the fault."""
        state = np.full(self.n, PRESENT, dtype=np.uint8)
        for rows, value in self._states:
            state[rows] = value
        fault = None
        if self._first_absent is not None:
            try:
                self.wanted.of(message(self._first_absent), self.joints)
            except FieldMissingError as absent:
                fault = absent
        if not self.wanted.whole:
            return FieldValues(self._table(1)[:, 0], None, state, fault)
        count = np.full(self.n, -1)
        for rows, values in self._parts:
            count[rows] = values.shape[1]
        wide = np.flatnonzero(count > 0)
        return FieldValues(self._table(int(count[wide[0]]) if len(wide) else 1), count, state, fault)

    def _table(self, width: int) -> FloatArray:
        if len(self._parts) == 1 and self._parts[0][1].shape == (self.n, width):
            return self._parts[0][1]
        table = np.full((self.n, width), math.nan)
        for rows, values in self._parts:
            if values.shape[1] == width:
                table[rows] = values
        return table


def json_decoder() -> JsonDecoder:
    """Return the decoder of JSON messages."""
    return JsonDecoder()


@dataclass
class JsonDecoder:
    """A Decoder (decoded_batch.py) for JSON; `_shapes` are the learned shapes, those of the last batch first."""

    _shapes: list[JsonShape] = field(default_factory=list)
    _fields: dict[str, None] = field(default_factory=dict)

    def fields(self, batch: Batch) -> list[str]:
        """Return every numeric field of the messages so far, in order of first appearance."""
        groups, single, _ = self._groups(batch, lambda _: np.zeros(0, dtype=np.int64))
        shapes = [(int(group.rows[0]), group.shape.fields()) for group in groups]
        shapes += [(row, list(numeric_fields(message))) for row, message in single.items() if isinstance(message, dict)]
        for _, names in sorted(shapes, key=lambda shape: shape[0]):
            self._fields.update(dict.fromkeys(names))
        return list(self._fields)

    def decode(
        self, batch: Batch, wanted: Sequence[Field], joints: Sequence[str] = (), stamps: bool = False
    ) -> DecodedBatch:
        """Decode the wanted fields of all messages."""
        groups, single, broken = self._groups(batch, lambda shape: _wanted_indices(shape, wanted, joints, stamps))
        columns = [JsonColumn(each, joints, len(batch)) for each in wanted]
        for group in groups:
            for each, column in zip(wanted, columns, strict=True):
                column.add(group.rows, group.shape.resolve(each, joints), group.of)
        status, reason = _damage(batch, single, broken)
        for column in columns:
            for row, message in single.items():
                if not isinstance(message, str):
                    column.add_message(row, message)
        field_values = tuple(column.field_values(partial(_load, batch)) for column in columns)
        if not stamps:
            return DecodedBatch(field_values, status, reason)
        times, has_stamp = np.zeros(len(batch), dtype=np.int64), np.zeros(len(batch), dtype=np.bool_)
        for group in groups:
            _stamp_group(group, batch, times, has_stamp)
        for row, message in single.items():
            _stamp_message(row, message, times, has_stamp)
        return DecodedBatch(field_values, status, reason, times, has_stamp)

    def row_layout(self, wanted: Sequence[Field], joints: Sequence[str] = (), stamps: bool = False) -> RowLayout | None:
        """Return the row layout of messages of the most frequent shape; None if a wanted number is missing in it."""
        if not self._shapes:
            return None
        shape = self._shapes[0]
        resolved = [shape.resolve(each, joints) for each in wanted]
        stamp = shape.stamp() if stamps else None
        if (stamps and stamp is None) or not all(each.indices and min(each.indices) >= 0 for each in resolved):
            return None
        indices = _wanted_indices(shape, wanted, joints, stamps)
        tokens = shape.tokens_with(indices)
        if len(tokens) > _MOST_TOKENS:
            return None
        fields = []
        for each, of_field in zip(wanted, resolved, strict=True):
            columns = tuple(np.searchsorted(indices, of_field.indices).tolist())
            fields.append(FieldOffsets(columns, "f8", single=not each.whole, exact=False))
        pair = None if stamp is None else StampValues(*np.searchsorted(indices, stamp).tolist())
        return TokenLayout(TokenTemplate(tokens, shape.literals, len(indices), tagged=False), tuple(fields), pair)

    def names(self, batch: Batch, field: Field) -> list[str]:
        """Return the element names of the field's array in the first ten messages, sorted."""
        all_names: set[str] = set()
        for row in range(min(10, len(batch))):
            value: Any = _load(batch, row)
            for name, _ in field.steps[:-1]:
                value = value.get(name) if isinstance(value, dict) else None
            names = value.get("name") if isinstance(value, dict) else None
            all_names.update(map(str, names if isinstance(names, list) else ()))
        return sorted(all_names)

    def element_names(self, batch: Batch) -> tuple[str, ...]:
        """Return the string array `name` of the first message, in its order; empty if it has no such array."""
        message = _load(batch, 0)
        names = message.get("name") if isinstance(message, dict) else None
        return tuple(map(str, names)) if isinstance(names, list) else ()

    def _groups(
        self, batch: Batch, indices: Callable[[JsonShape], IntArray]
    ) -> tuple[list[_Group], dict[int, dict[str, Any] | str], IntArray]:
        """Return the messages grouped by shape, those decoded by Python, and the rows of broken ones.

        A message decoded by Python is its object, or the reason why it is not an object.
        """
        groups: list[_Group] = []
        single: dict[int, dict[str, Any] | str] = {}
        remaining = np.arange(len(batch))
        for shape in list(self._shapes):
            remaining = self._group_matching(batch, shape, indices(shape), remaining, groups, single)
        learned = 0
        ends = _may_end(batch, remaining)
        remaining, broken = remaining[ends], remaining[~ends]
        while len(remaining):
            row = int(remaining[0])
            message = _load(batch, row)
            learned_shape = (
                learn_shape(_content(batch, row)) if isinstance(message, dict) and learned < _NEW_SHAPES else None
            )
            before = len(remaining)
            if learned_shape is not None:
                learned += 1
                self._shapes.append(learned_shape)
                remaining = self._group_matching(
                    batch, learned_shape, indices(learned_shape), remaining, groups, single
                )
            if len(remaining) == before:
                single[row] = message
                remaining = remaining[1:]
        if len(groups) > 1 or learned:
            used = [group.shape for group in sorted(groups, key=lambda group: -len(group.rows))]
            rest = [shape for shape in self._shapes if all(shape is not other for other in used)]
            self._shapes = (used + rest)[:_MOST_SHAPES]
        return groups, dict(sorted(single.items())), broken

    def _group_matching(
        self,
        batch: Batch,
        shape: JsonShape,
        indices: IntArray,
        remaining: IntArray,
        groups: list[_Group],
        single: dict[int, dict[str, Any] | str],
    ) -> IntArray:
        if not len(remaining):
            return remaining
        every = len(remaining) == len(batch)
        start, length = (batch.start, batch.length) if every else (batch.start[remaining], batch.length[remaining])
        matches, values = shape.read(batch.data, start, length, indices)
        good = matches == kernel.MATCHES
        if good.all():
            groups.append(_Group(shape, remaining, values, indices))
            return np.zeros(0, dtype=np.int64)
        if good.any():
            groups.append(_Group(shape, remaining[good], values[good], indices))
        for row in remaining[matches == kernel.UNCLEAR].tolist():
            single[row] = _load(batch, row)
        return np.asarray(remaining[matches == kernel.OTHER])


@dataclass(frozen=True)
class _Group:
    """Messages of one shape, and their `values` (rows, k) with the sorted `indices`."""

    shape: JsonShape
    rows: IntArray
    values: FloatArray
    indices: IntArray

    def of(self, indices: tuple[int, ...]) -> FloatArray:
        """Return the values with these indices (rows, len(indices)); index -1 is NaN."""
        wanted = np.array(indices)
        columns = np.searchsorted(self.indices, wanted)
        if wanted.min() >= 0 and (np.diff(columns) == 1).all():
            return self.values[:, columns[0] : columns[0] + len(columns)]
        table = np.full((len(self.rows), len(indices)), math.nan)
        table[:, wanted >= 0] = self.values[:, columns[wanted >= 0]]
        return table


def _wanted_indices(shape: JsonShape, wanted: Sequence[Field], joints: Sequence[str], stamps: bool) -> IntArray:
    found = {index for each in wanted for index in shape.resolve(each, joints).indices if index >= 0}
    if stamps:
        found.update(shape.stamp() or ())
    return np.array(sorted(found), dtype=np.int64)


def _may_end(batch: Batch, rows: IntArray) -> npt.NDArray[np.bool_]:
    """Return which messages end as an object can: with its brace, white space, or half of one in UTF-16."""
    length = batch.length[rows]
    last = batch.data[np.maximum(batch.start[rows] + length - 1, 0)] if len(rows) else np.zeros(0, np.uint8)
    ends: npt.NDArray[np.bool_] = (length > 0) & _ENDS[last]
    return ends


def _content(batch: Batch, row: int) -> bytes:
    begin = int(batch.start[row])
    return batch.data[begin : begin + int(batch.length[row])].tobytes()


def _damage(batch: Batch, single: Mapping[int, Any], broken: IntArray) -> tuple[ByteArray, str]:
    """Return which messages are damaged, and the first one's reason; strings in `single` are reasons by row."""
    status = np.full(len(batch), DECODED, dtype=np.uint8)
    faults = {row: message for row, message in single.items() if isinstance(message, str)}
    if len(broken):
        status[broken] = DAMAGED
        faults[int(broken[0])] = str(_load(batch, int(broken[0])))
    status[list(faults)] = DAMAGED
    return status, faults[min(faults)] if faults else ""


def _load(batch: Batch, row: int) -> dict[str, Any] | str:
    """Return a message's object, or the reason why it is not an object."""
    try:
        value = json.loads(_content(batch, row))
    except Exception as fault:  # RecursionError too
        return " ".join(f"{type(fault).__name__}: {fault}".split())[:200]
    return value if isinstance(value, dict) else "ValueError: the JSON is not an object"


def _stamp_group(group: _Group, batch: Batch, times: IntArray, has_stamp: npt.NDArray[np.bool_]) -> None:
    indices = group.shape.stamp()
    if indices is None:
        for row in group.rows.tolist() if group.shape.has_stamp() else ():
            _stamp_message(row, _load(batch, row), times, has_stamp)
        return
    both = group.of(indices)
    usable = (np.abs(both[:, 0]) <= _LATEST) & (np.abs(both[:, 1]) <= 2**53)
    whole = both[usable].astype(np.int64)
    times[group.rows[usable]] = whole[:, 0] * 10**9 + whole[:, 1]
    has_stamp[group.rows[usable]] = True


def _stamp_message(row: int, message: dict[str, Any] | str, times: IntArray, has_stamp: npt.NDArray[np.bool_]) -> None:
    try:
        stamp = header_stamp(message)
    except (TypeError, ValueError, OverflowError):  # seconds or nanoseconds are not numbers
        return
    if stamp is not None and abs(stamp) <= _LATEST * 10**9:
        times[row], has_stamp[row] = stamp, True
