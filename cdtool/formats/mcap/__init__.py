"""MCAP: topics of messages (JSON, ROS 2 CDR, ROS 1, protobuf), read piece by piece with every CRC checked."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from itertools import chain, islice
from pathlib import Path
from typing import ClassVar

from cdtool.channels import ChannelMap
from cdtool.columns import Column
from cdtool.errors import RecordingError
from cdtool.findings import Finding
from cdtool.formats.column_names import with_topics
from cdtool.formats.mcap.container.ahead import ahead
from cdtool.formats.mcap.container.log import Log
from cdtool.formats.mcap.container.messages import NO_DATE
from cdtool.formats.mcap.container.records import MAGIC
from cdtool.formats.mcap.exact_times import with_exact_pieces, with_exact_times
from cdtool.formats.mcap.mapped_pieces import MappedFields
from cdtool.formats.mcap.sequence_jumps import SequenceJumps
from cdtool.formats.mcap.uniform import UniformTaker
from cdtool.formats.pieces import Pieces, joined
from cdtool.formats.source import Source
from cdtool.large_integers import rounding_finding
from cdtool.messages.columns import UndecodableError
from cdtool.messages.decoders import Decoders
from cdtool.messages.fields import parse_field
from cdtool.messages.gathering import Gathering
from cdtool.messages.taken import Bound
from cdtool.messages.topic_survey import TopicSurvey

__all__ = ["Mcap"]


@dataclass(frozen=True)
class Mcap:
    """MCAP logs: a column is a topic and a numeric field of its messages, `/joint_states position[0]`."""

    name: ClassVar[str] = "mcap"
    suffixes: ClassVar[tuple[str, ...]] = (".mcap",)
    topics: ClassVar[bool] = True

    def sniff(self, path: Path) -> bool:
        """True if the file starts with MCAP's magic bytes."""
        with path.open("rb") as file:
            return file.read(len(MAGIC)) == MAGIC

    def columns(self, path: Path, wanted: ChannelMap | None = None) -> Source:
        """The fields that `wanted` names, or all numeric ones; raises RecordingError."""
        if wanted is None:
            return joined(self.pieces(path), sort=True)
        return with_exact_times(_wanted(path, wanted), wanted, partial(_wanted, path))

    def pieces(self, path: Path, _: Collection[str] | None = None) -> Pieces:
        """All numeric fields, some MiB of the file at a time; raises RecordingError."""
        log = Log(path)
        topics: dict[str, TopicSurvey] = {}
        jumps = SequenceJumps()
        origin: int | None = None
        for piece in ahead(log.pieces()):
            origin = _origin(path, log) if origin is None else origin
            jumps.add(piece, origin)
            for messages in piece:
                name = messages.stream.channel.topic
                survey = topics.setdefault(name, TopicSurvey(name))
                yield from survey.pieces(messages.stream, messages.batch, origin)
        findings = log.findings()
        columns: dict[str, Column] = {}
        for name in log.topics:
            for item in topics[name].found() if name in topics else ():
                if isinstance(item, Finding):
                    findings.append(item)
                else:
                    columns[item.name] = item
        return _source(path, log, columns, findings + jumps.findings(), log.origin)

    def exact_pieces(self, path: Path) -> Pieces:
        """What `pieces` gives; of a log that cdtool converted with the times that were written."""
        return with_exact_pieces(self.pieces(path), path)

    def mapped(self, path: Path, wanted: ChannelMap) -> MappedFields:
        """The fields that `wanted` names of a log that need not fit into memory; raises RecordingError."""
        return MappedFields(path, wanted)

    def element_names(self, path: Path, topic: str) -> tuple[str, ...]:
        """What the first message of a topic that can be decoded names the elements of its arrays; () if it does not."""
        decoders = Decoders()
        try:
            for messages in chain.from_iterable(Log(path, topic.__eq__).pieces()):
                decoder = decoders.of(messages.stream, messages.batch)
                if decoder is not None:
                    with suppress(UndecodableError):  # another channel of the topic may be decoded
                        return decoder.element_names(messages.batch.first(1))
        except RecordingError:  # the survey says what is wrong
            return ()
        return ()


def _wanted(path: Path, wanted: ChannelMap) -> Source:
    texts: dict[str, list[str]] = {}
    for source in wanted.sources:
        fields = texts.setdefault(source.topic, [])
        if source.field not in fields:
            fields.append(source.field)
    taker = UniformTaker(publish=wanted.time.clock == "publish")
    log = Log(path, texts.__contains__, taker=taker)
    topics = {
        name: Gathering(
            f"{path}: {name}",
            name,
            [parse_field(text, f"{path}: {name}") for text in fields],
            wanted.time.clock,
            wanted.joint_names,
            log.expected(name),
        )
        for name, fields in texts.items()
    }
    pieces = log.pieces()
    # The taker has to learn from the first piece before the second one is made.
    for piece in chain(islice(pieces, 1), ahead(pieces)):
        for messages in piece:
            topic = topics[messages.stream.channel.topic]
            if messages.parts:
                topic.confirm(messages.stream, messages.parts)
            else:
                topic.add(messages.stream, messages.batch)
        if any(not messages.parts for messages in piece):
            taker.learn(_bound(log, topics))
    findings = log.findings()
    wanted = with_topics(path, wanted, [topic.name for topic in log.topics.values() if topic.count])
    for name in dict.fromkeys(source.topic for source in wanted.sources):
        findings += topics[name].decoders.told(f"{path}", name) + topics[name].orders.findings()
    # A header's clock may be another one (simulated time): its own first stamp is its origin.
    stamps = [topic.first_stamp for topic in topics.values() if topic.first_stamp is not None]
    origin = log.origin if wanted.time.clock == "log" else min(stamps, default=log.origin)
    asked = dict.fromkeys((source.topic, texts[source.topic].index(source.field)) for source in wanted.sources)
    gathered = [(*topics[name].column(index, origin), topics[name].rounded(index)) for name, index in asked]
    for column, field_findings, rounded in gathered:
        findings += [*field_findings, *rounding_finding(column.name, rounded)]
    return _source(path, log, {column.name: column for column, _, _ in gathered}, findings, origin)


def _bound(log: Log, topics: Mapping[str, Gathering]) -> dict[int, Bound]:
    """By id the channels that whole chunks may hold to be taken: wanted ones with a recipe, and those not asked for."""
    channels = log.summary.channels.values()
    alone = Counter(channel.topic for channel in channels)
    bound: dict[int, Bound] = {}
    for channel in channels:
        if channel.topic not in topics:
            bound[channel.id] = None
        elif alone[channel.topic] == 1 and (found := topics[channel.topic].bound(channel.id)) is not None:
            bound[channel.id] = found
    return bound


def _origin(path: Path, log: Log) -> int:
    """Time [ns] of a log's first message, once its first piece is there."""
    first = log.section.room.first_time or 0
    if first >= NO_DATE:  # those so far are of no clock: which is the first that is shows at the end
        log = Log(path)
        for _ in log.pieces():
            pass
        return log.origin
    return first


def _source(path: Path, log: Log, columns: dict[str, Column], findings: list[Finding], origin: int) -> Source:
    return Source(
        path,
        Mcap.name,
        columns,
        origin / 1e9,
        tuple(findings),
        names=tuple(columns),
        topics=log.topic_details,
    )
