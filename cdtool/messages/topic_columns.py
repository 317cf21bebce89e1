"""The wanted fields of a topic, collected batch by batch into columns in memory."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from cdtool.columns import Column
from cdtool.findings import Finding
from cdtool.large_integers import rounded_integers, rounding_finding
from cdtool.messages.batch import Batch, Stream
from cdtool.messages.topic import BatchValues, Topic, sort_times
from cdtool.recording import FloatArray


class TopicColumns(Topic):
    """A topic whose columns are in memory; its parameters are those of Topic."""

    def __init__(self, *parameters: Any) -> None:
        super().__init__(*parameters)
        self._batches: list[BatchValues] = []
        self._clock: tuple[FloatArray, npt.NDArray[np.intp] | None] | None = None  # of fields that every message has

    def add(self, stream: Stream, batch: Batch) -> None:
        """Decode a batch and keep its values; raises RecordingError if a field or the header's stamp is missing."""
        decoded = self.decode(stream, batch)
        if decoded is not None:
            self._batches.append(decoded)

    def column(self, text: str) -> tuple[Column, list[Finding]]:
        """Return a field as a column in the order of its times, and its findings; raises RecordingError."""
        column, findings = super().column(text)
        parts = [self.rows_of(batch, text) for batch in self._batches]
        for batch in self._batches if text != self.exact else ():
            del batch.values[text]  # so that at most one column exists twice in memory
        empty = column.values.shape[1:]
        values = np.concatenate(
            [
                column.values,
                *(np.full((len(stamps), *empty), np.nan) if each is None else each for stamps, _, each in parts),
            ]
        )
        rounded = rounded_integers(values)
        is_whole = len(values) == sum(len(batch.stamps) for batch in self._batches)
        clock = self._clock if is_whole else None
        if clock is None:
            exact = np.concatenate([part.exact for part in parts if part.exact is not None]) if self.exact else None
            clock = sort_times(np.concatenate([part.stamps for part in parts]), self.origin, exact)
        if is_whole:
            self._clock = clock
        time, order = clock
        column = replace(column, values=values if order is None else values[order], time=time)
        return column, [*findings, *rounding_finding(column.name, rounded)]
