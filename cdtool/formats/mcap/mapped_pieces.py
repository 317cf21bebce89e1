"""The fields of an MCAP log that a machine file maps, piece by piece: by Gathering's rules, without their columns."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import numpy.typing as npt

from cdtool.channels import ChannelMap
from cdtool.columns import Column, Piece
from cdtool.errors import RecordingError
from cdtool.findings import Finding
from cdtool.findings.messages import EmptyArrays, OtherJointsOnly
from cdtool.formats.column_names import with_topics
from cdtool.formats.mcap.container.ahead import ahead
from cdtool.formats.mcap.container.definitions import Stream
from cdtool.formats.mcap.container.log import Log
from cdtool.formats.mcap.container.messages import NO_DATE
from cdtool.formats.mcap.exact_times import EXACT_TIME, exact_times
from cdtool.formats.pieces import Pieces
from cdtool.formats.source import Source
from cdtool.messages.batch import Batch
from cdtool.messages.columns import Picked
from cdtool.messages.columns.gathered import ABSENT, OTHER_JOINTS
from cdtool.messages.decoders import Decoders
from cdtool.messages.fields import Field, FieldMissingError, missing, parse_field
from cdtool.messages.gathering import in_order, tally
from cdtool.messages.stamp_order import StampOrders, Stamps
from cdtool.recording import FloatArray


@dataclass
class MappedFields:
    """An MCAP file that is read piece by piece as often as is asked for; each field is a clock of its own.

    The times count from the `origin` [ns] that the pass before has found; `settled`: the last pass counted from it.
    """

    path: Path
    wanted: ChannelMap
    origin: int | None = None
    settled: bool = False

    def __post_init__(self) -> None:
        told = exact_times(self.path)
        self._exact_origin = None if told is None else float(told.get("cdtool.origin_s", "0"))

    def pieces(self) -> Pieces:
        """The fields that `wanted` names, some MiB of the file at a time; raises RecordingError."""
        topics = self._topics()
        log = Log(self.path, topics.__contains__)
        start = self.origin
        for piece in ahead(log.pieces()):
            first = log.section.room.first_time
            if start is None and self.wanted.time.clock == "log" and first is not None and first < NO_DATE:
                start = first
            for messages in piece:
                topic = topics[messages.stream.channel.topic]
                for name, stamps, values, exact in topic.take(messages.stream, messages.batch):
                    if not len(stamps):
                        continue
                    start = int(stamps[0]) if start is None else start
                    time, order = in_order(stamps, start)
                    if exact is not None:
                        time = exact if order is None else exact[order]
                    rows = {} if values is None else {name: values if order is None else values[order]}
                    yield Piece(name, time, rows, len(time))
        source = self._end(log, topics)
        self.settled = self.origin == start
        return source

    def _topics(self) -> dict[str, _Topic]:
        texts: dict[str, dict[str, None]] = {}
        for source in self.wanted.sources:
            texts.setdefault(source.topic, {})[source.field] = None
        clock, joints = self.wanted.time.clock, self.wanted.joint_names
        exact = [] if self._exact_origin is None else [EXACT_TIME]
        return {name: _Topic(self.path, name, [*fields], exact, clock, joints) for name, fields in texts.items()}

    def _end(self, log: Log, topics: dict[str, _Topic]) -> Source:
        findings = log.findings()
        held = with_topics(self.path, self.wanted, [topic.name for topic in log.topics.values() if topic.count])
        for name in dict.fromkeys(source.topic for source in held.sources):
            findings += topics[name].decoders.told(f"{self.path}", name) + topics[name].orders.findings()
        stamps = [topic.first_stamp for topic in topics.values() if topic.first_stamp is not None]
        self.origin = log.origin if self.wanted.time.clock == "log" else min(stamps, default=log.origin)
        columns: dict[str, Column] = {}
        for source in held.sources:
            if source.described not in columns:
                columns[source.described], found = topics[source.topic].column(source.field)
                findings += found
        origin = self.origin / 1e9 if self._exact_origin is None else self._exact_origin
        return Source(
            self.path, "mcap", columns, origin, tuple(findings), names=tuple(columns), topics=log.topic_details
        )


@dataclass
class _Course:
    """A field's messages so far: how many name its joints, how many others only; the widths of a whole array."""

    wanted: Field
    rows: int = 0
    elsewhere: int = 0
    widths: Counter[int] = field(default_factory=Counter)
    width: int | None = None  # of the first row that is not empty
    names: list[str] = field(default_factory=list)

    def values(self, picked: Picked, rows: npt.NDArray[np.intp]) -> FloatArray | None:
        """The values of these messages; None of an array whose width is not known yet: all so far are empty."""
        values = picked.values[rows]
        if picked.count is None:
            return values
        held = tally(picked.count[rows])
        self.widths.update(held)
        if self.width is None:
            self.width = next((width for width in held if width > 0), None)
        if self.width is None:
            return None
        return values if values.shape[1:] == (self.width,) else np.full((len(rows), self.width), np.nan)


# A field's name, the stamps [ns] of its messages, their values, and their exact times [s] in a converted file.
_Taken = tuple[str, Stamps, FloatArray | None, FloatArray | None]


class _Topic:
    """The fields that are wanted of a topic; the first of `exact` is its clock where there is one."""

    def __init__(
        self, path: Path, topic: str, texts: Sequence[str], exact: Sequence[str], clock: str, joints: Sequence[str]
    ) -> None:
        self.where, self.topic, self.clock, self.joints = f"{path}: {topic}", topic, clock, joints
        self._fields = {text: _Course(parse_field(text, self.where)) for text in texts}
        self._exact = [parse_field(text, self.where) for text in exact]
        self._wanted = [*(course.wanted for course in self._fields.values()), *self._exact]
        self.decoders, self.orders = Decoders(), StampOrders(topic)
        self.first_stamp: int | None = None

    def take(self, stream: Stream, batch: Batch) -> Iterator[_Taken]:
        """Each field of a batch; raises RecordingError where a field or the header's stamp is not there."""
        found = self.decoders.gather(self.where, stream, batch, self._wanted, self.joints, self.clock)
        if found is None:
            return
        decoder, gathered, stamps = found
        whole = self.decoders.keep(gathered)
        if self.first_stamp is None and whole.any():
            self.first_stamp = int(stamps[whole][0])
        self.orders.add(stream.channel.id, stamps[whole])
        exact = gathered.picked[-1].values if self._exact else None
        for course, picked in zip(self._fields.values(), gathered.picked, strict=False):
            if picked.fault is not None and bool(np.any(whole & (picked.state == ABSENT))):
                raise missing(self.where, course.wanted.text, picked.fault)
            other = whole & (picked.state == OTHER_JOINTS)
            if other.any() and not course.names:
                course.names = decoder.names(batch, course.wanted)
            rows = np.flatnonzero(whole & ~other)
            course.rows += len(rows)
            course.elsewhere += int(np.count_nonzero(other))
            name = f"{self.topic} {course.wanted.text}"
            yield name, stamps[rows], course.values(picked, rows), None if exact is None else exact[rows]

    def column(self, text: str) -> tuple[Column, list[Finding]]:
        """A field as a column without rows, and what is odd about it; raises RecordingError."""
        course, name = self._fields[text], f"{self.topic} {text}"
        findings = []
        if course.elsewhere:
            if not course.rows:
                raise missing(self.where, text, FieldMissingError("no message names this joint", course.names))
            findings.append(Finding(OtherJointsOnly(course.elsewhere), name, "note"))
        empty = course.widths.pop(0, 0)
        if len(course.widths) > 1:
            found = ", ".join(f"{width} in {count}" for width, count in course.widths.most_common())
            raise RecordingError(
                f"{self.where}: the length of field '{text}' varies: {found} messages",
                "name one element, e.g. position[0]",
            )
        if empty:
            findings.append(Finding(EmptyArrays(empty), name))
        shape = (0, course.width or 1) if course.width is not None or empty else (0,)
        return Column(name, np.empty(shape), np.empty(0)), findings
