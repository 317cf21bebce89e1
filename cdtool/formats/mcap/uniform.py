"""The fast path for chunks whose messages all have the layout of earlier messages: whole chunks become columns.

The decoders derive a row layout per channel from its first messages. If a chunk matches the layouts, the thread that
has decompressed it writes its values directly into the columns; any other chunk is decoded message by message, after
which the layouts may change.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from cdtool.decimal_kernel import powers_of_five
from cdtool.formats.mcap import uniform_kernel as kernel
from cdtool.messages.columns.copy_kernel import WORD
from cdtool.messages.columns.decoded_batch import ByteArray, IntArray
from cdtool.messages.columns.tag_rows import AFTER, DEEPEST, LEVEL, LITERAL, TOKEN
from cdtool.messages.fast_path import (
    Binding,
    ChunkRows,
    Destination,
    FixedLayout,
    IsKnownDefinition,
    MessageTemplate,
    RowLayout,
    TokenLayout,
    Words,
    WrittenRows,
)
from cdtool.recording import FloatArray

# The fast path is given up when the chunks that did not match outnumber those that did by this number.
_MOST_MISMATCHES = 16
_TEXT_TOKEN, _TEXT_LITERAL = 4, 0  # the columns of tokens of JSON, and that of their first literal
_NONE = np.zeros(0, np.uint64)
_NO_VALUES, _NO_LEVELS = np.zeros(1), np.zeros((1, LEVEL), np.int64)
_KINDS = {"f": kernel.SINGLE, "i": kernel.SIGNED_INTEGER, "u": kernel.UNSIGNED_INTEGER, "?": kernel.TRUTH}


@dataclass(frozen=True, eq=False)
class _Tables:
    """The row layouts as arrays for the kernel; `bindings` keep references to the columns, whose addresses they use."""

    bindings: Mapping[int, Binding]
    slots: IntArray
    bounds: IntArray
    compared: Words
    mask: Words
    pattern: Words
    numbers: Words
    stamps: Words
    tags: IntArray
    texts: IntArray
    literals: ByteArray
    values: int

    @cached_property
    def free(self) -> dict[int, tuple[int, range]]:
        """The number of each channel with a layout, and the rows of its columns that may be written."""
        channels = enumerate(self.bindings.items())
        return {channel: (slot, binding[1].free) for slot, (channel, binding) in channels if binding is not None}

    @cached_property
    def arguments(self) -> tuple[Any, ...]:
        """The arguments of the kernel that it only reads, in its order."""
        layouts = (self.slots, self.bounds, self.compared, self.mask, self.pattern, self.numbers, self.stamps)
        return (*layouts, self.tags, self.texts, self.literals, powers_of_five())

    def overwritten(self) -> tuple[FloatArray, IntArray]:
        """Return the arrays that the kernel uses for messages with tokens; for fixed bytes they stay as they are."""
        if len(self.tags) or len(self.texts):
            return np.empty(self.values), np.empty((DEEPEST, LEVEL), np.int64)
        return _NO_VALUES, _NO_LEVELS


class UniformChunkReader:
    """A ChunkReader (fast_path.py) of uniform chunks; `publish`: times are publish times instead of log times."""

    def __init__(self, publish: bool = False) -> None:
        self._time = kernel.PUBLISH_TIME if publish else kernel.LOG_TIME
        self._tables: _Tables | None = None
        self._mismatches = 0

    def learn(self, bindings: Mapping[int, Binding]) -> None:
        """Set the row layouts of channels, by id; chunks with any other channel are not read."""
        given_up = self._mismatches >= _MOST_MISMATCHES or not any(bindings.values())
        self._tables = None if given_up else _tables(bindings)

    @property
    def is_ready(self) -> bool:
        """True if row layouts are known."""
        return self._tables is not None

    def read(self, content: ByteArray, rows: Mapping[int, range], is_known: IsKnownDefinition) -> ChunkRows | None:
        """Return all messages of a chunk; None if a message does not match, or if a definition is not known."""
        tables = self._tables
        if tables is None:
            return None
        chunk = self._read(tables, content, rows, is_known)
        self._mismatches = max(0, self._mismatches + (1 if chunk is None else -1))
        return chunk

    def _read(
        self, tables: _Tables, content: ByteArray, rows: Mapping[int, range], is_known: IsKnownDefinition
    ) -> ChunkRows | None:
        claimed = _claimed_rows(tables, rows)
        if claimed is None:
            return None
        first, limits = claimed
        progress = np.array((first, limits, [0] * len(first)), np.uint64)
        times = np.array((kernel.NO_DATE, 0, 0), np.uint64)
        arguments = (*tables.arguments, *tables.overwritten(), self._time, progress, times)
        at, reason, size = 0, kernel.DEFINITION, len(content)
        while reason == kernel.DEFINITION:
            at, reason = kernel.take_messages(content, at, size, *arguments)
            if reason == kernel.DEFINITION:
                begin = at + kernel.PREFIX
                opcode, end = int(content[at]), begin + int.from_bytes(content[at + 1 : begin].tobytes(), "little")
                if not is_known(opcode, content[begin:end].tobytes()):
                    return None
                at = end
        earliest, latest, first_time = times.tolist()
        if reason != kernel.DONE or earliest > latest or latest >= kernel.NO_DATE:
            return None
        counts, parts = {}, {}
        reached, _, latest_stamps = progress.tolist()
        for (channel, binding), begin, end, limit, stamp in zip(
            tables.bindings.items(), first, reached, limits, latest_stamps, strict=True
        ):
            if binding is not None and end < limit:
                return None
            if end > begin:
                counts[channel] = end - begin
                if binding is not None:
                    parts[channel] = WrittenRows(binding[1], slice(begin, end), stamp < kernel.NO_DATE)
        return ChunkRows(counts, parts, (earliest, latest), first_time)


def _claimed_rows(tables: _Tables, rows: Mapping[int, range]) -> tuple[list[int], list[int]] | None:
    """Return first row and end of each channel's messages; None if its columns do not have as many free rows."""
    first, limits = [0] * len(tables.bindings), [0] * len(tables.bindings)
    for channel, (slot, free) in tables.free.items():
        if channel in rows:
            wanted = rows[channel]
            if wanted.start < free.start or wanted.stop > free.stop:
                return None
            first[slot], limits[slot] = wanted.start, wanted.stop
    return first, limits


def _tables(bindings: Mapping[int, Binding]) -> _Tables:
    slots = np.full(max(bindings, default=-1) + 1, -1, np.int64)
    bounds = np.zeros((len(bindings), kernel.BOUNDS), np.int64)
    stamps = np.zeros(len(bindings), np.uint64)
    lists = _Lists()
    for slot, (channel, binding) in enumerate(bindings.items()):
        slots[channel] = slot
        if binding is not None:
            stamps[slot] = binding[1].stamps.ctypes.data
            bounds[slot] = lists.add(*binding)
    return _Tables(
        dict(bindings),
        slots,
        bounds,
        np.concatenate([_NONE, *(template.compared for template in lists.templates)]),
        np.concatenate([_NONE, *(template.mask for template in lists.templates)]),
        np.concatenate([_NONE, *(template.pattern for template in lists.templates)]),
        np.concatenate(lists.numbers),
        stamps,
        np.concatenate([np.zeros((0, TOKEN), np.int64), *lists.tags]),
        np.concatenate([np.zeros((0, _TEXT_TOKEN), np.int64), *lists.texts]),
        np.concatenate([np.zeros(0, np.uint8), *lists.literals]),
        lists.values,
    )


@dataclass
class _Lists:
    """The parts of the tables, channel after channel; `values` is the largest number of values of a message."""

    templates: list[MessageTemplate] = field(default_factory=list)
    numbers: list[Words] = field(default_factory=list)
    tags: list[IntArray] = field(default_factory=list)
    texts: list[IntArray] = field(default_factory=list)
    literals: list[ByteArray] = field(default_factory=list)
    values: int = 1

    def add(self, layout: RowLayout, destination: Destination) -> list[int]:
        """Add a channel, and return its row of bounds."""
        row = [0] * kernel.BOUNDS
        row[kernel.STAMP] = -1
        if isinstance(layout, FixedLayout):
            self._add_fixed(layout, row)
        else:
            self._add_tokens(layout, row)
        numbers = _numbers(layout, destination)
        row[kernel.NUMBERS] = sum(map(len, self.numbers))
        row[kernel.NUMBERS_END] = row[kernel.NUMBERS] + len(numbers)
        row[kernel.OTHERS] = row[kernel.NUMBERS] + int(np.count_nonzero(numbers[:, kernel.KIND] == kernel.DOUBLE))
        self.numbers.append(numbers)
        return row

    def _add_fixed(self, layout: FixedLayout, row: list[int]) -> None:
        template = layout.template
        row[kernel.FORM] = kernel.FIXED
        row[kernel.SHORTEST], row[kernel.LONGEST] = template.shortest, template.longest
        row[kernel.COMPARED] = sum(len(each.compared) for each in self.templates)
        row[kernel.COMPARED_END] = row[kernel.COMPARED] + len(template.compared)
        if layout.stamp is not None:
            row[kernel.STAMP], row[kernel.NANOSECONDS] = layout.stamp.at, int(layout.stamp.signed)
        self.templates.append(template)

    def _add_tokens(self, layout: TokenLayout, row: list[int]) -> None:
        template = layout.template
        row[kernel.FORM] = kernel.TAGGED if template.tagged else kernel.TEXT
        tables, literal = (self.tags, LITERAL) if template.tagged else (self.texts, _TEXT_LITERAL)
        row[kernel.TOKENS] = sum(map(len, tables))
        row[kernel.TOKENS_END] = row[kernel.TOKENS] + len(template.tokens)
        if layout.stamp is not None:
            row[kernel.STAMP], row[kernel.NANOSECONDS] = layout.stamp.seconds, layout.stamp.nanoseconds
        tokens = template.tokens.copy()
        tokens[:, literal] += sum(map(len, self.literals))
        if template.tagged:
            tokens[:, AFTER] += row[kernel.TOKENS]
        tables.append(tokens)
        self.literals.append(template.literals)
        self.values = max(self.values, template.values)


def _numbers(layout: RowLayout, destination: Destination) -> Words:
    """Return the table of numbers (k, kernel.NUMBER), with float64 values first."""
    rows: list[list[int]] = []
    for numbers, table in zip(layout.fields, destination.tables, strict=True):
        size = np.dtype(numbers.dtype).itemsize
        kind = kernel.DOUBLE if numbers.dtype == "f8" else _KINDS[numbers.dtype[0]]
        for element, place in enumerate(numbers.at):
            at, word = place * WORD, 0
            if isinstance(layout, FixedLayout):
                at, word = place, min(place, layout.template.shortest - WORD)  # a whole word within the message
            address = table.ctypes.data + element * WORD
            if element and kind == kernel.DOUBLE and at == rows[-1][kernel.BYTE] + rows[-1][kernel.COUNT] * WORD:
                rows[-1][kernel.COUNT] += 1
                continue
            bits = 8 * (WORD - size)
            rows.append([address, table.strides[0], at, 1, kind, word, bits - 8 * (at - word), bits])
    rows.sort(key=lambda row: row[kernel.KIND] != kernel.DOUBLE)
    return np.array([[each % 2**64 for each in row] for row in rows], np.uint64).reshape(-1, kernel.NUMBER)
