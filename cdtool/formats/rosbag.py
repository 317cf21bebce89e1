"""ROS 1 bags and ROS 2 bags in SQLite (.db3), by rosbags; their messages are decoded like those of MCAP files."""

from __future__ import annotations

from collections.abc import Callable, Collection, Generator, Iterator
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from cdtool.channels import ChannelMap
from cdtool.columns import Column, Piece
from cdtool.errors import RecordingError
from cdtool.findings import Finding
from cdtool.findings.containers import BagDamaged, MessagesUnreadable
from cdtool.formats.container_checks import check_size, library, one_line_errors
from cdtool.formats.pieces import Pieces, join_pieces
from cdtool.formats.source import Source, TopicDetails
from cdtool.messages.batch import Batch
from cdtool.messages.stream import Stream
from cdtool.messages.topic import wanted_columns, wanted_topics
from cdtool.messages.topic_columns import TopicColumns
from cdtool.messages.topic_survey import TopicSurvey

_BAG, _SQLITE = b"#ROSBAG V2.0", b"SQLite format 3\0"
_FIRST_PAGE = 2**16  # SQLite's largest page size [bytes]; the first page contains the names of the tables
# Batches are yielded after this number of messages of one topic, or this number of bytes of all topics.
_MESSAGES, _BYTES = 4096, 1 << 23
# In a batch each payload follows the header of an MCAP message [bytes], whose last field is the publish time.
_HEADER = 22


@dataclass(frozen=True)
class Rosbag:
    """ROS bags: a column is a topic and a numeric field of its messages, as in an MCAP file."""

    name: ClassVar[str] = "rosbag"
    suffixes: ClassVar[tuple[str, ...]] = (".bag", ".db3")
    topics: ClassVar[bool] = True

    def sniff(self, path: Path) -> bool:
        """Return whether the file starts like a ROS 1 bag, or like an SQLite database with a table of messages."""
        with path.open("rb") as file:
            head = file.read(_FIRST_PAGE)
        return head.startswith(_BAG) or (head.startswith(_SQLITE) and b"messages" in head)

    def columns(self, path: Path, wanted: ChannelMap | None = None) -> Source:
        """Return the fields that `wanted` names, or all numeric fields; raises RecordingError."""
        if wanted is None:
            return join_pieces(self.pieces(path), sort=True)
        bag = self._bag(path)
        return bag.source(*bag.wanted(wanted))

    def pieces(self, path: Path, _: Collection[str] | None = None) -> Pieces:
        """Yield all numeric fields, some thousand messages of a topic at a time; raises RecordingError."""
        bag = self._bag(path)
        return bag.source(*(yield from bag.pieces()))

    def element_names(self, path: Path, topic: str) -> tuple[str, ...]:
        """Return the `name` list of a topic's first message; empty if the message has no such list."""
        from rosbags.highlevel import AnyReader

        with one_line_errors(path, "a ROS bag"), AnyReader([path], default_typestore=_typestore()) as reader:
            chosen = [connection for connection in reader.connections if connection.topic == topic]
            for connection, _, raw in reader.messages(connections=chosen):
                names = getattr(reader.deserialize(raw, connection.msgtype), "name", ())
                return tuple(map(str, names)) if isinstance(names, list) else ()
        return ()

    def _bag(self, path: Path) -> _Bag:
        library("rosbags", "rosbag", path)
        if not self.sniff(path):
            raise RecordingError(f"{path}: is not a ROS bag", "see cdtool list formats")
        return _Bag(path)


@dataclass
class _Bag:
    """A bag that is read once; after that `topics` (message type, number of messages) and `origin` [ns] are set."""

    path: Path
    origin: int = 0
    topics: dict[str, tuple[str, int]] = field(default_factory=dict)
    _read: dict[str, int] = field(default_factory=dict)
    _end: str = ""

    def source(self, columns: dict[str, Column], findings: list[Finding]) -> Source:
        """Return the bag's columns with its origin, topics and findings."""
        topics = {topic: TopicDetails(kind, count) for topic, (kind, count) in self.topics.items()}
        start, names = self.origin / 1e9, tuple(columns)
        return Source(self.path, Rosbag.name, columns, start, tuple(findings), names=names, topics=topics)

    def pieces(self) -> Generator[Piece, None, tuple[dict[str, Column], list[Finding]]]:
        """Yield every numeric field; return the columns, without rows, and the findings."""
        topics: dict[str, TopicSurvey] = {}
        for stream, batch in self._batches(lambda _: True):
            name = stream.topic
            yield from topics.setdefault(name, TopicSurvey(name)).pieces(stream, batch, self.origin)
        columns: dict[str, Column] = {}
        findings = self._losses()
        for topic in topics.values():
            of_topic, of_findings = topic.columns_and_findings()
            columns |= of_topic
            findings += of_findings
        return columns, findings

    def wanted(self, wanted: ChannelMap) -> tuple[dict[str, Column], list[Finding]]:
        """Return the fields of a channel map, and the findings."""
        topics = wanted_topics(self.path, wanted, partial(TopicColumns, expected={}))
        for stream, batch in self._batches(topics.__contains__):
            topics[stream.topic].add(stream, batch)
        logged = [name for name, (_, count) in self.topics.items() if count]
        columns, findings, self.origin = wanted_columns(self.path, wanted, topics, logged, self.origin)
        return columns, self._losses() + findings

    def _batches(self, is_wanted: Callable[[str], bool]) -> Iterator[tuple[Stream, Batch]]:
        """Yield the messages of the wanted topics, batch by batch."""
        from rosbags.highlevel import AnyReader

        with one_line_errors(self.path, "a ROS bag"):
            reader = AnyReader([self.path], default_typestore=_typestore())
            reader.open()
        try:
            with one_line_errors(self.path, "a ROS bag"):
                streams = {connection.id: _stream(connection) for connection in reader.connections}
                for connection in reader.connections:
                    count = self.topics.get(connection.topic, ("", 0))[1] + connection.msgcount
                    self.topics[connection.topic] = (connection.msgtype, count)
                self.origin = int(reader.start_time) if reader.message_count else 0
            buffered: dict[int, list[tuple[int, bytes]]] = {}
            size = 0
            for connection, time, raw in self._messages(reader, [c for c in reader.connections if is_wanted(c.topic)]):
                rows = buffered.setdefault(connection.id, [])
                rows.append((time, raw))
                size += len(raw)
                if len(rows) == _MESSAGES or size > _BYTES:  # all topics at once, so that they stay in time order
                    yield from ((streams[number], _batch(some)) for number, some in buffered.items())
                    buffered, size = {}, 0
            yield from ((streams[number], _batch(rows)) for number, rows in buffered.items())
        finally:
            reader.close()

    def _messages(self, reader: Any, connections: list[Any]) -> Iterator[tuple[Any, int, bytes]]:
        """Yield the messages to the bag's end or to the first damage, which `_losses` reports.

        Raises RecordingError if the messages are larger than those of any log: the bag is a decompression bomb.
        """
        messages, size = iter(reader.messages(connections=connections)), 0
        while connections:
            try:
                connection, time, raw = next(messages)
            except StopIteration:
                return
            except Exception as fault:  # damaged bytes cause errors of any type
                self._end = " ".join(f"{type(fault).__name__}: {fault}".split())[:200]
                return
            size += len(raw)
            check_size(self.path, size // 8)
            self._read[connection.topic] = self._read.get(connection.topic, 0) + 1
            yield connection, time, bytes(raw)

    def _losses(self) -> list[Finding]:
        unreadable = [
            Finding(MessagesUnreadable(self.topics[topic][1] - count, self.topics[topic][1], self._end), topic, "loss")
            for topic, count in self._read.items()
            if count < self.topics[topic][1]
        ]
        return unreadable or ([Finding(BagDamaged(self._end), severity="loss")] if self._end else [])


def _typestore() -> Any:
    """Return the definitions of the standard messages, which bags from before ROS 2 Iron do not contain."""
    from rosbags.typesys import Stores, get_typestore

    return get_typestore(Stores.ROS2_HUMBLE)


def _stream(connection: Any) -> Stream:
    """Return the stream of a connection, with the definition of its messages."""
    definition = connection.msgdef
    ros1 = not hasattr(connection.ext, "serialization_format")
    kind = {"IDL": "ros2idl"}.get(definition.format.name, "ros1msg" if ros1 else "ros2msg")
    text = definition.data
    if not text:
        text, _ = _typestore().generate_msgdef(connection.msgtype, ros_version=1 if ros1 else 2)
    encoding = "ros1" if ros1 else connection.ext.serialization_format
    return Stream(connection.id % 2**16, connection.topic, encoding, (kind, connection.msgtype, text.encode()))


def _batch(rows: list[tuple[int, bytes]]) -> Batch:
    times = np.array([time for time, _ in rows], dtype=np.uint64)
    length = np.array([len(raw) for _, raw in rows], dtype=np.int64)
    start = np.cumsum(length + _HEADER) - length
    parts = (
        bytes(_HEADER - 8) + stamp.tobytes() + raw for stamp, (_, raw) in zip(times.astype("<u8"), rows, strict=True)
    )
    return Batch(np.frombuffer(b"".join(parts), dtype=np.uint8), start, length, times)
