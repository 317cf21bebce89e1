"""What a format hands over: named columns of numbers with their times, not yet channels."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar, Protocol

from cdtool.channels import ChannelMap
from cdtool.columns import Column
from cdtool.findings import Finding


@dataclass(frozen=True)
class Source:
    """A file's columns. `origin` [s] has been taken off every `Column.time`, or off the stamps of a table.

    `names` are all columns of the file in its order, read or not; `first_row` is the file's line of the first sample
    (0: not known).
    """

    path: Path
    format: str
    columns: Mapping[str, Column]
    origin: float = 0.0
    findings: tuple[Finding, ...] = ()
    details: Mapping[str, str] = field(default_factory=dict)
    names: tuple[str, ...] = ()
    first_row: int = 0


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
