"""MCAP: topics of messages (JSON, ROS 2 CDR, ROS 1, protobuf), read piece by piece with every CRC checked."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain
from pathlib import Path
from typing import ClassVar

from cdtool.channels import ChannelMap
from cdtool.columns import Column, Piece
from cdtool.errors import RecordingError
from cdtool.findings import Finding
from cdtool.formats.mcap.exact_times import EXACT_TIME, exact_times, with_exact_pieces, with_exact_times
from cdtool.formats.mcap.log import Log
from cdtool.formats.mcap.messages import NO_DATE
from cdtool.formats.mcap.records import MAGIC
from cdtool.formats.mcap.sequence_jumps import SequenceJumps
from cdtool.formats.pieces import Pieces, join_pieces
from cdtool.formats.source import Source
from cdtool.messages.decoders import Decoders
from cdtool.messages.topic import BatchValues, Topic, sort_times, wanted_columns, wanted_topics
from cdtool.messages.topic_columns import TopicColumns
from cdtool.messages.topic_survey import TopicSurvey

__all__ = ["Mcap"]


@dataclass(frozen=True)
class Mcap:
    """MCAP logs: a column is a topic and a numeric field of its messages, `/joint_states position[0]`."""

    name: ClassVar[str] = "mcap"
    suffixes: ClassVar[tuple[str, ...]] = (".mcap",)
    topics: ClassVar[bool] = True

    def sniff(self, path: Path) -> bool:
        """Return whether the file starts with MCAP's magic bytes."""
        with path.open("rb") as file:
            return file.read(len(MAGIC)) == MAGIC

    def columns(self, path: Path, wanted: ChannelMap | None = None) -> Source:
        """Return the fields that `wanted` names, or all numeric fields; raises RecordingError."""
        if wanted is None:
            return join_pieces(self.pieces(path), sort=True)
        return with_exact_times(_read_wanted(path, wanted), wanted, partial(_read_wanted, path))

    def pieces(self, path: Path, _: Collection[str] | None = None) -> Pieces:
        """Yield all numeric fields, some MiB of the file at a time; raises RecordingError."""
        log = Log(path)
        topics: dict[str, TopicSurvey] = {}
        jumps = SequenceJumps()
        origin: int | None = None
        for piece in log.pieces():
            origin = _origin(path, log) if origin is None else origin
            jumps.add(piece, origin)
            for messages in piece:
                name = messages.stream.topic
                survey = topics.setdefault(name, TopicSurvey(name))
                yield from survey.pieces(messages.stream, messages.batch, origin)
        findings = log.findings()
        columns: dict[str, Column] = {}
        for name in (name for name in log.topics if name in topics):
            of_topic, of_findings = topics[name].columns_and_findings()
            columns |= of_topic
            findings += of_findings
        return source_of(log, columns, findings + jumps.findings(), log.origin)

    def exact_pieces(self, path: Path) -> Pieces:
        """Yield the same as `pieces`; for a log that cdtool converted, with the exact times that were written."""
        return with_exact_pieces(self.pieces(path), path)

    def mapped(self, path: Path, wanted: ChannelMap) -> MappedFields:
        """Return the fields that `wanted` names, to be read piece by piece; raises RecordingError."""
        return MappedFields(path, wanted)

    def element_names(self, path: Path, topic: str) -> tuple[str, ...]:
        """Return the names of array elements in a topic's first decodable message; () if it has none."""
        decoders = Decoders()
        try:
            for messages in chain.from_iterable(Log(path, topic.__eq__).pieces()):
                names = decoders.element_names(messages.stream, messages.batch)
                if names is not None:
                    return names
        except RecordingError:  # the survey reports the problem
            return ()
        return ()


def _read_wanted(path: Path, wanted: ChannelMap) -> Source:
    names = {source.topic for source in wanted.sources}
    log = Log(path, names.__contains__)
    expected = {topic: log.expected(topic) for topic in names}
    topics = wanted_topics(path, wanted, partial(TopicColumns, expected=expected))
    for piece in log.pieces():
        for messages in piece:
            topics[messages.stream.topic].add(messages.stream, messages.batch)
    return mapped_source_of(log, wanted, topics)[0]


def _origin(path: Path, log: Log) -> int:
    """Return the time [ns] of a log's first message, after its first piece was read."""
    first = log.section.first_time or 0
    if first >= NO_DATE:  # the times so far are not dates: the first valid one is known after reading all messages
        log = Log(path)
        for _ in log.pieces():
            pass
        return log.origin
    return first


@dataclass
class MappedFields:
    """An MCAP file that can be read piece by piece repeatedly; each field has a clock of its own.

    The times are relative to the `origin` [ns] that the previous pass has determined; `settled`: the times of the last
    pass were relative to the final origin.
    """

    path: Path
    wanted: ChannelMap
    origin: int | None = None
    settled: bool = False

    def __post_init__(self) -> None:
        self._converted = exact_times(self.path)
        self._fields = {source.described for source in self.wanted.sources}

    def pieces(self) -> Pieces:
        """Yield the fields that `wanted` names, some MiB of the file at a time; raises RecordingError."""
        topics = wanted_topics(self.path, self.wanted, Topic, () if self._converted is None else (EXACT_TIME,))
        log = Log(self.path, topics.__contains__)
        start = self.origin
        for piece in log.pieces():
            first = log.section.first_time
            if start is None and self.wanted.time.clock == "log" and first is not None and first < NO_DATE:
                start = first
            for messages in piece:
                topic = topics[messages.stream.topic]
                decoded = topic.decode(messages.stream, messages.batch)
                if decoded is None or not len(decoded[0]):
                    continue
                start = int(decoded[0][0]) if start is None else start
                for text in decoded[1]:
                    if (name := f"{topic.topic} {text}") in self._fields:
                        of_field = self._piece(name, text, decoded, start)
                        if of_field.rows:
                            yield of_field
        source, self.origin = mapped_source_of(log, self.wanted, topics)
        self.settled = self.origin == start
        if self._converted is None:
            return source
        return replace(source, origin=float(self._converted.get("cdtool.origin_s", "0")))

    def _piece(self, name: str, text: str, decoded: BatchValues, origin: int) -> Piece:
        """Return one field of a batch's messages, without the messages that do not name its joints."""
        stamps, (values, other) = decoded[0], decoded[1][text]
        exact = None if self._converted is None else decoded[1][EXACT_TIME][0]
        if other is not None:
            stamps = stamps[~other]
            values, exact = (None if each is None else each[~other] for each in (values, exact))
        time, order = sort_times(stamps, origin)
        time = time if exact is None else exact if order is None else exact[order]
        rows = {} if values is None else {name: values if order is None else values[order]}
        return Piece(name, time, rows, len(time))


def mapped_source_of(log: Log, wanted: ChannelMap, topics: Mapping[str, Topic]) -> tuple[Source, int]:
    """Return the columns of a channel map, after all pieces were read, and the origin [ns] of their times."""
    logged = [topic.name for topic in log.topics.values() if topic.count]
    columns, findings, origin = wanted_columns(log.path, wanted, topics, logged, log.origin)
    return source_of(log, columns, log.findings() + findings, origin), origin


def source_of(log: Log, columns: Mapping[str, Column], findings: Sequence[Finding], origin: int) -> Source:
    """Return these columns as a source, after all pieces of the log were read; times are relative to `origin` [ns]."""
    start, names = origin / 1e9, tuple(columns)
    return Source(log.path, "mcap", columns, start, tuple(findings), names=names, topics=log.topic_details)
