"""A case: bytes of a file, and what a careful person would read in them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

# The numeric field of every topic; its values are all different, so that a value names its message.
FIELDS = {"/force": "data", "/state": "x", "/axis": "value", "/raw": "data", "/count": "count"}


@dataclass(frozen=True)
class Message:
    """One message as it was written; `time` is its log time [ns], `value` what its field of FIELDS holds."""

    topic: str
    time: int
    payload: bytes
    value: float

    @property
    def field(self) -> str:
        """The numeric field."""
        return FIELDS.get(self.topic, "data")


@dataclass(frozen=True)
class Truth:
    """What may, must and must not come of a file.

    `held`: what was written and is, or should be, in the file: where any of it is not given, that has to be said.
    `must`: what has to be given; of `mostly` at least 95 %. Nothing but `held` and `also` may be given, unless no
    checksum covers what is damaged (`checked` False). `loss`: True where one has to be said, False where none may be;
    `silent`: nothing in the file tells that something is gone. `refusable`: refusing the whole file is right, too.
    `unverified`: what is given has to be marked so. `passed_over`: who asks for some topics only need not hear of it.
    """

    held: tuple[Message, ...]
    must: tuple[Message, ...] = ()
    mostly: tuple[Message, ...] = ()
    also: tuple[Message, ...] = ()
    loss: bool | None = None
    checked: bool = True
    silent: bool = False
    refusable: bool = False
    unverified: bool = False
    passed_over: bool = False


@dataclass(frozen=True)
class Case:
    """A file of a kind of damage; `name` says how it was made."""

    name: str
    data: bytes
    truth: Truth

    @property
    def kind(self) -> str:
        """The kind of damage: the first word of the name."""
        return self.name.partition(" ")[0]


def without(messages: Iterable[Message], gone: Iterable[Message]) -> tuple[Message, ...]:
    """The messages that are not among those gone."""
    lost = {id(message) for message in gone}
    return tuple(message for message in messages if id(message) not in lost)
