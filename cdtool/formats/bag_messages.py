"""Messages of ROS bags -> columns: what the readers of both kinds of bags share."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Generator
from contextlib import closing, suppress
from functools import partial
from pathlib import Path

import numpy as np

from cdtool.channels import ChannelMap
from cdtool.columns import Column, Piece
from cdtool.errors import RecordingError
from cdtool.findings import Finding
from cdtool.formats.container_checks import check_size
from cdtool.formats.source import Source, TopicDetails
from cdtool.messages.batch import Batch, Stream
from cdtool.messages.decoders import Decoders
from cdtool.messages.topic import wanted_columns, wanted_topics
from cdtool.messages.topic_columns import TopicColumns
from cdtool.messages.topic_survey import TopicSurvey

# Batches are yielded after this number of messages of one topic, or this number of bytes of all topics.
_MESSAGES, _BYTES = 4096, 1 << 23
# In a batch each payload follows the header of an MCAP message [bytes], whose last field is the publish time.
_HEADER = 22

IsWanted = Callable[[str], bool]


class Bag(ABC):
    """A bag that is read once; after that `topics` (message type, number of messages) and `origin` [ns] are set.

    A reader sets `end` to the reason if it stops at a damaged place. `read` are the messages so far, by topic.
    """

    def __init__(self, path: Path, format_name: str) -> None:
        self.path, self._format = path, format_name
        self.origin = 0
        self.topics: dict[str, tuple[str, int]] = {}
        self.end = ""
        self.findings: list[Finding] = []
        self.read: dict[str, int] = {}

    @abstractmethod
    def messages(self, is_wanted: IsWanted) -> Generator[tuple[Stream, int, bytes], None, None]:
        """Yield stream, time [ns] and payload of the messages of the wanted topics, after setting the attributes."""

    def source(self, columns: dict[str, Column], findings: list[Finding]) -> Source:
        """Return the bag's columns with its origin, topics and findings."""
        topics = {topic: TopicDetails(kind, count) for topic, (kind, count) in self.topics.items()}
        start, names = self.origin / 1e9, tuple(columns)
        return Source(self.path, self._format, columns, start, tuple(findings), names=names, topics=topics)

    def pieces(self) -> Generator[Piece, None, tuple[dict[str, Column], list[Finding]]]:
        """Yield every numeric field; return the columns, without rows, and the findings."""
        topics: dict[str, TopicSurvey] = {}
        for stream, batch in self.batches(lambda _: True):
            name = stream.topic
            yield from topics.setdefault(name, TopicSurvey(name)).pieces(stream, batch, self.origin)
        columns: dict[str, Column] = {}
        findings = self._losses() + self.findings
        for topic in topics.values():
            of_topic, of_findings = topic.columns_and_findings()
            columns |= of_topic
            findings += of_findings
        return columns, findings

    def wanted(self, wanted: ChannelMap) -> tuple[dict[str, Column], list[Finding]]:
        """Return the fields of a channel map, and the findings."""
        topics = wanted_topics(self.path, wanted, partial(TopicColumns, expected={}))
        for stream, batch in self.batches(topics.__contains__):
            topics[stream.topic].add(stream, batch)
        logged = [name for name, (_, count) in self.topics.items() if count]
        columns, findings, self.origin = wanted_columns(self.path, wanted, topics, logged, self.origin)
        return columns, self._losses() + self.findings + findings

    def element_names(self, topic: str) -> tuple[str, ...]:
        """Return the names of array elements in a topic's first decodable message; () if it has none."""
        decoders = Decoders()
        batches = self.batches(topic.__eq__)
        with closing(batches), suppress(RecordingError):  # the survey reports the problem
            for stream, batch in batches:
                names = decoders.element_names(stream, batch)
                if names is not None:
                    return names
        return ()

    def batches(self, is_wanted: IsWanted) -> Generator[tuple[Stream, Batch], None, None]:
        """Yield the messages of the wanted topics, batch by batch.

        Raises RecordingError if the messages are larger than those of any log: the bag is a decompression bomb.
        """
        buffered: dict[int, tuple[Stream, list[tuple[int, bytes]]]] = {}
        size = total = 0
        with closing(self.messages(is_wanted)) as messages:
            for stream, time, raw in messages:
                total += len(raw)
                check_size(self.path, total // 8)
                self.read[stream.topic] = self.read.get(stream.topic, 0) + 1
                _, rows = buffered.setdefault(stream.id, (stream, []))
                rows.append((time, raw))
                size += len(raw)
                if len(rows) == _MESSAGES or size > _BYTES:  # all topics at once, so that they stay in time order
                    yield from ((each, _batch(some)) for each, some in buffered.values())
                    buffered, size = {}, 0
        yield from ((each, _batch(some)) for each, some in buffered.values())

    def _losses(self) -> list[Finding]:
        unreadable = [
            Finding(
                "messages_unreadable",
                topic,
                {"count": self.topics[topic][1] - count, "messages": self.topics[topic][1], "reason": self.end},
            )
            for topic, count in self.read.items()
            if count < self.topics[topic][1]
        ]
        return unreadable or ([Finding("bag_damaged", "", {"reason": self.end})] if self.end else [])


def one_line(fault: BaseException) -> str:
    """Return an error of a library in one line."""
    return " ".join(f"{type(fault).__name__}: {fault}".split())[:200]


def _batch(rows: list[tuple[int, bytes]]) -> Batch:
    times = np.array([time for time, _ in rows], dtype=np.uint64)
    length = np.array([len(raw) for _, raw in rows], dtype=np.int64)
    start = np.cumsum(length + _HEADER) - length
    parts = (
        bytes(_HEADER - 8) + stamp.tobytes() + raw for stamp, (_, raw) in zip(times.astype("<u8"), rows, strict=True)
    )
    return Batch(np.frombuffer(b"".join(parts), dtype=np.uint8), start, length, times)
