"""Every numeric field of a topic, batch by batch, as `cdtool info` shows them."""

from __future__ import annotations

from collections import Counter

import numpy as np
import numpy.typing as npt

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import RecordingError
from cdtool.base.findings import Finding
from cdtool.formats.columns import Column, Piece
from cdtool.formats.large_integers import rounded_integers, rounding_finding
from cdtool.formats.messages.batch import Batch, Stream
from cdtool.formats.messages.decoded_batch import ABSENT, DecodedBatch, Decoder, FieldValues
from cdtool.formats.messages.decoders import Decoders
from cdtool.formats.messages.fields import LONGEST_ARRAY, Field, parse_field
from cdtool.formats.messages.stamp_order import StampOrders
from cdtool.formats.messages.topic import count_values, sort_times
from cdtool.recordings.distribution import Distribution


class TopicSurvey:
    """All numeric fields of a topic's messages over log time, and the delay from header stamp to log time."""

    def __init__(self, topic: str) -> None:
        self.topic = topic
        self.decoders = Decoders()
        self._fields: dict[str, Field] = {}
        self._widths: dict[str, Counter[int]] = {}
        self._longest: Counter[str] = Counter()  # of arrays, also of those that are too long
        self._shapes: dict[str, tuple[int, ...]] = {}  # of a field's row, from its first message on
        self._late = Distribution()
        self._orders = StampOrders(topic)
        self._rounded: Counter[str] = Counter()
        self._is_late = self._stamped = False

    def piece(self, stream: Stream, batch: Batch, origin: int) -> Piece | None:
        """Return the decoded messages of a batch, with times after `origin` [ns]; None without any."""
        fields = dict(self._fields)

        def read(decoder: Decoder) -> DecodedBatch:
            fields.update({name: parsed for name in decoder.fields(batch) if (parsed := _parsed(name)) is not None})
            return decoder.decode(batch, list(fields.values()), stamps=True, longest=LONGEST_ARRAY)

        decoded = self.decoders.attempt(stream, batch, read)
        if decoded is None:
            return None
        self._widths |= {name: Counter() for name in fields.keys() - self._fields.keys()}
        self._fields = fields
        whole = self.decoders.keep(decoded)
        self._add_stamps(batch, decoded, whole)
        stamps = batch.log_time[whole]
        self._orders.add(stream.id, stamps)
        time, order = sort_times(stamps, origin)
        values: dict[str, FloatArray] = {}
        for name, field_values in zip(self._fields, decoded.fields, strict=True):
            column = self._column(name, field_values, whole)
            if column is not None:
                values[f"{self.topic} {name}"] = column if order is None else column[order]
        return Piece(self.topic, time, values, len(time), origin / 1e9)

    def _add_stamps(self, batch: Batch, decoded: DecodedBatch, whole: npt.NDArray[np.bool_]) -> None:
        if decoded.stamps is None or decoded.has_stamp is None:
            return
        stamped = whole & decoded.has_stamp
        stamps = decoded.stamps[stamped]
        late = (batch.log_time[stamped] - stamps.astype(np.uint64)).view(np.int64)
        self._stamped = self._stamped or bool(stamps.any())
        self._is_late = self._is_late or bool(late.any())
        self._late.add(late / 1e6)

    def _column(self, name: str, field_values: FieldValues, whole: npt.NDArray[np.bool_]) -> FloatArray | None:
        """Return the field's values, NaN where a message does not have it; None if no message so far has it."""
        values, present, widths = field_values.values[whole], field_values.state[whole] != ABSENT, self._widths[name]
        if field_values.count is not None:
            count = field_values.count[whole]
            self._longest[name] = max(self._longest[name], int(count.max(initial=0)))
            present &= (count >= 0) & (count <= LONGEST_ARRAY)
            filled = count_values(count[present & (count > 0)])
            if filled:
                self._shapes.setdefault(name, (next(iter(filled)),))
            widths.update(filled)
        elif present.any():
            self._shapes.setdefault(name, ())
            widths[1] += 1
        if name not in self._shapes:
            return None
        if values.shape[1:] != self._shapes[name]:
            return np.full((len(values), *self._shapes[name]), np.nan)
        self._rounded[name] += rounded_integers(values)
        if not present.all():
            values = np.where(present.reshape((-1, *[1] * (values.ndim - 1))), values, np.nan)
        return values

    def columns_and_findings(self) -> tuple[dict[str, Column], list[Finding]]:
        """Return the columns without rows, and the findings: varying array lengths, undecodable messages."""
        columns: dict[str, Column] = {}
        findings = self.decoders.failure(self.topic) + self._orders.findings()
        for name in self._fields:
            widths, full = self._widths[name], f"{self.topic} {name}"
            lengths = sorted({*widths, self._longest[name]} - {0})
            if len(lengths) > 1:
                findings.append(Finding("array_lengths_differ", full, {"lengths": tuple(lengths)}))
            elif widths:
                findings += rounding_finding(full, self._rounded[name], "note")
                columns[full] = Column(full, np.empty((0, *self._shapes[name])), np.empty(0))
            elif lengths:
                findings.append(Finding("long_arrays", full, {"longest": lengths[0], "most": LONGEST_ARRAY}))
        return columns, findings + self._header()

    def _header(self) -> list[Finding]:
        if not self._is_late:
            return []
        if not self._stamped:
            return [Finding("header_unset", self.topic)]
        low, median, high = (self._late.percentile(percent) for percent in (5, 50, 95))
        return [Finding("header_delay", self.topic, {"median": median, "low": low, "high": high})]


def _parsed(name: str) -> Field | None:
    """Return a field by its name; None if the name contains characters of the field language's syntax."""
    try:
        return parse_field(name, "")
    except RecordingError:
        return None
