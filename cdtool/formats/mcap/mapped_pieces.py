"""The fields of an MCAP log that a machine file maps, piece by piece, and what an MCAP log gives at its end."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from cdtool.channels import ChannelMap
from cdtool.columns import Column, Piece
from cdtool.formats.column_names import with_topics
from cdtool.formats.mcap.container.ahead import ahead
from cdtool.formats.mcap.container.log import Log
from cdtool.formats.mcap.container.messages import NO_DATE
from cdtool.formats.mcap.exact_times import EXACT_TIME, exact_times
from cdtool.formats.pieces import Pieces
from cdtool.formats.source import Source
from cdtool.messages.topic import Taken, Topic, in_order, wanted_columns, wanted_topics
from cdtool.recording import Finding


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
        self._converted = exact_times(self.path)
        self._asked = {source.described for source in self.wanted.sources}

    def pieces(self) -> Pieces:
        """Yield the fields that `wanted` names, some MiB of the file at a time; raises RecordingError."""
        topics = wanted_topics(self.path, self.wanted, Topic, () if self._converted is None else (EXACT_TIME,))
        log = Log(self.path, topics.__contains__)
        start = self.origin
        for piece in ahead(log.pieces()):
            first = log.section.room.first_time
            if start is None and self.wanted.time.clock == "log" and first is not None and first < NO_DATE:
                start = first
            for messages in piece:
                topic = topics[messages.stream.topic]
                taken = topic.take(messages.stream, messages.batch)
                if taken is None or not len(taken[0]):
                    continue
                start = int(taken[0][0]) if start is None else start
                for text in taken[1]:
                    if (name := f"{topic.topic} {text}") in self._asked:
                        piece = self._piece(name, text, taken, start)
                        if piece.rows:
                            yield piece
        source, self.origin = mapped_source_of(log, self.wanted, topics)
        self.settled = self.origin == start
        if self._converted is None:
            return source
        return replace(source, origin=float(self._converted.get("cdtool.origin_s", "0")))

    def _piece(self, name: str, text: str, taken: Taken, origin: int) -> Piece:
        """Return the messages of a batch that name the field's joints."""
        stamps, (values, other) = taken[0], taken[1][text]
        exact = None if self._converted is None else taken[1][EXACT_TIME][0]
        if other is not None:
            stamps = stamps[~other]
            values, exact = (None if each is None else each[~other] for each in (values, exact))
        time, order = in_order(stamps, origin)
        time = time if exact is None else exact if order is None else exact[order]
        rows = {} if values is None else {name: values if order is None else values[order]}
        return Piece(name, time, rows, len(time))


def mapped_source_of(log: Log, wanted: ChannelMap, topics: Mapping[str, Topic]) -> tuple[Source, int]:
    """Return the columns of a map, once the log was run through, and what their times count from [ns]."""
    held = with_topics(log.path, wanted, [topic.name for topic in log.topics.values() if topic.count])
    columns, findings, origin = wanted_columns(log.path, held, topics, log.origin)
    return source_of(log, columns, log.findings() + findings, origin), origin


def source_of(log: Log, columns: Mapping[str, Column], findings: Sequence[Finding], origin: int) -> Source:
    """Return these columns of a log that was run through; their times count from `origin` [ns]."""
    details = {topic.name: f"{topic.schema}, {topic.encoding}, {topic.count} messages" for topic in log.topics.values()}
    return Source(log.path, "mcap", columns, origin / 1e9, tuple(findings), details, tuple(columns))
