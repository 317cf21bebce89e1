"""Messages of topics -> columns: what the readers of MCAP files and of both kinds of bags share.

Detect messages that are missing from the log by jumps of their sequence numbers.

A writer numbers its messages 1, 2, 3 ..., or leaves all sequence numbers 0 (MCAP specification, Message). Most writers
count each channel separately, some count all channels together.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Generator, Mapping, Sequence
from contextlib import closing, suppress
from itertools import chain
from pathlib import Path
from typing import ClassVar, NamedTuple

import numpy as np
import numpy.typing as npt

from cdtool.base.errors import RecordingError, naming
from cdtool.base.findings import Finding
from cdtool.formats.channels.channel_map import ChannelMap
from cdtool.formats.columns import Column
from cdtool.formats.messages.batch import Batch, Stream
from cdtool.formats.messages.decoders import Decoders
from cdtool.formats.messages.topic import Topic, wanted_columns, wanted_topics
from cdtool.formats.messages.topic_survey import TopicSurvey
from cdtool.formats.pieces import Pieces, join_pieces
from cdtool.formats.source import Source, TopicDetails

Numbers = npt.NDArray[np.uint32]
Times = npt.NDArray[np.uint64]


class SequenceJumps:
    """The sequence numbers of a log's messages, added piece by piece in the file's order."""

    def __init__(self) -> None:
        self._counts: dict[int, _SequenceCount] = {}
        self._all = _SequenceCount("")
        self._shared = True  # until a piece shows that the channels are not counted together

    def add(self, piece: Sequence[tuple[Stream, Batch, bool]], origin: int) -> None:
        """Add the messages of a piece; times in findings are relative to `origin` [ns]."""
        numbers, stamps = [], []
        for channel, batch, _ in piece:
            sequence = batch.sequence
            if sequence.any():
                count = self._counts.setdefault(channel.id, _SequenceCount(channel.topic))
                count.add(sequence, batch.log_time, origin)
                numbers.append(sequence)
                stamps.append(batch.log_time)
        if not numbers or not self._shared:
            return
        together = np.concatenate(numbers)
        order = np.argsort(together, kind="stable")
        together = together[order]
        # In a common count no number is repeated, and none is in a later piece.
        self._shared = bool(np.all(together[1:] != together[:-1])) and self._all.is_continued_by(together)
        self._all.add(together, np.concatenate(stamps)[order], origin)

    def findings(self) -> list[Finding]:
        """Return warnings on missing messages, after the last piece; empty if the numbers are not a count."""
        counts = list(self._counts.values())
        if self._shared and len(counts) > 1 and not all(count.is_count for count in counts):
            counts = [self._all]
        return [finding for count in counts for finding in count.findings()]


class _SequenceCount:
    """The steps of a count; `_jump_time` [s] is the time of the message before its first jump."""

    def __init__(self, topic: str) -> None:
        self._topic = topic
        self._last: Numbers = np.empty(0, np.uint32)
        self._last_time: Times = np.empty(0, np.uint64)
        self._jump_time: float | None = None
        self._steps = self._ones = self._back = self._jumps = self._missing = 0

    def is_continued_by(self, numbers: Numbers) -> bool:
        """Return whether the numbers of the next piece can continue this count: they are not far behind it."""
        return not len(self._last) or int(numbers[0]) + len(numbers) // 2 > int(self._last[0])

    def add(self, numbers: Numbers, stamps: Times, origin: int) -> None:
        known, times = np.concatenate((self._last, numbers)), np.concatenate((self._last_time, stamps))
        steps = np.diff(known).view(np.int32)  # modulo 2^32, where the count overflows
        jumps = np.flatnonzero(steps > 1)
        self._steps += len(steps)
        self._ones += int(np.count_nonzero(steps == 1))
        self._back += int(np.count_nonzero(steps < 1))
        self._jumps += len(jumps)
        self._missing += int(np.sum(steps[jumps].astype(np.int64) - 1))
        if len(jumps) and self._jump_time is None:
            self._jump_time = (int(times[jumps[0]]) - origin) / 1e9
        self._last, self._last_time = known[-1:].copy(), times[-1:].copy()

    @property
    def is_count(self) -> bool:
        """Whether most steps are by one, and hardly any goes back."""
        # A log from which messages were removed regularly has other steps.
        return self._ones >= 0.5 * self._steps and self._back <= 0.01 * self._steps

    def findings(self) -> list[Finding]:
        fact = {
            "jumps": self._jumps,
            "missing": self._missing,
            "after": self._jump_time,
            "of_topic": bool(self._topic),
        }
        return [Finding("missing_messages", self._topic, fact)] if self._jumps and self.is_count else []


IsWanted = Callable[[str], bool]


class Messages(NamedTuple):
    """Messages of one channel; `covered`: a CRC covers them and their definitions."""

    stream: Stream
    batch: Batch
    covered: bool = False


class TopicLog(ABC):
    """A log that is read once, from start to end.

    `origin` [ns] is valid from the first block on, `topic_details` and `findings()` after the last one. If cdtool
    converted the log, the field `exact` has the exact time [s] of each message, relative to `exact_origin` [s].
    """

    format: ClassVar[str]
    exact, exact_origin = "", 0.0

    def __init__(self, path: Path, is_wanted: IsWanted | None) -> None:
        self.path = path
        self.is_wanted = is_wanted or (lambda _: True)
        self.origin = 0
        self.topic_details: Mapping[str, TopicDetails] = {}

    @abstractmethod
    def blocks(self) -> Generator[Sequence[Messages], None, None]:
        """Yield the messages of the wanted topics, block by block in the order of the log; raises RecordingError."""

    @abstractmethod
    def findings(self) -> list[Finding]:
        """Return the findings on losses and on the container."""

    def source(self, columns: Mapping[str, Column], findings: Sequence[Finding], start: float) -> Source:
        """Return these columns as a source, after all blocks were read; times are relative to `start` [s]."""
        names, details = tuple(columns), self.topic_details
        return Source(self.path, self.format, columns, start, tuple(findings), names=names, topics=details)

    def mapped_source(self, wanted: ChannelMap, topics: Mapping[str, Topic]) -> Source:
        """Return the columns of a channel map, after all blocks were read."""
        logged = [name for name, topic in self.topic_details.items() if topic.messages]
        columns, findings, origin = wanted_columns(self.path, wanted, topics, logged, self.origin)
        start = self.exact_origin if self.exact else origin / 1e9
        return self.source(columns, self.findings() + findings, start)


class TopicFormat(ABC):
    """A format of logs of topics: a column is a topic and a numeric field of its messages, `/joint_states position[0]`.

    Its subclasses are dataclasses without fields: formats are compared and pickled.
    """

    topics: ClassVar[bool] = True

    @abstractmethod
    def log(self, path: Path, is_wanted: IsWanted | None = None) -> TopicLog:
        """Open a log; messages of other topics than the wanted ones are only counted; raises RecordingError."""

    def columns(self, path: Path, wanted: ChannelMap | None = None) -> Source:
        """Return the fields that `wanted` names, or all numeric fields; raises RecordingError."""
        if wanted is None:
            return join_pieces(self.pieces(path), sort=True)
        with naming(path):
            log = self.log(path, {source.topic for source in wanted.sources}.__contains__)
            topics = wanted_topics(path, wanted, log.exact)
            for stream, batch, *_ in chain.from_iterable(log.blocks()):
                topics[stream.topic].add(stream, batch)
            return log.mapped_source(wanted, topics)

    def pieces(self, path: Path, keys: Collection[str] | None = None) -> Pieces:  # noqa: ARG002  all keys
        """Yield all numeric fields, some MiB of the file at a time; raises RecordingError."""
        with naming(path):
            return (yield from survey(self.log(path)))

    def element_names(self, path: Path, topic: str) -> tuple[str, ...]:
        """Return the names of array elements in a topic's first decodable message; () if it has none."""
        decoders, blocks = Decoders(), self.log(path, topic.__eq__).blocks()
        with suppress(RecordingError), closing(blocks):  # the survey reports the problem
            for stream, batch, *_ in chain.from_iterable(blocks):
                names = decoders.element_names(stream, batch)
                if names is not None:
                    return names
        return ()


def survey(log: TopicLog) -> Pieces:
    """Yield all numeric fields of a log, some MiB of it at a time; raises RecordingError."""
    topics: dict[str, TopicSurvey] = {}
    jumps = SequenceJumps()
    for block in log.blocks():
        jumps.add(block, log.origin)
        for stream, batch, *_ in block:
            topic = topics.setdefault(stream.topic, TopicSurvey(stream.topic))
            if (piece := topic.piece(stream, batch, log.origin)) is not None:
                yield piece
    findings = log.findings()
    columns: dict[str, Column] = {}
    for name in (name for name in log.topic_details if name in topics):
        of_topic, of_findings = topics[name].columns_and_findings()
        columns |= of_topic
        findings += of_findings
    return log.source(columns, findings + jumps.findings(), log.origin / 1e9)
