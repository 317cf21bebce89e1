"""A channel of a log with its topic and schema, the same for every container format."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Stream:
    """A channel, identified by its number in the log; several channels may write to one topic.

    `encoding` is the encoding of the messages, such as `cdr`. `definition` is their schema: its language, such as
    `ros2msg`, the message type, such as `sensor_msgs/msg/JointState`, and its text; all three are empty if unknown.
    """

    id: int
    topic: str
    encoding: str
    definition: tuple[str, str, bytes]
