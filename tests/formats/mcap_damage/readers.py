"""Readers of a file: survey, wanted channels, and the container's records, streamed and by the index."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

from cdtool.base.errors import RecordingError
from cdtool.base.findings import Finding
from cdtool.formats.channels.channel_map import ChannelMap, ChannelSource, TimeSource
from cdtool.formats.mcap import Mcap
from cdtool.formats.mcap.log import Log
from cdtool.formats.source import Source
from tests.formats.mcap_damage.truth import FIELDS, Message

# The identity of a message: topic and value, or topic and payload.
Key = tuple[str, bytes]


@dataclass(frozen=True)
class Reading:
    """The result of a reader: (key, time [s]) of every message and findings, or the refusal; `topics` were requested.

    `origin` [s] was added to the times, which therefore have its resolution.
    """

    messages: tuple[tuple[Key, float], ...] = ()
    findings: tuple[Finding, ...] = ()
    refusal: RecordingError | None = None
    topics: tuple[str, ...] | None = None
    origin: float = 0.0

    def has(self, *kinds: str) -> bool:
        """Return whether a finding is of one of the kinds."""
        return any(finding.kind in kinds for finding in self.findings)

    @property
    def lossy(self) -> bool:
        """Return whether a loss is reported."""
        return self.refusal is not None or any(finding.severity == "loss" for finding in self.findings)


Reader = Callable[[Path, tuple[str, ...]], Reading]


def value_key(message: Message) -> Key:
    """Return topic and value as bytes; all NaN are equal."""
    return message.topic, _bits(message.value)


def payload_key(message: Message) -> Key:
    """Return topic and payload."""
    return message.topic, message.payload


def survey(path: Path, topics: tuple[str, ...]) -> Reading:
    """Read every numeric field."""
    return _refusable(lambda: _of_source(Mcap().columns(path)))


def wanted(path: Path, topics: tuple[str, ...]) -> Reading:
    """Read the fields of some topics."""
    sources = tuple(ChannelSource("speed", topic=topic, field=FIELDS.get(topic, "data")) for topic in topics)
    channels = ChannelMap(TimeSource(), sources, ("axis",), topics=True)
    return _refusable(lambda: _of_source(Mcap().columns(path, channels), topics), topics)


def streamed(path: Path, topics: tuple[str, ...]) -> Reading:
    """Read the payloads of all messages, from the start of the file."""
    return _refusable(lambda: _of_log(Log(path)))


def indexed(path: Path, topics: tuple[str, ...]) -> Reading:
    """Read the payloads of some topics, skipping chunks without them."""
    return _refusable(lambda: _of_log(Log(path, topics.__contains__), topics), topics)


READERS: dict[Reader, Callable[[Message], Key]] = {
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
    read: list[tuple[Key, float]] = []
    for name, column in source.columns.items():
        topic, _, field = name.rpartition(" ")
        if field == FIELDS.get(topic, field) and column.time is not None:
            keys: Iterable[Key] = ((topic, _bits(value)) for value in column.values.tolist())
            read += zip(keys, (column.time + source.origin).tolist(), strict=True)
    return Reading(tuple(read), source.findings, topics=topics, origin=source.origin)


def _of_log(log: Log, topics: tuple[str, ...] | None = None) -> Reading:
    read: list[tuple[Key, float]] = []
    for piece in log.blocks():
        for messages in piece:
            batch, topic = messages.batch, messages.stream.topic
            rows = zip(batch.start.tolist(), batch.length.tolist(), batch.log_time.tolist(), strict=True)
            read += (((topic, bytes(batch.data[at : at + size])), time / 1e9) for at, size, time in rows)
    return Reading(tuple(read), tuple(log.findings()), topics=topics)


def _bits(value: float) -> bytes:
    return b"NaN" if math.isnan(value) else struct.pack("<d", value)
