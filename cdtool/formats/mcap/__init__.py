"""MCAP: topics of messages (JSON, ROS 2 CDR, ROS 1, protobuf), read piece by piece with every CRC checked."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import ClassVar

from cdtool.channels import ChannelMap
from cdtool.columns import Piece
from cdtool.formats.mcap.exact_times import with_exact_times
from cdtool.formats.mcap.log import Log
from cdtool.formats.mcap.messages import NO_DATE
from cdtool.formats.mcap.records import MAGIC
from cdtool.formats.pieces import Pieces
from cdtool.formats.topic_log import IsWanted, TopicFormat, survey
from cdtool.messages.topic import BatchValues, Topic, sort_times, wanted_topics

__all__ = ["Mcap"]


@dataclass(frozen=True)
class Mcap(TopicFormat):
    """MCAP logs: a column is a topic and a numeric field of its messages, `/joint_states position[0]`."""

    name: ClassVar[str] = "mcap"
    suffixes: ClassVar[tuple[str, ...]] = (".mcap",)

    def sniff(self, path: Path) -> bool:
        """Return whether the file starts with MCAP's magic bytes."""
        with path.open("rb") as file:
            return file.read(len(MAGIC)) == MAGIC

    def log(self, path: Path, is_wanted: IsWanted | None = None) -> Log:
        """Open a file; raises RecordingError."""
        return Log(path, is_wanted)

    def exact_pieces(self, path: Path) -> Pieces:
        """Yield the same as `pieces`; for a log that cdtool converted, with the exact times that were written."""
        log = self.log(path)
        pieces = survey(log)
        return (yield from with_exact_times(pieces, log.exact_origin) if log.exact else pieces)

    def mapped(self, path: Path, wanted: ChannelMap) -> MappedFields:
        """Return the fields that `wanted` names, to be read piece by piece; raises RecordingError."""
        return MappedFields(path, wanted)


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

    def pieces(self) -> Pieces:
        """Yield the fields that `wanted` names, some MiB of the file at a time; raises RecordingError."""
        log = Log(self.path, {source.topic for source in self.wanted.sources}.__contains__)
        topics = wanted_topics(self.path, self.wanted, Topic, log.exact)
        fields = {source.described for source in self.wanted.sources}
        start = self.origin
        for messages in chain.from_iterable(log.blocks()):
            first = log.section.first_time
            if start is None and self.wanted.time.clock == "log" and first is not None and first < NO_DATE:
                start = first
            topic = topics[messages.stream.topic]
            decoded = topic.decode(messages.stream, messages.batch)
            if decoded is None or not len(decoded.stamps):
                continue
            start = int(decoded.stamps[0]) if start is None else start
            for text in decoded.values:
                if (name := f"{topic.topic} {text}") in fields and (
                    piece := _piece(name, text, topic, decoded, start)
                ).rows:
                    yield piece
        source, self.origin = log.mapped_source(self.wanted, topics)
        self.settled = self.origin == start
        return source


def _piece(name: str, text: str, topic: Topic, decoded: BatchValues, origin: int) -> Piece:
    """Return one field of a batch's messages, without the messages that do not name its joints."""
    stamps, exact, values = topic.rows_of(decoded, text)
    time, order = sort_times(stamps, origin, exact)
    rows = {} if values is None else {name: values if order is None else values[order]}
    return Piece(name, time, rows, len(time))
