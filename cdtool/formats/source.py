"""The result of a format's reader: named columns of numbers with their times, not yet assigned to channels."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar, Protocol

from cdtool.base.findings import Finding
from cdtool.formats.channels.channel_map import ChannelMap
from cdtool.formats.columns import Column


@dataclass(frozen=True)
class TopicDetails:
    """The details that a container states about a topic: message type, number of messages and encoding."""

    schema: str
    messages: int
    encoding: str = ""

    def __str__(self) -> str:
        return f"{self.schema}, {self.encoding + ', ' if self.encoding else ''}{self.messages} messages"

    @classmethod
    def of_parts(cls, parts: Sequence[TopicDetails]) -> TopicDetails:
        """Return the details of a topic from those in the parts of its log, with the sum of the messages."""
        schemas = dict.fromkeys(part.schema for part in parts)
        encodings = dict.fromkeys(part.encoding for part in parts)
        return cls(" or ".join(schemas), sum(part.messages for part in parts), " or ".join(encodings))


@dataclass(frozen=True)
class Source:
    """The columns of a file. `origin` [s] was subtracted from every `Column.time`, or from the stamps of a table.

    `names` are all columns of the file in its order, whether read or not; `first_row` is the line of the first sample
    (0: not known). `details` are statements of the file about itself, `topics` about each topic; `dialect` is the
    dialect of a text table, as `[csv]` of a machine file.
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
    """Return the statements of a log about itself and its topics as texts."""
    return {**details, **{name: str(topic) for name, topic in topics.items()}}


class Format(Protocol):
    """The contract of a format, which each format's class in this package implements."""

    name: ClassVar[str]
    suffixes: ClassVar[tuple[str, ...]]

    def sniff(self, path: Path) -> bool:
        """Return whether the file's first bytes are of this format."""
        ...

    def columns(self, path: Path, wanted: ChannelMap | None = None) -> Source:
        """Return the columns that `wanted` names, or all numeric columns; raises RecordingError."""
        ...


def stated_origin(text: str | bytes) -> float:
    """Return the origin [s] that a file states; 0 for anything else, as after an edit by hand."""
    try:
        origin = float(text)
    except ValueError:
        return 0.0
    return origin if math.isfinite(origin) else 0.0
