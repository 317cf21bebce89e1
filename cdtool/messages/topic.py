"""The fields of a log's topics that a channel map names: their values batch by batch, and the findings about them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from cdtool.channels import ChannelMap
from cdtool.columns import Column
from cdtool.errors import RecordingError, nearest
from cdtool.findings import Finding
from cdtool.findings.messages import EmptyArrays, OtherJointsOnly
from cdtool.messages.batch import Batch
from cdtool.messages.columns import Picked
from cdtool.messages.columns.decoded_batch import ABSENT, OTHER_JOINTS
from cdtool.messages.decoders import Decoders
from cdtool.messages.fields import FieldMissingError, missing, parse_field
from cdtool.messages.stamp_order import StampOrders, Stamps
from cdtool.messages.stream import Stream
from cdtool.recording import GROUND_TRUTH, BoolArray, FloatArray

# A field's values in a batch, None: of an array whose width is not known yet, all are empty; and which messages name
# other joints only, None: none of them does.
Values = tuple[FloatArray | None, BoolArray | None]
# The stamps [ns] of a batch's messages, and each field's values.
Taken = tuple[Stamps, dict[str, Values]]


class WantedField:
    """A field and what its messages are so far: how many name its joints, how many only others, how wide arrays are."""

    def __init__(self, text: str, where: str) -> None:
        self.field = parse_field(text, where)
        self.held = self.elsewhere = 0
        self.names: list[str] = []  # of the other joints
        self.widths: Counter[int] = Counter()
        self.width: int | None = None  # of the first array that is not empty

    def count(self, messages: int, widths: Counter[int]) -> None:
        """Count messages that name its joints, and the widths of their arrays."""
        self.held += messages
        if self.width is None:
            self.width = next((width for width in widths if width > 0), None)
        self.widths.update(widths)

    def take(self, picked: Picked, whole: BoolArray, all_whole: bool) -> Values:
        """Return the values of those messages of a batch that are decoded (`whole`)."""
        values, count, other = picked.values, picked.count, None
        if not (picked.alike and all_whole):
            elsewhere = picked.state == OTHER_JOINTS
            if not all_whole:
                values, elsewhere, count = values[whole], elsewhere[whole], None if count is None else count[whole]
            if elsewhere.any():
                other, count = elsewhere, None if count is None else count[~elsewhere]
                self.elsewhere += int(np.count_nonzero(elsewhere))
        held = len(values) - (0 if other is None else int(np.count_nonzero(other)))
        self.count(held, Counter() if count is None else tally(count))
        if picked.count is None:
            return values, other
        if self.width is None:
            return None, other
        return values if values.shape[1:] == (self.width,) else np.full((len(values), self.width), np.nan), other


class Topic:
    """The wanted fields of a topic, batch by batch.

    `texts` are the fields in the field language, `joints` order whole arrays by their names.
    """

    def __init__(self, path: Path, topic: str, texts: Iterable[str], clock: str, joints: Sequence[str]) -> None:
        self.where, self.topic, self.clock, self.joints = f"{path}: {topic}", topic, clock, joints
        self.fields = {text: WantedField(text, self.where) for text in texts}
        self.wanted = [each.field for each in self.fields.values()]
        self.decoders, self.orders = Decoders(), StampOrders(topic)
        self.first_stamp: int | None = None  # [ns], by the chosen clock
        self.origin = 0  # [ns], what the times of its columns count from

    def take(self, stream: Stream, batch: Batch) -> Taken | None:
        """Return what a batch's decoded messages hold; None where their channel cannot be decoded.

        Raises RecordingError where a field or the header's stamp is not there.
        """
        found = self.decoders.gather(self.where, stream, batch, self.wanted, self.joints, self.clock)
        if found is None:
            return None
        decoder, gathered, stamps = found
        whole = self.decoders.keep(gathered)
        all_whole = bool(whole.all())
        stamps = stamps if all_whole else stamps[whole]
        self.orders.add(stream.id, stamps)
        if self.first_stamp is None and len(stamps):
            self.first_stamp = int(stamps[0])
        values: dict[str, Values] = {}
        for (text, each), picked in zip(self.fields.items(), gathered.picked, strict=True):
            if picked.fault is not None and bool(np.any(whole & (picked.state == ABSENT))):
                raise missing(self.where, text, picked.fault)
            values[text] = each.take(picked, whole, all_whole)
            if each.elsewhere and not each.names:
                each.names = decoder.names(batch, each.field)
        return stamps, values

    def column(self, text: str) -> tuple[Column, list[Finding]]:
        """Return a field as a column, here without rows, and its findings; raises RecordingError."""
        each, name = self.fields[text], f"{self.topic} {text}"
        findings = []
        if each.elsewhere:
            if not each.held:
                raise missing(self.where, text, FieldMissingError("no message names this joint", each.names))
            findings.append(Finding(OtherJointsOnly(each.elsewhere), name, "note"))
        widths = each.widths - Counter({0: each.widths[0]})
        if len(widths) > 1:
            found = ", ".join(f"{width} in {count}" for width, count in widths.most_common())
            raise RecordingError(
                f"{self.where}: the length of field '{text}' varies: {found} messages",
                "name one element, e.g. position[0]",
            )
        if each.widths[0]:
            findings.append(Finding(EmptyArrays(each.widths[0]), name))
        shape = (0, each.width or 1) if each.widths else (0,)
        return Column(name, np.empty(shape), np.empty(0)), findings


_Topic = TypeVar("_Topic", bound=Topic)


def wanted_topics(
    path: Path, wanted: ChannelMap, make: Callable[..., _Topic], also: Sequence[str] = ()
) -> dict[str, _Topic]:
    """Return the topics that a map names, each with its fields and those of `also`; `make` is Topic or a kin of it."""
    texts: dict[str, dict[str, None]] = {}
    for source in wanted.sources:
        texts.setdefault(source.topic, {})[source.field] = None
    clock, joints = wanted.time.clock, wanted.joint_names
    return {name: make(path, name, fields | dict.fromkeys(also), clock, joints) for name, fields in texts.items()}


def wanted_columns(
    path: Path, wanted: ChannelMap, topics: Mapping[str, Topic], logged: Sequence[str], origin: int
) -> tuple[dict[str, Column], list[Finding], int]:
    """Return the columns of a map, their findings, and what their times count from [ns].

    `logged` are the topics that have messages; ground truth of any other topic has no column. A header's clock may be
    another one (simulated time): its own first stamp is its origin; by the log's clock it is `origin`.

    Raises RecordingError where no message of a topic can be decoded, a field's messages do not agree, or the topic of
    another channel has no message.
    """
    wanted = _logged_only(path, wanted, logged)
    findings: list[Finding] = []
    for name in dict.fromkeys(source.topic for source in wanted.sources):
        findings += topics[name].decoders.told(f"{path}", name) + topics[name].orders.findings()
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


def tally(counts: npt.NDArray[np.int64]) -> Counter[int]:
    """Return how often each count occurs, in the order of their first ones."""
    if len(counts) and (counts == counts[0]).all():
        return Counter({int(counts[0]): len(counts)})
    return Counter(counts.tolist())


def in_order(stamps: Stamps, origin: int) -> tuple[FloatArray, npt.NDArray[np.intp] | None]:
    """Return times [s] after `origin` [ns] in ascending order, and the order; None where they are in order already."""
    # The difference is taken between integers: an epoch in ns has more digits than a float64. It may need all 64 bits.
    later: npt.NDArray[np.uint64] = stamps.view(np.uint64) - np.uint64(origin % 2**64)
    time = later / 1e9
    if len(stamps) and (before := stamps < origin).any():
        time[before] = -((~later[before] + np.uint64(1)) / 1e9)
    if np.all(time[1:] >= time[:-1]):
        return time, None
    order = np.argsort(time, kind="stable")
    return time[order], order
