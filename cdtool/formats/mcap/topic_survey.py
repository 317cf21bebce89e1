"""Every numeric field of a topic, as `info` shows them, gathered batch by batch."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from cdtool.errors import RecordingError
from cdtool.formats.mcap.batch import Batch
from cdtool.formats.mcap.columns.gathered import ABSENT, Picked, UndecodableError
from cdtool.formats.mcap.container.definitions import Stream
from cdtool.formats.mcap.fields import Field, parse_field
from cdtool.formats.mcap.gathering import Decoders, column_of, in_order, tally
from cdtool.formats.mcap.rows import Rows
from cdtool.formats.source import Column
from cdtool.recording import Finding

_LONGEST_ARRAY = 16


class TopicSurvey:
    """All fields of a topic's messages by log time, and how late they were logged."""

    def __init__(self, topic: str, expected: int) -> None:
        self.topic, self._expected = topic, expected
        self.decoders = Decoders()
        self._fields: dict[str, Field] = {}
        self._values: dict[str, Rows] = {}
        self._widths: dict[str, Counter[int]] = {}
        self._stamps = Rows(expected, np.uint64)
        self._late: list[npt.NDArray[np.int64]] = []
        self._stamped = False

    def add(self, stream: Stream, batch: Batch) -> None:
        """Take a batch of messages."""
        decoder = self.decoders.of(stream, batch)
        if decoder is None:
            return
        fields = dict(self._fields)
        for name in decoder.fields(batch):
            if name not in fields and (parsed := _parsed(name)) is not None:
                fields[name] = parsed
        try:
            gathered = decoder.gather(batch, list(fields.values()), stamps=True)
        except UndecodableError as fault:
            self.decoders.give_up(stream, batch, fault)
            return
        for name in fields.keys() - self._fields.keys():
            self._values[name] = Rows(self._expected)
            self._values[name].append(np.full(self._stamps.count, np.nan))
            self._widths[name] = Counter()
        self._fields = fields
        whole = self.decoders.keep(gathered)
        self._stamps.append(batch.log_time if whole.all() else batch.log_time[whole])
        for name, picked in zip(self._fields, gathered.picked, strict=True):
            self._add(name, picked, whole)
        if gathered.stamps is not None and gathered.has_stamp is not None:
            stamped = whole & gathered.has_stamp
            stamps = gathered.stamps[stamped]
            self._stamped = self._stamped or bool(stamps.any())
            self._late.append((batch.log_time[stamped] - stamps.astype(np.uint64)).view(np.int64))

    def _add(self, name: str, picked: Picked, whole: npt.NDArray[np.bool_]) -> None:
        values, count, there = picked.values, picked.count, picked.state != ABSENT
        if not whole.all():
            values, there, count = values[whole], there[whole], None if count is None else count[whole]
        widths = self._widths[name]
        if count is not None:
            there &= (count >= 0) & (count <= _LONGEST_ARRAY)
            held = tally(count[there & (count > 0)])
            if held and not widths:
                self._values[name].widen(next(iter(held)))
            widths.update(held)
        elif there.any():
            widths[1] += 1
        if not there.all():
            values = np.where(there.reshape((-1, *[1] * (values.ndim - 1))), values, np.nan)
        self._values[name].append(values)

    def found(self, origin: int) -> Iterator[Column | Finding]:
        """Columns, arrays whose length varies, messages that cannot be decoded: no loss, as nobody asked for them."""
        yield from self.decoders.failure(self.topic, "warning")
        time, order = in_order(self._stamps.values, origin)
        for name, rows in self._values.items():
            widths, full = self._widths[name], f"{self.topic} {name}"
            if len(widths) > 1:
                text = f"arrays of {' and '.join(map(str, sorted(widths)))} elements: left out"
                yield Finding(text, full, "note")
            elif widths:
                yield column_of(full, rows.values, time, order)
        yield from self._header()

    def _header(self) -> Iterator[Finding]:
        late = np.concatenate(self._late) / 1e6 if self._late else np.empty(0)
        if not late.any():
            return
        if not self._stamped:
            yield Finding("the header's stamps are never set: use the log clock", self.topic, "note")
            return
        low, median, high = np.percentile(late, (5, 50, 95))
        text = f"logged {median:.3f} ms (median; 5 to 95 %: {low:.3f} to {high:.3f} ms) after the header's stamp"
        yield Finding(text, self.topic, "note")


def _parsed(name: str) -> Field | None:
    """A field by its name; None where the name itself holds what the field language is made of."""
    try:
        return parse_field(name, "")
    except RecordingError:
        return None
