"""Where a message belongs: a channel of a log, its topic and its schema, as every container describes them."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Stream:
    """A channel by its number in its log; several may write to one topic.

    `encoding` is how its messages are written, such as `cdr`; `definition` is how they are laid out: a language such as
    `ros2msg`, the type of the messages, such as `sensor_msgs/msg/JointState`, and the text; all empty: unknown.
    """

    id: int
    topic: str
    encoding: str
    definition: tuple[str, str, bytes]
