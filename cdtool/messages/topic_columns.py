"""The wanted fields of a topic, collected batch by batch into columns in memory.

Arrays grow by batches, without a copy as long as the expected length suffices. The fast path writes rows into them.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from cdtool.columns import Column
from cdtool.findings import Finding
from cdtool.large_integers import rounded_integers, rounding_finding
from cdtool.messages.batch import Batch
from cdtool.messages.column_memory import ColumnMemory
from cdtool.messages.fast_path import Binding, Destination, WrittenRows, joined_rows
from cdtool.messages.stream import Stream
from cdtool.messages.topic import Topic, Values, sort_times
from cdtool.recording import FloatArray

# An expected length is only a hint, as the file may be damaged: at most this much is reserved [bytes].
_MOST_RESERVED = 1 << 28
# A shared array is replaced at most this often, as each time it is copied.
_MOST_REPLACED = 16


class Rows:
    """Values (n,) or (n, k), appended batch by batch; rows whose width differs from the first batch's k are NaN.

    Other threads may write into rows after the last one, each into rows of its own: `share` returns the array for them,
    and `confirm` adds the rows written. As a thread may still be writing, the array is copied before the next `append`.
    """

    def __init__(self, expected: int, dtype: npt.DTypeLike = np.float64, memory: ColumnMemory | None = None) -> None:
        self._expected = expected
        self._memory = memory or ColumnMemory()
        self._table: npt.NDArray[Any] | None = None
        self._dtype = dtype
        self._shared = False
        self._replaced = 0
        self.count = 0

    def append(self, values: npt.NDArray[Any]) -> None:
        """Append the rows of a batch."""
        if self._table is None:
            width = int(np.prod(values.shape[1:])) * values.itemsize  # bytes of a row
            rows = min(self._expected, _MOST_RESERVED // max(1, width))
            self._table = self._memory.empty((rows, *values.shape[1:]), self._dtype)
        end = self.count + len(values)
        if end > len(self._table) or self._shared:
            rows = max(end, 2 * len(self._table)) if end > len(self._table) else len(self._table)
            grown = np.empty((rows, *self._table.shape[1:]), self._dtype)  # the old array is released at once
            grown[: self.count] = self._table[: self.count]
            self._replaced += self._shared
            self._table, self._shared = grown, False
        fits = values.shape[1:] == self._table.shape[1:]
        self._table[self.count : end] = values if fits else np.nan
        self.count = end

    def share(self, shape: tuple[int, ...]) -> npt.NDArray[Any] | None:
        """Return the array for other threads to write rows of `shape` into; None if its rows have another shape."""
        if self._table is None or self._table.shape[1:] != shape or self._replaced > _MOST_REPLACED:
            return None
        self._shared = True
        return self._table

    def confirm(self, table: npt.NDArray[Any], rows: slice) -> None:
        """Add rows of a shared array, which may have been replaced since."""
        present = self._table
        if present is None or rows.start != self.count or rows.stop > len(present):
            self.append(table[rows])
            return
        if table is not present:  # no other thread writes into these rows of the present array
            present[rows] = table[rows]
        self.count = int(rows.stop)

    def widen(self, width: int) -> None:
        """Set the width of rows that have all been empty so far."""
        if self._table is not None and self._table.shape[1:] != (width,):
            self._table = np.full((len(self._table), width), np.nan)

    @property
    def values(self) -> npt.NDArray[Any]:
        """All rows so far."""
        return self._table[: self.count] if self._table is not None else np.empty(0, self._dtype)


class _FieldRows:
    """One field's values of all decoded messages; `elsewhere` marks messages that name other joints only."""

    def __init__(self, expected: int, memory: ColumnMemory) -> None:
        self.rows = Rows(expected, memory=memory)
        self.elsewhere: Rows | None = None
        self.exact = False  # float64 represents every number of its type

    def append(self, count: int, values: Values, width: int | None) -> None:
        """Append a batch's rows, whose arrays have this width; None: all arrays so far are empty."""
        rows, other = values
        if width is not None:
            self.rows.widen(width)
        self.rows.append(np.full((count, 1), np.nan) if rows is None else rows)
        if other is not None and self.elsewhere is None:
            self.elsewhere = Rows(0, np.bool_)
            self.elsewhere.append(np.zeros(self.rows.count - count, np.bool_))
        self.mark(count, other)

    def mark(self, count: int, other: npt.NDArray[np.bool_] | None = None) -> None:
        """Append which of the next rows name other joints only; None: none of them does."""
        if self.elsewhere is not None:
            self.elsewhere.append(np.zeros(count, np.bool_) if other is None else other)


class TopicColumns(Topic):
    """A topic whose columns are in `memory`; `expected` is an estimate of the number of messages by topic."""

    def __init__(
        self,
        path: Path,
        topic: str,
        texts: Iterable[str],
        clock: str,
        joints: Sequence[str],
        expected: Mapping[str, int],
        memory: ColumnMemory | None = None,
    ) -> None:
        super().__init__(path, topic, texts, clock, joints)
        self._memory = memory or ColumnMemory()
        self._rows = {text: _FieldRows(expected.get(topic, 0), self._memory) for text in self.fields}
        # A header's stamp may be before 1970.
        self._stamps = Rows(expected.get(topic, 0), np.int64 if self.clock == "header" else np.uint64, self._memory)
        self._clock: tuple[FloatArray, npt.NDArray[np.intp] | None] | None = None

    def add(self, stream: Stream, batch: Batch) -> None:
        """Decode a batch and append its rows; raises RecordingError if a field or the header's stamp is missing."""
        decoded = self.decode(stream, batch)
        if decoded is not None:
            stamps, values = decoded
            self._stamps.append(stamps)
            for text, rows in self._rows.items():
                rows.append(len(stamps), values[text], self.fields[text].width)

    def binding(self, channel: int) -> Binding:
        """Return layout and columns for the fast path of a channel (by id); None if it cannot be used."""
        row_layout = self.decoders.row_layout(channel, self.wanted, self.joints, self.clock == "header")
        if row_layout is None:
            return None
        stamps, tables = self._stamps.share(()), []
        for rows, numbers in zip(self._rows.values(), row_layout.fields, strict=True):
            tables.append(rows.rows.share(() if numbers.single else (len(numbers.at),)))
            rows.exact = numbers.exact
        shared = tuple(table for table in tables if table is not None)
        if stamps is None or len(shared) < len(tables) or any(each.elsewhere for each in self.fields.values()):
            return None
        return row_layout, Destination(shared, stamps, self._stamps.count)

    def confirm(self, stream: Stream, parts: Sequence[WrittenRows]) -> None:
        """Add messages that the fast path wrote into rows, using the result of `binding`."""
        for part in joined_rows(parts):
            self.decoders.decoded += part.count
            if self.first_stamp is None:
                self.first_stamp = int(part.destination.stamps[part.rows.start])
            self._stamps.confirm(part.destination.stamps, part.rows)
            self.orders.add(stream.id, part.destination.stamps[part.rows], part.ascending)
            for (text, rows), table in zip(self._rows.items(), part.destination.tables, strict=True):
                self.fields[text].count(part.count, Counter(dict.fromkeys(table.shape[1:], part.count)))
                rows.rows.confirm(table, part.rows)
                rows.mark(part.count)

    def column(self, text: str) -> tuple[Column, list[Finding]]:
        """Return a field as a column in the order of its times, and its findings; raises RecordingError."""
        column, findings = super().column(text)
        rows = self._rows[text]
        values = rows.rows.values
        rounded = 0 if rows.exact else rounded_integers(values)
        if rows.elsewhere is not None:
            present = ~rows.elsewhere.values
            values, (time, order) = values[present], sort_times(self._stamps.values[present], self.origin)
        else:
            if self._clock is None:
                self._clock = sort_times(self._stamps.values, self.origin, self._memory)
            time, order = self._clock
        column = replace(column, values=values if order is None else values[order], time=time)
        return column, [*findings, *rounding_finding(column.name, rounded)]
