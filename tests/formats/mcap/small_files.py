"""Small files and functions that read them, for the tests of the container."""

from __future__ import annotations

import struct
from pathlib import Path

from mcap.writer import CompressionType, Writer

from cdtool.base.errors import RecordingError
from cdtool.base.findings import Finding
from cdtool.formats.mcap.log import Log

COMPRESSIONS = ("none", "lz4", "zstd")
Message = tuple[str, int, bytes]


def small_file(
    path: Path, compression: str = "none", messages: int = 24, chunk_size: int = 500, **options
) -> list[Message]:
    """Write a file of two topics in several chunks; return its messages: topic, log time, payload."""
    sent = []
    with path.open("wb") as file:
        writer = Writer(file, compression=CompressionType[compression.upper()], chunk_size=chunk_size, **options)
        writer.start()
        schema = writer.register_schema("std_msgs/msg/Float64", "ros2msg", b"float64 data")
        channels = {topic: writer.register_channel(topic, "cdr", schema) for topic in ("/a", "/b")}
        for i in range(messages):
            topic = "/b" if i % 3 == 2 else "/a"
            payload = b"\x00\x01\x00\x00" + struct.pack("<d", i / 7)
            writer.add_message(channels[topic], 10**9 + i * 10**6, payload, 10**9 + i * 10**6, i)
            sent.append((topic, 10**9 + i * 10**6, payload))
        writer.finish()
    return sent


def read(path: Path, **options) -> tuple[list[Message], list[Finding], Log]:
    """Return all messages in the order of the file, the findings and the log; only RecordingError may be raised."""
    log = Log(path, **options)
    messages = []
    for piece in log.blocks():
        rows = [
            (int(batch.start[i]), item.stream.topic, int(batch.log_time[i]), _payload(batch, i))
            for item in piece
            for batch in [item.batch]
            for i in range(len(batch))
        ]
        messages += [row[1:] for row in sorted(rows)]
    return messages, log.findings(), log


def read_or_refused(path: Path) -> tuple[list[Message], list[str]]:
    """Return messages and findings; for a refused file no messages and the error."""
    try:
        messages, findings, _ = read(path)
    except RecordingError as fault:
        assert str(path) in fault.message
        assert "\n" not in str(fault)
        return [], [str(fault)]
    return messages, [str(finding) for finding in findings if finding.severity != "note"]


def _payload(batch, i: int) -> bytes:
    return batch.data[batch.start[i] : batch.start[i] + batch.length[i]].tobytes()
