"""Where a message belongs: a channel of a log, its topic and its schema, as every container describes them."""

from __future__ import annotations

from typing import Protocol


class Schema(Protocol):
    """How the messages of a channel are laid out: a name, and a definition in an encoding such as `ros2msg`."""

    @property
    def name(self) -> str:
        """The type of the messages, such as `sensor_msgs/msg/JointState`."""
        ...

    @property
    def encoding(self) -> str:
        """The language of the definition."""
        ...

    @property
    def data(self) -> bytes:
        """The definition."""
        ...


class Channel(Protocol):
    """A stream of messages on a topic; several channels may share one topic."""

    @property
    def id(self) -> int:
        """The channel's number in its log."""
        ...

    @property
    def topic(self) -> str:
        """The topic's name."""
        ...

    @property
    def message_encoding(self) -> str:
        """How the messages are written, such as `cdr`."""
        ...


class Stream(Protocol):
    """A channel with its schema; None: there is none."""

    @property
    def channel(self) -> Channel:
        """The channel."""
        ...

    @property
    def schema(self) -> Schema | None:
        """Its schema."""
        ...
