"""JSON messages: whatever object Python's json reads (MCAP, "Well-known message encodings").

A schema is not asked for. Messages of the same shape (json_shape.py) are read together; those of a shape of their
own, and numbers that need more care, are read by Python's json: the same values by construction.
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
    THERE,
    ByteArray,
    Gathered,
    IntArray,
    Picked,
)
from cdtool.messages.columns.json_shape import JsonPattern, Resolved, pattern_of
from cdtool.messages.fields import Field, FieldMissingError, header_stamp, numeric_fields
from cdtool.recording import FloatArray

_MOST_PATTERNS = 64
_NEW_PATTERNS = 8  # of one batch: more shapes than that are read one by one
_ENDS = np.isin(np.arange(256), list(b"}\0 \t\n\r"))
_LATEST = 9_223_372_035  # s: an int64 of ns holds no more


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


def json_decoder() -> JsonDecoder:
    """The decoder of JSON messages."""
    return JsonDecoder()


@dataclass
class JsonDecoder:
    """A Decoder (decoded_batch.py) for JSON; `_patterns` are the shapes seen, the last one that fitted first."""

    _patterns: list[JsonPattern] = field(default_factory=list)
    _fields: dict[str, None] = field(default_factory=dict)

    def fields(self, batch: Batch) -> list[str]:
        """Every numeric field of the messages so far, in order of first appearance."""
        groups, alone, _ = self._groups(batch, lambda _: np.zeros(0, dtype=np.int64))
        shapes = [(int(group.rows[0]), group.pattern.fields()) for group in groups]
        shapes += [(row, list(numeric_fields(message))) for row, message in alone.items() if isinstance(message, dict)]
        for _, names in sorted(shapes, key=lambda shape: shape[0]):
            self._fields.update(dict.fromkeys(names))
        return list(self._fields)

    def gather(
        self, batch: Batch, wanted: Sequence[Field], joints: Sequence[str] = (), stamps: bool = False
    ) -> Gathered:
        """The wanted fields of all messages."""
        groups, alone, broken = self._groups(batch, lambda pattern: _places(pattern, wanted, joints, stamps))
        columns = [JsonColumn(each, joints, len(batch)) for each in wanted]
        for group in groups:
            for each, column in zip(wanted, columns, strict=True):
                column.add(group.rows, group.pattern.resolve(each, joints), group.of)
        status, reason = _damage(batch, alone, broken)
        for column in columns:
            for row, message in alone.items():
                if not isinstance(message, str):
                    column.add_message(row, message)
        picked = tuple(column.picked(partial(_loaded, batch)) for column in columns)
        if not stamps:
            return Gathered(picked, status, reason)
        times, there = np.zeros(len(batch), dtype=np.int64), np.zeros(len(batch), dtype=np.bool_)
        for group in groups:
            _stamp_group(group, batch, times, there)
        for row, message in alone.items():
            _stamp_message(row, message, times, there)
        return Gathered(picked, status, reason, times, there)

    def recipe(self, wanted: Sequence[Field], joints: Sequence[str] = (), stamps: bool = False) -> None:
        """None: numbers are written in different lengths."""

    def names(self, batch: Batch, field: Field) -> list[str]:
        """What the first ten messages call the elements of the field's array, sorted."""
        found: set[str] = set()
        for row in range(min(10, len(batch))):
            value: Any = _loaded(batch, row)
            for name, _ in field.steps[:-1]:
                value = value.get(name) if isinstance(value, dict) else None
            names = value.get("name") if isinstance(value, dict) else None
            found.update(map(str, names if isinstance(names, list) else ()))
        return sorted(found)

    def element_names(self, batch: Batch) -> tuple[str, ...]:
        """The array of texts `name` of the first message, in its order; empty where there is none."""
        message = _loaded(batch, 0)
        names = message.get("name") if isinstance(message, dict) else None
        return tuple(map(str, names)) if isinstance(names, list) else ()

    def _groups(
        self, batch: Batch, places: Callable[[JsonPattern], IntArray]
    ) -> tuple[list[_Group], dict[int, dict[str, Any] | str], IntArray]:
        """The messages by their shapes, those that Python has read (the object, or why it is none), and broken ones."""
        groups: list[_Group] = []
        alone: dict[int, dict[str, Any] | str] = {}
        left = np.arange(len(batch))
        for pattern in list(self._patterns):
            left = self._fitted(batch, pattern, places(pattern), left, groups, alone)
        learnt = 0
        ends = _may_end(batch, left)
        left, broken = left[ends], left[~ends]
        while len(left):
            row = int(left[0])
            message = _loaded(batch, row)
            pattern_or_none = (
                pattern_of(_content(batch, row)) if isinstance(message, dict) and learnt < _NEW_PATTERNS else None
            )
            before = len(left)
            if pattern_or_none is not None:
                learnt += 1
                self._patterns.append(pattern_or_none)
                left = self._fitted(batch, pattern_or_none, places(pattern_or_none), left, groups, alone)
            if len(left) == before:
                alone[row] = message
                left = left[1:]
        if len(groups) > 1 or learnt:
            used = [group.pattern for group in sorted(groups, key=lambda group: -len(group.rows))]
            rest = [pattern for pattern in self._patterns if all(pattern is not other for other in used)]
            self._patterns = (used + rest)[:_MOST_PATTERNS]
        return groups, dict(sorted(alone.items())), broken

    def _fitted(
        self,
        batch: Batch,
        pattern: JsonPattern,
        places: IntArray,
        left: IntArray,
        groups: list[_Group],
        alone: dict[int, dict[str, Any] | str],
    ) -> IntArray:
        if not len(left):
            return left
        every = len(left) == len(batch)
        start, length = (batch.start, batch.length) if every else (batch.start[left], batch.length[left])
        fits, values = pattern.read(batch.data, start, length, places)
        good = fits == kernel.FITS
        if good.all():
            groups.append(_Group(pattern, left, values, places))
            return np.zeros(0, dtype=np.int64)
        if good.any():
            groups.append(_Group(pattern, left[good], values[good], places))
        for row in left[fits == kernel.UNCLEAR].tolist():
            alone[row] = _loaded(batch, row)
        return np.asarray(left[fits == kernel.OTHER])


@dataclass(frozen=True)
class _Group:
    """Messages of one shape, and their `values` (rows, k) at the sorted `places`."""

    pattern: JsonPattern
    rows: IntArray
    values: FloatArray
    places: IntArray

    def of(self, places: tuple[int, ...]) -> FloatArray:
        """(rows, len(places)); a place of -1 is NaN."""
        wanted = np.array(places)
        columns = np.searchsorted(self.places, wanted)
        if wanted.min() >= 0 and (np.diff(columns) == 1).all():
            return self.values[:, columns[0] : columns[0] + len(columns)]
        table = np.full((len(self.rows), len(places)), math.nan)
        table[:, wanted >= 0] = self.values[:, columns[wanted >= 0]]
        return table


def _places(pattern: JsonPattern, wanted: Sequence[Field], joints: Sequence[str], stamps: bool) -> IntArray:
    found = {place for each in wanted for place in pattern.resolve(each, joints).places if place >= 0}
    if stamps:
        found.update(pattern.stamp() or ())
    return np.array(sorted(found), dtype=np.int64)


def _may_end(batch: Batch, rows: IntArray) -> npt.NDArray[np.bool_]:
    """Which messages end as an object can: with its brace, white space, or half of one in UTF-16."""
    length = batch.length[rows]
    last = batch.data[np.maximum(batch.start[rows] + length - 1, 0)] if len(rows) else np.zeros(0, np.uint8)
    ends: npt.NDArray[np.bool_] = (length > 0) & _ENDS[last]
    return ends


def _content(batch: Batch, row: int) -> bytes:
    begin = int(batch.start[row])
    return batch.data[begin : begin + int(batch.length[row])].tobytes()


def _damage(batch: Batch, alone: Mapping[int, Any], broken: IntArray) -> tuple[ByteArray, str]:
    """Return which messages are damaged, and why the first of them is: `alone` are its texts by row."""
    status = np.full(len(batch), DECODED, dtype=np.uint8)
    faults = {row: message for row, message in alone.items() if isinstance(message, str)}
    if len(broken):
        status[broken] = DAMAGED
        faults[int(broken[0])] = str(_loaded(batch, int(broken[0])))
    status[list(faults)] = DAMAGED
    return status, faults[min(faults)] if faults else ""


def _loaded(batch: Batch, row: int) -> dict[str, Any] | str:
    """The object, or why there is none."""
    try:
        value = json.loads(_content(batch, row))
    except Exception as fault:  # RecursionError too
        return " ".join(f"{type(fault).__name__}: {fault}".split())[:200]
    return value if isinstance(value, dict) else "ValueError: the JSON is not an object"


def _stamp_group(group: _Group, batch: Batch, times: IntArray, there: npt.NDArray[np.bool_]) -> None:
    places = group.pattern.stamp()
    if places is None:
        for row in group.rows.tolist() if group.pattern.has_stamp() else ():
            _stamp_message(row, _loaded(batch, row), times, there)
        return
    both = group.of(places)
    usable = (np.abs(both[:, 0]) <= _LATEST) & (np.abs(both[:, 1]) <= 2**53)
    whole = both[usable].astype(np.int64)
    times[group.rows[usable]] = whole[:, 0] * 10**9 + whole[:, 1]
    there[group.rows[usable]] = True


def _stamp_message(row: int, message: dict[str, Any] | str, times: IntArray, there: npt.NDArray[np.bool_]) -> None:
    try:
        stamp = header_stamp(message)
    except (TypeError, ValueError, OverflowError):  # no numbers
        return
    if stamp is not None and abs(stamp) <= _LATEST * 10**9:
        times[row], there[row] = stamp, True
