"""The fast path for chunks whose messages all have the layout of earlier messages: whole chunks become columns.

The decoders derive a row layout per channel from its first messages. If a chunk matches the layouts, the thread that
has decompressed it writes its values directly into the columns; any other chunk is decoded message by message, after
which the layouts may change.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from cdtool.formats.mcap import uniform_kernel as kernel
from cdtool.messages.columns.copy_kernel import WORD, words_of
from cdtool.messages.columns.decoded_batch import ByteArray, IntArray
from cdtool.messages.fast_path import (
    Binding,
    ChunkRows,
    Destination,
    IsKnownDefinition,
    MessageTemplate,
    RowLayout,
    Words,
    WrittenRows,
)

# The fast path is given up when the chunks that did not match outnumber those that did by this number.
_MOST_MISMATCHES = 16
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
        claimed = _claimed_rows(tables.bindings, rows)
        if claimed is None:
            return None
        first, limits = claimed
        reached, last = first.copy(), np.zeros(len(first), np.uint64)
        times = np.array([kernel.NO_DATE, 0, 0], np.uint64)
        at, reason = 0, kernel.DEFINITION
        while reason == kernel.DEFINITION:
            at, reason = kernel.take_messages(
                words_of(content),
                np.ndarray((max(0, len(content) - 3),), np.float32, content, strides=(1,)),
                at,
                len(content),
                tables.slots,
                tables.bounds,
                tables.compared,
                tables.mask,
                tables.pattern,
                tables.numbers,
                tables.stamps,
                self._time,
                limits,
                reached,
                last,
                times,
            )
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
        for (channel, binding), begin, end, limit, stamp in zip(
            tables.bindings.items(), first.tolist(), reached.tolist(), limits.tolist(), last.tolist(), strict=True
        ):
            if binding is not None and end < limit:
                return None
            if end > begin:
                counts[channel] = end - begin
                if binding is not None:
                    parts[channel] = WrittenRows(binding[1], slice(begin, end), stamp < kernel.NO_DATE)
        return ChunkRows(counts, parts, (earliest, latest), first_time)


def _claimed_rows(bindings: Mapping[int, Binding], rows: Mapping[int, range]) -> tuple[Words, Words] | None:
    """Return first row and end of each channel's messages; None if its columns do not have as many free rows."""
    first, limits = np.zeros(len(bindings), np.uint64), np.zeros(len(bindings), np.uint64)
    for slot, (channel, binding) in enumerate(bindings.items()):
        if binding is not None and channel in rows:
            free = binding[1].free
            if rows[channel].start < free.start or rows[channel].stop > free.stop:
                return None
            first[slot], limits[slot] = rows[channel].start, rows[channel].stop
    return first, limits


def _tables(bindings: Mapping[int, Binding]) -> _Tables:
    slots = np.full(max(bindings, default=-1) + 1, -1, np.int64)
    bounds = np.zeros((len(bindings), kernel.BOUNDS), np.int64)
    stamps = np.zeros(len(bindings), np.uint64)
    templates: list[MessageTemplate] = []
    numbers: list[Words] = []
    compared = end = 0
    for slot, (channel, binding) in enumerate(bindings.items()):
        slots[channel] = slot
        if binding is None:
            continue
        layout, destination = binding
        stamps[slot] = destination.stamps.ctypes.data
        stamp = (-1, 0) if layout.stamp is None else (layout.stamp.at, layout.stamp.signed)
        numbers.append(_numbers(layout, destination))
        begin, others = end, end + int(np.count_nonzero(numbers[-1][:, kernel.KIND] == kernel.DOUBLE))
        end += len(numbers[-1])
        places = compared, compared + len(layout.template.compared), begin, others, end
        bounds[slot] = layout.template.shortest, layout.template.longest, *places, *stamp
        templates.append(layout.template)
        compared = places[1]
    return _Tables(
        dict(bindings),
        slots,
        bounds,
        np.concatenate([template.compared for template in templates]),
        np.concatenate([template.mask for template in templates]),
        np.concatenate([template.pattern for template in templates]),
        np.concatenate(numbers),
        stamps,
    )


def _numbers(layout: RowLayout, destination: Destination) -> Words:
    """Return the table of numbers (k, kernel.NUMBER), with float64 values first."""
    rows = []
    for numbers, table in zip(layout.fields, destination.tables, strict=True):
        size = np.dtype(numbers.dtype).itemsize
        kind = kernel.DOUBLE if numbers.dtype == "f8" else _KINDS[numbers.dtype[0]]
        for element, at in enumerate(numbers.at):
            word = min(at, layout.template.shortest - WORD)  # the last word must also be within the message
            bits = 8 * (WORD - size)
            address = table.ctypes.data + element * WORD
            rows.append((address, table.strides[0], at, kind, word, bits - 8 * (at - word), bits))
    rows.sort(key=lambda row: row[kernel.KIND] != kernel.DOUBLE)
    return np.array(rows, np.uint64).reshape(-1, kernel.NUMBER)
