"""Messages of one layout are read together: their numbers are at the bytes where one of them has its numbers.

One message is walked in Python (sequential.py, protobuf.py). It becomes an object of the field language with an index
in place of each number. All messages with its length, and with its bytes where these determine the layout (lengths,
tags, names of elements), have their numbers at the same bytes: they are gathered, compared and viewed as numbers.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import islice
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from cdtool.base.arrays import FloatArray
from cdtool.formats.columns import as_float64
from cdtool.formats.messages.batch import Batch
from cdtool.formats.messages.decoded_batch import MOST_FIELDS, ByteArray, Decoder, Found, IntArray, MessageGroup
from cdtool.formats.messages.fields import Field, FieldMissingError
from cdtool.formats.messages.layout import Layout

# Layouts that others are compared with: writers have a few, such as one for each length of a varint.
_MOST_LAYOUTS = 64


class DamagedMessageError(Exception):
    """A message cannot be decoded; the text is the reason."""


class _Run(NamedTuple):
    """Numbers of one type next to one another, from the index `first` on, at the byte `at`.

    `size` is that of one of them; `code` is numpy's type, or the type of a varint.
    """

    first: int
    numbers: int
    at: int
    size: int
    code: str


class Example:
    """One message: its `content` with indices in place of numbers, and what others must share with it.

    The index 0 is that of a number that is not in the message and is 0.
    """

    def __init__(self, payload: bytes) -> None:
        self.payload = payload
        self.content: dict[str, Any] = {}
        self._runs = [_Run(0, 1, 0, 0, "zero")]
        self.shared: list[tuple[int, int, int]] = []
        self._words: tuple[npt.NDArray[Any], ...] = ()
        self._found: dict[tuple[Field, tuple[str, ...]], Found] = {}

    def numbers(self, at: int, count: int, code: str, size: int) -> range:
        """Add numbers, and return their indices."""
        last = self._runs[-1]
        first = last.first + last.numbers
        self._runs.append(_Run(first, count, at, size, code))
        return range(first, first + count)

    def share(self, at: int, size: int, bits: int = 0xFF) -> None:
        """Let all messages have the same bits in these bytes."""
        self.shared.append((at, size, bits))

    def find(self, field: Field, joints: tuple[str, ...]) -> Found:
        """Return the indices of a field's numbers, as the field language finds them in the content."""
        key = field, joints
        if key not in self._found:
            try:
                self._found[key] = field.of(self.content, joints)
            except FieldMissingError as fault:
                self._found[key] = fault
        return self._found[key]

    def alike(self, table: ByteArray) -> npt.NDArray[np.bool_]:
        """Return which messages of this length (n, length in whole words) have the same layout."""
        if not self._words:
            shared = np.zeros(table.shape[1], np.uint8)
            for at, size, bits in self.shared:
                shared[at : at + size] |= bits
            words = shared.view(np.uint64)
            used = np.flatnonzero(words)
            pattern = np.frombuffer(self.payload.ljust(len(shared), b"\0"), np.uint64)
            self._words = used, words[used], pattern[used] & words[used]
        used, mask, pattern = self._words
        alike: npt.NDArray[np.bool_] = ((table.view(np.uint64)[:, used] & mask) == pattern).all(axis=1)
        return alike

    def read(self, table: ByteArray, found: Sequence[float]) -> FloatArray:
        """Return the numbers with these indices (n, k) of messages alike (n, length in whole words)."""
        values = np.full((len(table), len(found)), np.nan)
        for column, index, count in _consecutive(found):
            while count:
                run = self._runs[bisect_right(self._runs, index, key=lambda run: run.first) - 1]
                some = min(count, run.first + run.numbers - index)
                at = run.at + (index - run.first) * run.size
                values[:, column : column + some] = _numbers(table[:, at : at + some * run.size], run)
                column, index, count = column + some, index + some, count - some
        return values


def _consecutive(found: Sequence[float]) -> Iterator[tuple[int, int, int]]:
    """Yield column, first index and number of consecutive indices; NaN is left out."""
    if isinstance(found, range):
        yield 0, found.start, len(found)
        return
    column = 0
    while column < len(found):
        end = column + 1
        while end < len(found) and found[end] == found[end - 1] + 1:
            end += 1
        if found[column] == found[column]:
            yield column, int(found[column]), end - column
        column = end


def _numbers(content: ByteArray, run: _Run) -> FloatArray | float:
    """Return the numbers (n, k) of bytes (n, k * size); an int64 beyond 2^53 is rounded to the nearest."""
    if run.code == "zero":
        return 0.0
    if run.code == "?":
        return as_float64(content != 0)
    if run.code[0] in "<>|":
        return as_float64(content.view(run.code))
    words = np.zeros(len(content), np.uint64)
    for k in range(run.size):  # a varint: seven bits per byte, the lowest first
        words |= (content[:, k] & np.uint8(0x7F)).astype(np.uint64) << np.uint64(7 * k)
    if run.code == "bool":
        return as_float64(words != 0)[:, None]
    if run.code.startswith("sint"):
        words = words & np.uint64(0xFFFFFFFF) if run.code == "sint32" else words
        words = (words >> np.uint64(1)) ^ (~(words & np.uint64(1)) + np.uint64(1))
    types = {"int32": np.int32, "sint32": np.int32, "enum": np.int32, "uint32": np.uint32, "uint64": np.uint64}
    return as_float64(words.astype(types.get(run.code, np.int64)))[:, None]


@dataclass(eq=False)
class _Alike(MessageGroup):
    """Messages with the layout of an example."""

    example: Example
    table: ByteArray

    def find(self, field: Field, joints: Sequence[str]) -> Found:
        return self.example.find(field, tuple(joints))

    def read(self, found: Sequence[float]) -> FloatArray:
        return self.example.read(self.table, found)


@dataclass
class SchemaDecoder(Decoder):
    """Decoder of messages whose schema defines every field; `walk` reads one of them."""

    layout: Layout
    walk: Callable[[Layout, bytes], Example]
    _known: list[Example] = field(default_factory=list)  # of the last batches, the last one first

    def fields(self, batch: Batch) -> list[str]:  # noqa: ARG002  (the schema defines them, not the messages)
        """Return every numeric field except the header's stamp, in schema order; arrays only if they may be short."""
        return list(islice(self.layout.numeric_names(), MOST_FIELDS))

    def absent(self, field: Field) -> FieldMissingError | None:
        """Return why no message can have a field."""
        return self.layout.missing(field)

    def groups(self, batch: Batch) -> tuple[list[MessageGroup], dict[int, str]]:
        """Return the messages that are alike, and the reasons for those that are damaged by row."""
        groups: list[MessageGroup] = []
        reasons: dict[int, str] = {}
        remaining = np.arange(len(batch))
        for example in self._known:
            remaining = _take(batch, example, remaining, groups)
        while len(remaining):
            row = int(remaining[0])
            try:
                example = self.walk(self.layout, batch.payload(row))
            except DamagedMessageError as fault:
                reasons[row], remaining = str(fault), remaining[1:]
                continue
            if len(groups) > _MOST_LAYOUTS:  # comparing would take longer than walking
                _take(batch, example, remaining[:1], groups)
                remaining = remaining[1:]
            else:
                remaining = _take(batch, example, remaining, groups)
        used = [group.example for group in groups if isinstance(group, _Alike)]
        self._known = (used + [each for each in self._known if each not in used])[:_MOST_LAYOUTS]
        return groups, reasons


def _take(batch: Batch, example: Example, remaining: IntArray, groups: list[MessageGroup]) -> IntArray:
    """Add the messages that are like the example to the groups, and return the others."""
    size = len(example.payload)
    fits: npt.NDArray[np.bool_] = batch.length[remaining] == size
    rows = remaining if fits.all() else remaining[fits]
    if not len(rows):
        return remaining
    data, start, width = batch.data, batch.start[rows], -(-size // 8) * 8
    if int(start.max()) + width > len(data):
        data = np.append(data, np.zeros(8, np.uint8))
    table = (
        np.lib.stride_tricks.sliding_window_view(data, width)[start] if width else np.empty((len(rows), 0), np.uint8)
    )
    alike = example.alike(table)
    if alike.all():
        groups.append(_Alike(rows, example.content, example, table))
        return remaining[~fits]
    if alike.any():
        groups.append(_Alike(rows[alike], example.content, example, table[alike]))
    fits[fits] = alike
    return remaining[~fits]
