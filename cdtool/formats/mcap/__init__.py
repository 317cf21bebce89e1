"""MCAP: topics of messages (JSON, ROS 2 CDR, ROS 1, protobuf), read piece by piece with every CRC checked."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import chain
from pathlib import Path
from typing import ClassVar

from cdtool.channels import ChannelMap
from cdtool.columns import Column
from cdtool.errors import RecordingError
from cdtool.findings import Finding
from cdtool.formats.mcap.exact_times import with_exact_pieces, with_exact_times
from cdtool.formats.mcap.log import Log
from cdtool.formats.mcap.messages import NO_DATE
from cdtool.formats.mcap.records import MAGIC
from cdtool.formats.mcap.sequence_jumps import SequenceJumps
from cdtool.formats.pieces import Pieces, join_pieces
from cdtool.formats.source import Source
from cdtool.messages.decoders import Decoders
from cdtool.messages.topic import wanted_columns, wanted_topics
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
    logged = [topic.name for topic in log.topics.values() if topic.count]
    columns, findings, origin = wanted_columns(log.path, wanted, topics, logged, log.origin)
    return source_of(log, columns, log.findings() + findings, origin)


def _origin(path: Path, log: Log) -> int:
    """Return the time [ns] of a log's first message, after its first piece was read."""
    first = log.section.first_time or 0
    if first >= NO_DATE:  # the times so far are not dates: the first valid one is known after reading all messages
        log = Log(path)
        for _ in log.pieces():
            pass
        return log.origin
    return first


def source_of(log: Log, columns: Mapping[str, Column], findings: Sequence[Finding], origin: int) -> Source:
    """Return these columns as a source, after all pieces of the log were read; times are relative to `origin` [ns]."""
    start, names = origin / 1e9, tuple(columns)
    return Source(log.path, "mcap", columns, start, tuple(findings), names=names, topics=log.topic_details)
