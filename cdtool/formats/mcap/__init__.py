"""MCAP: topics of messages, JSON or ROS 2 CDR. Read from the front with every CRC checked."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar

import numpy as np

from cdtool.channels import ChannelMap
from cdtool.errors import RecordingError, nearest
from cdtool.formats.mcap.decode import Decoded, decode_topic, field_column, stamp_of, survey_columns
from cdtool.formats.mcap.fields import header_stamp
from cdtool.formats.mcap.read import MAGIC, Log, Topic, read_log
from cdtool.formats.source import Column, Source
from cdtool.recording import Finding

__all__ = ["Mcap"]


@dataclass(frozen=True)
class Mcap:
    """MCAP logs with JSON or ROS 2 CDR messages: a column is a topic and a field, `/joint_states position[0]`."""

    name: ClassVar[str] = "mcap"
    suffixes: ClassVar[tuple[str, ...]] = (".mcap",)

    def sniff(self, path: Path) -> bool:
        """True if the file starts with MCAP's magic bytes."""
        with path.open("rb") as file:
            return file.read(len(MAGIC)) == MAGIC

    def columns(self, path: Path, wanted: ChannelMap | None = None) -> Source:
        """The fields that `wanted` names, or all numeric ones; raises RecordingError."""
        if wanted is None:
            return self._survey(path)
        asked = {source.topic for source in wanted.sources}
        log = read_log(path, asked.__contains__)
        findings = list(log.findings)
        for source in wanted.sources:
            if source.topic not in log.topics or not log.topics[source.topic].count:
                known = [topic.name for topic in log.topics.values() if topic.count]
                raise RecordingError(
                    f"{path}: no message of topic '{source.topic}' (channel '{source.channel}')",
                    nearest(source.topic, known),
                )
        decoded = {name: _decoded(path, log.topics[name], findings) for name in asked}
        origin = self._origin(path, log, decoded, wanted)
        columns: dict[str, Column] = {}
        for source in wanted.sources:
            topic = log.topics[source.topic]
            clock, messages = wanted.time.clock, decoded[source.topic]
            column, found = field_column(path, topic, messages, source.field, clock, origin, wanted.joints)
            if column.name not in columns:
                columns[column.name] = column
                findings += found
        return self._source(path, log, columns, findings, origin)

    def _survey(self, path: Path) -> Source:
        log = read_log(path, lambda _: True)
        findings = list(log.findings)
        columns: dict[str, Column] = {}
        for topic in log.topics.values():
            decoded = decode_topic(topic)
            topic.messages = []
            if decoded.failed:
                # A topic that nobody has asked for is no loss.
                findings.append(replace(_failure(topic, decoded), severity="warning"))
            for item in survey_columns(topic, decoded, log.origin):
                if isinstance(item, Finding):
                    findings.append(item)
                else:
                    columns[item.name] = item
            findings += _header_finding(topic, decoded)
        return self._source(path, log, columns, findings, log.origin)

    def _origin(self, path: Path, log: Log, decoded: dict[str, Decoded], wanted: ChannelMap) -> int:
        # A header's clock may be another one (simulated time): its own first stamp is its origin.
        if wanted.time.clock == "log":
            return log.origin
        stamps = [
            stamp_of(*part.messages[0], wanted.time.clock, f"{path}: {name}")
            for name, part in decoded.items()
            if part.messages
        ]
        return min(stamps, default=log.origin)

    def _source(self, path: Path, log: Log, columns: dict[str, Column], findings: list[Finding], origin: int) -> Source:
        details = {
            topic.name: f"{topic.schema}, {topic.encoding}, {topic.count} messages" for topic in log.topics.values()
        }
        return Source(path, self.name, columns, origin / 1e9, tuple(findings), details, tuple(columns))


def _decoded(path: Path, topic: Topic, findings: list[Finding]) -> Decoded:
    decoded = decode_topic(topic)
    if not decoded.messages:
        raise RecordingError(
            f"{path}: no message of {topic.name} can be decoded: {decoded.reason}",
            "record it as JSON or ROS 2 CDR with its message definition",
        )
    if decoded.failed:
        findings.append(_failure(topic, decoded))
    return decoded


def _failure(topic: Topic, decoded: Decoded) -> Finding:
    return Finding(
        f"{decoded.failed} of {topic.count} messages cannot be decoded: {decoded.reason}", topic.name, "loss"
    )


def _header_finding(topic: Topic, decoded: Decoded) -> list[Finding]:
    late = [
        (raw.log_time - stamp) / 1e6
        for raw, message in decoded.messages
        if (stamp := header_stamp(message)) is not None
    ]
    if not late or not any(late):
        return []
    if not any(header_stamp(message) for _, message in decoded.messages):
        return [Finding("the header's stamps are never set: use the log clock", topic.name, "note")]
    low, median, high = np.percentile(late, (5, 50, 95))
    text = f"logged {median:.3f} ms (median; 5 to 95 %: {low:.3f} to {high:.3f} ms) after the header's stamp"
    return [Finding(text, topic.name, "note")]
