"""A case: the bytes of a file, and the messages and findings that are expected from it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

# The numeric field of every topic; all values are different, so that a value identifies its message.
FIELDS = {"/force": "data", "/state": "x", "/axis": "value", "/raw": "data", "/count": "count"}


@dataclass(frozen=True)
class Message:
    """A message as written; `time` is its log time [ns], `value` the value of its field in FIELDS."""

    topic: str
    time: int
    payload: bytes
    value: float

    @property
    def field(self) -> str:
        """Return the numeric field."""
        return FIELDS.get(self.topic, "data")


@dataclass(frozen=True)
class Truth:
    """The messages and findings that a reader must, may and must not return.

    `written`: the messages that the file contains or should contain; if any is missing, a loss must be reported.
    `required`: the messages that must be read; of `mostly_required` at least 95 %. Only `written` and `optional`
    messages may be read, unless no checksum covers the damage (`checked` is False). `loss`: True if a loss must be
    reported, False if it must not; `undetectable`: the file does not show that messages are missing. `refusable`: the
    whole file may be refused. `unverified`: the messages must be reported as unverified. `skippable`: the loss need not
    be reported if only some topics are requested.
    """

    written: tuple[Message, ...]
    required: tuple[Message, ...] = ()
    mostly_required: tuple[Message, ...] = ()
    optional: tuple[Message, ...] = ()
    loss: bool | None = None
    checked: bool = True
    undetectable: bool = False
    refusable: bool = False
    unverified: bool = False
    skippable: bool = False


@dataclass(frozen=True)
class Case:
    """A file with a kind of damage; `name` describes the damage."""

    name: str
    data: bytes
    truth: Truth

    @property
    def kind(self) -> str:
        """Return the kind of damage, which is the first word of the name."""
        return self.name.partition(" ")[0]


def without(messages: Iterable[Message], gone: Iterable[Message]) -> tuple[Message, ...]:
    """Return the messages without those that are gone."""
    lost = {id(message) for message in gone}
    return tuple(message for message in messages if id(message) not in lost)
