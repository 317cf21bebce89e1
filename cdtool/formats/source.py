"""What a format hands over: named columns of numbers with their times, not yet channels."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar, Protocol

from cdtool.channels import ChannelMap
from cdtool.columns import Column
from cdtool.findings import Finding


@dataclass(frozen=True)
class TopicDetails:
    """What a container states about a topic: the type of its messages, how many it holds, and how they are encoded."""

    schema: str
    messages: int
    encoding: str = ""

    def __str__(self) -> str:
        return f"{self.schema}, {self.encoding + ', ' if self.encoding else ''}{self.messages} messages"

    @classmethod
    def of_parts(cls, parts: Sequence[TopicDetails]) -> TopicDetails:
        """Return those of a topic by those of the parts of its log: the messages of all are added up."""
        schemas = dict.fromkeys(part.schema for part in parts)
        encodings = dict.fromkeys(part.encoding for part in parts)
        return cls(" or ".join(schemas), sum(part.messages for part in parts), " or ".join(encodings))


@dataclass(frozen=True)
class Source:
    """A file's columns. `origin` [s] has been taken off every `Column.time`, or off the stamps of a table.

    `names` are all columns of the file in its order, read or not; `first_row` is the file's line of the first sample
    (0: not known). `details` are what the file states about itself, `topics` what it states about each topic;
    `dialect` is how a table of text is written, as `[csv]` of a machine file.
    """

    path: Path
    format: str
    columns: Mapping[str, Column]
    origin: float = 0.0
    findings: tuple[Finding, ...] = ()
    details: Mapping[str, str] = field(default_factory=dict)
    names: tuple[str, ...] = ()
    first_row: int = 0
    dialect: str = ""
    topics: Mapping[str, TopicDetails] = field(default_factory=dict)


def in_words(details: Mapping[str, str], topics: Mapping[str, TopicDetails]) -> dict[str, str]:
    """Return what a log states about itself and its topics, in words."""
    return {**details, **{name: str(topic) for name, topic in topics.items()}}


class Format(Protocol):
    """The contract of a format; each class below formats/ is one, registered under its file's name."""

    name: ClassVar[str]
    suffixes: ClassVar[tuple[str, ...]]

    def sniff(self, path: Path) -> bool:
        """True if the file's first bytes are of this format."""
        ...

    def columns(self, path: Path, wanted: ChannelMap | None = None) -> Source:
        """The columns that `wanted` names, or all numeric ones; raises RecordingError."""
        ...
