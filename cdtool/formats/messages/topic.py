"""The fields of topics that a channel map names: collected batch by batch into columns, with the findings on them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.base.errors import RecordingError, nearest
from cdtool.base.findings import Finding
from cdtool.formats.channels.channel_map import ChannelMap
from cdtool.formats.columns import Column
from cdtool.formats.large_integers import rounded_integers, rounding_finding
from cdtool.formats.messages.batch import Batch, Stream
from cdtool.formats.messages.decoded_batch import ABSENT, OTHER_JOINTS, DecodedBatch, FieldValues
from cdtool.formats.messages.decoders import Decoders
from cdtool.formats.messages.fields import FieldMissingError, element_names, missing_field, parse_field
from cdtool.formats.messages.stamp_order import StampOrders, Stamps
from cdtool.recordings.recording import GROUND_TRUTH


class FieldRows(NamedTuple):
    """One field in a batch's messages that name its joints: time stamps [ns], exact times [s] if the log has them."""

    stamps: Stamps
    exact: FloatArray | None
    values: FloatArray


class WantedField:
    """A wanted field, its rows, and the counts of its messages so far.

    `found` messages have the field, `elsewhere` name only other joints; `widths` counts the arrays by width.
    """

    def __init__(self, text: str, where: str) -> None:
        self.field = parse_field(text, where)
        self.found = self.elsewhere = 0
        self.names: list[str] = []  # of the other joints
        self.widths: Counter[int] = Counter()
        self.rows: list[FieldRows] = []

    def add(self, field_values: FieldValues, whole: BoolArray, stamps: Stamps, exact: FloatArray | None) -> None:
        """Add a batch, of which the messages `whole` are decoded."""
        named = whole & (field_values.state != OTHER_JOINTS)
        found = int(np.count_nonzero(named))
        self.found += found
        self.elsewhere += int(np.count_nonzero(whole)) - found
        rows = slice(None) if found == len(named) else named  # all of them, without a copy
        if field_values.count is not None:
            self.widths.update(count_values(field_values.count[rows]))
        self.rows.append(FieldRows(stamps[rows], None if exact is None else exact[rows], field_values.values[rows]))

    def values(self) -> FloatArray:
        """Return the values of all rows.

        An array has the width of the first one that is not empty; those of another width are NaN.
        """
        shape = (next((width for width in self.widths if width > 0), 1),) if self.field.whole else ()
        tables = (
            part.values if part.values.shape[1:] == shape else np.full((len(part.stamps), *shape), np.nan)
            for part in self.rows
        )
        return np.concatenate([np.empty((0, *shape)), *tables])


class Topic:
    """The wanted fields of a topic, in memory.

    `texts` are the fields in the field language; whole arrays with named elements are in the order of `joints`. `exact`
    is the field with the time [s] of each message, if the log's time stamps are rounded.
    """

    def __init__(
        self, path: Path, topic: str, texts: Iterable[str], clock: str, joints: Sequence[str], exact: str = ""
    ) -> None:
        self.where, self.topic, self.clock, self.joints = f"{path}: {topic}", topic, clock, joints
        self.exact = exact
        self.fields = {text: WantedField(text, self.where) for text in (*texts, *([exact] if exact else ()))}
        self.wanted = [each.field for each in self.fields.values()]
        self.decoders, self.orders = Decoders(), StampOrders(topic)
        self.first_stamp: int | None = None  # [ns], by the chosen clock
        self.origin = 0  # [ns], the zero of its columns' times
        self._clock: tuple[FloatArray, npt.NDArray[np.intp] | None] | None = None  # of fields that every message has

    def add(self, stream: Stream, batch: Batch) -> None:
        """Decode a batch and keep its values; raises RecordingError if a field or the header's stamp is missing."""
        by_header = self.clock == "header"
        decoded = self.decoders.attempt(
            stream, batch, lambda decoder: decoder.decode(batch, self.wanted, self.joints, by_header)
        )
        if decoded is None:
            return
        whole = self.decoders.keep(decoded)
        self._check(decoded, whole)
        stamps: Stamps = batch.log_time if self.clock == "log" else batch.publish_time
        if by_header and decoded.stamps is not None:
            stamps = decoded.stamps
        self.orders.add(stream.id, stamps[whole])
        if self.first_stamp is None and whole.any():
            self.first_stamp = int(stamps[whole.argmax()])
        fields = dict(zip(self.fields, decoded.fields, strict=True))
        exact = fields[self.exact].values if self.exact else None
        for text, each in self.fields.items():
            each.add(fields[text], whole, stamps, exact)
            if each.elsewhere and not each.names:
                # The names of other joints are looked for in ten messages.
                contents = self.decoders.contents(stream, batch.rows(slice(10)))
                each.names = sorted({name for content in contents for name in element_names(content)})

    def _check(self, decoded: DecodedBatch, whole: BoolArray) -> None:
        """Raise RecordingError for the first message without a field or without the header's time stamp.

        The first message, not the first field: otherwise the error would depend on where the batches end.
        """
        faults: list[tuple[int, RecordingError]] = []
        if self.clock == "header":
            unstamped = whole if decoded.has_stamp is None else whole & ~decoded.has_stamp
            if unstamped.any():
                fault = f"{self.where}: a message has no header.stamp"
                advice = "use time = { clock = 'log' } in [channels.mcap]"
                faults.append((int(unstamped.argmax()), RecordingError(fault, advice)))
        for text, field_values in zip(self.fields, decoded.fields, strict=True):
            if field_values.fault is not None:
                absent = whole & (field_values.state == ABSENT)
                if absent.any():
                    faults.append((int(absent.argmax()), missing_field(self.where, text, field_values.fault)))
        if faults:
            raise min(faults, key=lambda fault: fault[0])[1]

    def column(self, text: str) -> tuple[Column, list[Finding]]:
        """Return a field as a column in the order of its times, and its findings; raises RecordingError."""
        findings = self._findings(text)
        each, name = self.fields[text], f"{self.topic} {text}"
        values, clock = each.values(), None if each.elsewhere else self._clock
        if clock is None:
            exact = [part.exact for part in each.rows if part.exact is not None]
            stamps = np.concatenate([part.stamps for part in each.rows])
            clock = sort_times(stamps, self.origin, np.concatenate(exact) if exact else None)
        if not each.elsewhere:
            self._clock = clock
        each.rows = []  # so that at most one column exists twice in memory
        time, order = clock
        findings += rounding_finding(name, rounded_integers(values))
        return Column(name, values if order is None else values[order], time), findings

    def _findings(self, text: str) -> list[Finding]:
        """Return the findings on a field; raises RecordingError."""
        each, name = self.fields[text], f"{self.topic} {text}"
        findings = []
        if each.elsewhere:
            if not each.found:
                raise missing_field(self.where, text, FieldMissingError("no message names this joint", each.names))
            findings.append(Finding("other_joints_only", name, {"count": each.elsewhere}))
        widths = each.widths - Counter({0: each.widths[0]})
        if len(widths) > 1:
            lengths = ", ".join(f"{width} in {count}" for width, count in widths.most_common())
            raise RecordingError(
                f"{self.where}: the length of field '{text}' varies: {lengths} messages",
                "select one element, e.g. position[0]",
            )
        if each.widths[0]:
            findings.append(Finding("empty_arrays", name, {"count": each.widths[0]}))
        return findings


def wanted_topics(path: Path, wanted: ChannelMap, exact: str = "") -> dict[str, Topic]:
    """Return the topics that a map names, each with its fields."""
    texts: dict[str, dict[str, None]] = {}
    for source in wanted.sources:
        texts.setdefault(source.topic, {})[source.field] = None
    clock, joints = wanted.time.clock, wanted.joint_names
    return {name: Topic(path, name, fields, clock, joints, exact) for name, fields in texts.items()}


def wanted_columns(
    path: Path, wanted: ChannelMap, topics: Mapping[str, Topic], logged: Sequence[str], origin: int
) -> tuple[dict[str, Column], list[Finding], int]:
    """Return the columns of a map, their findings, and the zero of their times [ns].

    `logged` are the topics that have messages; ground truth on any other topic has no column. The zero is `origin` by
    the log's clock. Header stamps may come from another clock (simulated time): their zero is the first stamp.

    Raises RecordingError if no message of a topic can be decoded, the array lengths of a field differ, or the topic of
    another channel has no message.
    """
    wanted = _logged_only(path, wanted, logged)
    findings: list[Finding] = []
    for name in dict.fromkeys(source.topic for source in wanted.sources):
        findings += topics[name].decoders.checked_failure(f"{path}", name) + topics[name].orders.findings()
    stamps = [topic.first_stamp for topic in topics.values() if topic.first_stamp is not None]
    if wanted.time.clock != "log":
        origin = min(stamps, default=origin)
    columns: dict[str, Column] = {}
    for source in wanted.sources:
        if source.described not in columns:
            topics[source.topic].origin = origin
            columns[source.described], found = topics[source.topic].column(source.field)
            findings += found
    return columns, findings, origin


def _logged_only(path: Path, wanted: ChannelMap, logged: Sequence[str]) -> ChannelMap:
    """Return the map without ground truth whose topic has no message; raises RecordingError for any other channel."""
    sources = tuple(item for item in wanted.sources if item.topic in logged or item.channel not in GROUND_TRUTH)
    for item in sources:
        if item.topic not in logged:
            raise RecordingError(
                f"{path}: no message of topic '{item.topic}' (channel '{item.channel}')",
                nearest(item.topic, logged),
                channel=item.channel,
            )
    return replace(wanted, sources=sources)


def count_values(counts: npt.NDArray[np.int64]) -> Counter[int]:
    """Return how often each count occurs, in order of first occurrence."""
    if len(counts) and (counts == counts[0]).all():
        return Counter({int(counts[0]): len(counts)})
    return Counter(counts.tolist())


def sort_times(
    stamps: Stamps, origin: int, exact: FloatArray | None = None
) -> tuple[FloatArray, npt.NDArray[np.intp] | None]:
    """Return times [s] after `origin` [ns] in ascending order, and the order; None if they are already ascending.

    With `exact` times [s] these are returned, in the order of the stamps. The difference is between integers, as an
    epoch in ns has more digits than a float64; it may need all 64 bits.
    """
    after = np.ascontiguousarray(stamps).view(np.uint64) - np.uint64(origin % 2**64)
    limits = np.iinfo(stamps.dtype)
    early = stamps < np.clip(origin, limits.min, limits.max).astype(stamps.dtype)
    time: FloatArray = after.astype(np.float64)
    time[early] = -((~after[early] + np.uint64(1)).astype(np.float64))
    time /= 1e9
    if not (time[1:] < time[:-1]).any():
        return time if exact is None else exact, None
    order = np.argsort(time, kind="stable")
    return (time if exact is None else exact)[order], order
