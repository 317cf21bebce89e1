"""The ways in which a file is read: survey, wanted channels, and the container's records, streamed and by the index."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

from cdtool.channels import ChannelMap, ChannelSource, TimeSource
from cdtool.errors import RecordingError
from cdtool.findings import Finding
from cdtool.formats.mcap import Mcap
from cdtool.formats.mcap.container.log import Log
from cdtool.formats.source import Source
from tests.formats.mcap_damage.truth import FIELDS, Message

# What tells messages apart: topic and value, or topic and payload.
Key = tuple[str, bytes]


@dataclass(frozen=True)
class Reading:
    """What a way gave: (key, time [s]) of every message, findings, or why it refused. `topics`: what was asked for.

    `origin` [s] has been added to the times, and its resolution is theirs.
    """

    given: tuple[tuple[Key, float], ...] = ()
    findings: tuple[Finding, ...] = ()
    refusal: RecordingError | None = None
    topics: tuple[str, ...] | None = None
    origin: float = 0.0

    def says(self, *words: str) -> bool:
        """A finding has one of the words."""
        return any(word in finding.message for finding in self.findings for word in words)

    @property
    def lossy(self) -> bool:
        """It said that something is lost."""
        return self.refusal is not None or any(finding.severity == "loss" for finding in self.findings)


Way = Callable[[Path, tuple[str, ...]], Reading]


def value_key(message: Message) -> Key:
    """Topic and value to the bit; one NaN is as good as another."""
    return message.topic, _bits(message.value)


def payload_key(message: Message) -> Key:
    """Topic and payload."""
    return message.topic, message.payload


def survey(path: Path, topics: tuple[str, ...]) -> Reading:
    """Every numeric field."""
    return _refusable(lambda: _of_source(Mcap().columns(path)))


def wanted(path: Path, topics: tuple[str, ...]) -> Reading:
    """The field of some topics."""
    sources = tuple(ChannelSource("speed", topic=topic, field=FIELDS.get(topic, "data")) for topic in topics)
    asked = ChannelMap(TimeSource(), sources, ("axis",), topics=True)
    return _refusable(lambda: _of_source(Mcap().columns(path, asked), topics), topics)


def streamed(path: Path, topics: tuple[str, ...]) -> Reading:
    """The payloads of all messages, from the front."""
    return _refusable(lambda: _of_log(Log(path, use_index=False)))


def indexed(path: Path, topics: tuple[str, ...]) -> Reading:
    """The payloads of some topics, chunks without them being passed over."""
    return _refusable(lambda: _of_log(Log(path, topics.__contains__), topics), topics)


WAYS: dict[Way, Callable[[Message], Key]] = {
    survey: value_key,
    wanted: value_key,
    streamed: payload_key,
    indexed: payload_key,
}


def _refusable(read: Callable[[], Reading], topics: tuple[str, ...] | None = None) -> Reading:
    try:
        return read()
    except RecordingError as fault:
        return Reading(refusal=fault, topics=topics)


def _of_source(source: Source, topics: tuple[str, ...] | None = None) -> Reading:
    given: list[tuple[Key, float]] = []
    for name, column in source.columns.items():
        topic, _, field = name.rpartition(" ")
        if field == FIELDS.get(topic, field) and column.time is not None:
            keys: Iterable[Key] = ((topic, _bits(value)) for value in column.values.tolist())
            given += zip(keys, (column.time + source.origin).tolist(), strict=True)
    return Reading(tuple(given), source.findings, topics=topics, origin=source.origin)


def _of_log(log: Log, topics: tuple[str, ...] | None = None) -> Reading:
    given: list[tuple[Key, float]] = []
    for piece in log.pieces():
        for messages in piece:
            batch, topic = messages.batch, messages.stream.topic
            rows = zip(batch.start.tolist(), batch.length.tolist(), batch.log_time.tolist(), strict=True)
            given += (((topic, bytes(batch.data[at : at + size])), time / 1e9) for at, size, time in rows)
    return Reading(tuple(given), tuple(log.findings()), topics=topics)


def _bits(value: float) -> bytes:
    return b"NaN" if math.isnan(value) else struct.pack("<d", value)
