"""The wanted fields of a topic, collected batch by batch into columns in memory.

Arrays grow by batches, without a copy as long as the expected length suffices.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from cdtool.columns import Column
from cdtool.findings import Finding
from cdtool.large_integers import rounded_integers, rounding_finding
from cdtool.messages.batch import Batch, Stream
from cdtool.messages.topic import Topic, Values, sort_times
from cdtool.recording import FloatArray

# An expected length is only a hint, as the file may be damaged: at most this much is reserved [bytes].
_MOST_RESERVED = 1 << 28


class Rows:
    """Values (n,) or (n, k), appended batch by batch; rows whose width differs from the first batch's k are NaN."""

    def __init__(self, expected: int, dtype: npt.DTypeLike = np.float64) -> None:
        self._expected, self._dtype = expected, dtype
        self._table: npt.NDArray[Any] | None = None
        self.count = 0

    def append(self, values: npt.NDArray[Any]) -> None:
        """Append the rows of a batch."""
        if self._table is None:
            width = int(np.prod(values.shape[1:])) * values.itemsize  # bytes of a row
            rows = min(self._expected, _MOST_RESERVED // max(1, width))
            self._table = np.empty((rows, *values.shape[1:]), self._dtype)
        end = self.count + len(values)
        if end > len(self._table):
            grown = np.empty((max(end, 2 * len(self._table)), *self._table.shape[1:]), self._dtype)
            grown[: self.count] = self._table[: self.count]
            self._table = grown
        fits = values.shape[1:] == self._table.shape[1:]
        self._table[self.count : end] = values if fits else np.nan
        self.count = end

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

    def __init__(self, expected: int) -> None:
        self.rows = Rows(expected)
        self.elsewhere: Rows | None = None

    def append(self, count: int, values: Values, width: int | None) -> None:
        """Append a batch's rows, whose arrays have this width; None: all arrays so far are empty."""
        rows, other = values
        if width is not None:
            self.rows.widen(width)
        self.rows.append(np.full((count, 1), np.nan) if rows is None else rows)
        if other is not None and self.elsewhere is None:
            self.elsewhere = Rows(0, np.bool_)
            self.elsewhere.append(np.zeros(self.rows.count - count, np.bool_))
        if self.elsewhere is not None:
            self.elsewhere.append(np.zeros(count, np.bool_) if other is None else other)


class TopicColumns(Topic):
    """A topic whose columns are in memory; `expected` is an estimate of the number of messages by topic."""

    def __init__(
        self,
        path: Path,
        topic: str,
        texts: Iterable[str],
        clock: str,
        joints: Sequence[str],
        expected: Mapping[str, int],
    ) -> None:
        super().__init__(path, topic, texts, clock, joints)
        self._rows = {text: _FieldRows(expected.get(topic, 0)) for text in self.fields}
        # A header's stamp may be before 1970.
        self._stamps = Rows(expected.get(topic, 0), np.int64 if self.clock == "header" else np.uint64)
        self._clock: tuple[FloatArray, npt.NDArray[np.intp] | None] | None = None

    def add(self, stream: Stream, batch: Batch) -> None:
        """Decode a batch and append its rows; raises RecordingError if a field or the header's stamp is missing."""
        decoded = self.decode(stream, batch)
        if decoded is not None:
            stamps, values = decoded
            self._stamps.append(stamps)
            for text, rows in self._rows.items():
                rows.append(len(stamps), values[text], self.fields[text].width)

    def column(self, text: str) -> tuple[Column, list[Finding]]:
        """Return a field as a column in the order of its times, and its findings; raises RecordingError."""
        column, findings = super().column(text)
        rows = self._rows[text]
        values = rows.rows.values
        rounded = rounded_integers(values)
        if rows.elsewhere is not None:
            present = ~rows.elsewhere.values
            values, (time, order) = values[present], sort_times(self._stamps.values[present], self.origin)
        else:
            if self._clock is None:
                self._clock = sort_times(self._stamps.values, self.origin)
            time, order = self._clock
        column = replace(column, values=values if order is None else values[order], time=time)
        return column, [*findings, *rounding_finding(column.name, rounded)]
