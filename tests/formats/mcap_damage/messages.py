"""The messages of the files: four topics with different encodings; all values are different."""

from __future__ import annotations

import json
import struct
from dataclasses import dataclass

import numpy as np

from tests.formats.mcap_damage import records
from tests.formats.mcap_damage.truth import Message

START = 1_000_000_000  # ns; times in seconds are then exact to the ns


@dataclass(frozen=True)
class Definition:
    """A topic's channel and schema with their ids."""

    channel: int
    schema: int
    topic: str
    encoding: str
    schema_name: str
    schema_encoding: str
    schema_data: bytes

    @property
    def records(self) -> bytes:
        """Return schema and channel record; only the channel record if the schema id is 0."""
        channel = records.channel(self.channel, self.schema, self.topic, self.encoding)
        if not self.schema:
            return channel
        return records.schema(self.schema, self.schema_name, self.schema_encoding, self.schema_data) + channel


_STAMPED = b"std_msgs/Header header\nfloat64 value\n" + b"=" * 80
_STAMPED += b"\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n" + b"=" * 80
_STAMPED += b"\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"

DEFINITIONS = {
    "/force": Definition(1, 1, "/force", "cdr", "std_msgs/msg/Float64", "ros2msg", b"float64 data"),
    "/state": Definition(2, 0, "/state", "json", "", "", b""),
    "/axis": Definition(3, 2, "/axis", "cdr", "machine_msgs/msg/Axis", "ros2msg", _STAMPED),
    "/raw": Definition(4, 3, "/raw", "ros1", "std_msgs/Float64", "ros1msg", b"float64 data"),
}
TOPICS = tuple(DEFINITIONS)
# /count and /other replace /force.
CHANNELS = {**{topic: definition.channel for topic, definition in DEFINITIONS.items()}, "/count": 1, "/other": 1}
ALL_DEFINITIONS = b"".join(definition.records for definition in DEFINITIONS.values())


def payload(topic: str, time: int, value: float, big_endian: bool = False) -> bytes:
    """Return a value as a payload in the topic's encoding."""
    order = ">" if big_endian else "<"
    kind = b"\0\0\0\0" if big_endian else b"\0\1\0\0"
    if topic == "/force":
        return kind + struct.pack(order + "d", value)
    if topic == "/state":
        return json.dumps({"note": "up, down", "x": value}).encode()
    if topic == "/axis":
        # The body is aligned after the four bytes of the encapsulation: 4 + 4 + 4 + 5 bytes, 7 of padding, 8.
        return kind + struct.pack(order + "iII5s7xd", time // 10**9, time % 10**9, 5, b"base\0", value)
    if topic == "/raw":
        return struct.pack("<d", value)
    raise KeyError(topic)


def ordinary(rng: np.random.Generator, count: int) -> list[Message]:
    """Return `count` messages, one per ms; every third group of eight is only /raw, so that some chunks are, too."""
    messages = []
    for i, value in enumerate(rng.normal(size=count).tolist()):
        topic = "/raw" if i // 8 % 3 == 2 else TOPICS[i % 3]
        time = START + i * 1_000_000
        messages.append(Message(topic, time, payload(topic, time, value), value))
    return messages


def record_of(message: Message, sequence: int = 0) -> bytes:
    """Return the message's record."""
    return records.message(CHANNELS[message.topic], message.time, message.payload, sequence)
