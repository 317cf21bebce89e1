"""ROS bags as logs of topics: what the readers of both kinds of bags share."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Generator, Sequence
from contextlib import closing
from pathlib import Path

import numpy as np

from cdtool.base.findings import Finding
from cdtool.formats.bags.topic_log import IsWanted, Messages, TopicLog
from cdtool.formats.containers.container_checks import check_size
from cdtool.formats.mcap.messages import HEADER
from cdtool.formats.messages.batch import Batch, Stream
from cdtool.formats.source import TopicDetails

# Blocks are yielded after this number of messages of one topic, or this number of bytes of all topics.
_MESSAGES, _BYTES = 4096, 1 << 23


class Bag(TopicLog):
    """A bag; a reader sets `end` to the reason if it stops at a damaged place.

    `counts` are message type and number of messages by topic, as the bag states them; `read` those so far.
    """

    def __init__(self, path: Path, is_wanted: IsWanted | None) -> None:
        super().__init__(path, is_wanted)
        self.counts: dict[str, tuple[str, int]] = {}
        self.read: dict[str, int] = {}
        self.end = ""
        self.noted: list[Finding] = []

    @abstractmethod
    def messages(self) -> Generator[tuple[Stream, int, bytes], None, None]:
        """Yield stream, time [ns] and payload of the messages of the wanted topics, after setting the attributes."""

    def blocks(self) -> Generator[Sequence[Messages], None, None]:
        """Yield the messages; raises RecordingError if they are larger than those of any log: the bag is a bomb."""
        buffered: dict[int, tuple[Stream, list[tuple[int, bytes]]]] = {}
        size = total = 0
        with closing(self.messages()) as messages:
            for stream, time, raw in messages:
                total += len(raw)
                check_size(self.path, total // 8)
                self.read[stream.topic] = self.read.get(stream.topic, 0) + 1
                _, rows = buffered.setdefault(stream.id, (stream, []))
                rows.append((time, raw))
                size += len(raw)
                if len(rows) == _MESSAGES or size > _BYTES:  # all topics at once, so that they stay in time order
                    yield [Messages(each, _batch(some)) for each, some in buffered.values()]
                    buffered, size = {}, 0
        yield [Messages(each, _batch(some)) for each, some in buffered.values()]
        self.topic_details = {
            topic: TopicDetails(kind, max(count, self.read.get(topic, 0)))
            for topic, (kind, count) in self.counts.items()
        }

    def findings(self) -> list[Finding]:
        """Return the findings on messages that cannot be read, and those that the reader noted."""
        unreadable = [
            Finding("messages_unreadable", topic, {"count": count - read, "messages": count, "reason": self.end})
            for topic, read in self.read.items()
            for count in [self.counts[topic][1]]
            if read < count
        ]
        damaged = [Finding("bag_damaged", "", {"reason": self.end})] if self.end and not unreadable else []
        return unreadable + damaged + self.noted


def one_line(fault: BaseException) -> str:
    """Return an error of a library in one line."""
    return " ".join(f"{type(fault).__name__}: {fault}".split())[:200]


def _batch(rows: list[tuple[int, bytes]]) -> Batch:
    times = np.array([time for time, _ in rows], dtype=np.uint64)
    length = np.array([len(raw) for _, raw in rows], dtype=np.int64)
    start = np.cumsum(length + HEADER) - length
    parts = (
        bytes(HEADER - 8) + stamp.tobytes() + raw for stamp, (_, raw) in zip(times.astype("<u8"), rows, strict=True)
    )
    return Batch(np.frombuffer(b"".join(parts), dtype=np.uint8), start, length, times)
