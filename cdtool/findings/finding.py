"""A finding: which fact, about which channel and file, how severe."""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import asdict
from typing import Any, ClassVar, Literal

from cdtool.frozen import frozen
from cdtool.short_repr import short_repr

Severity = Literal["note", "warning", "loss"]

_SEVERITIES: tuple[Severity, ...] = ("loss", "warning", "note")
_WORD = re.compile(r"(?<!^)(?=[A-Z])")


@frozen
class Fact(ABC):
    """One kind of fact: a frozen dataclass whose fields are the numbers and names in its sentence.

    `subject_field` and `variant_field` name the fields that are its `subject` and `variant`.
    """

    subject_field: ClassVar[str] = ""
    variant_field: ClassVar[str] = ""

    @property
    def kind(self) -> str:
        """The name of the kind in results and JSON: that of its class, `repeated_stamps` of `RepeatedStamps`."""
        return _WORD.sub("_", type(self).__name__).lower()

    @property
    def variant(self) -> str:
        """What tells facts of one kind apart that are not to be merged; empty for most kinds."""
        return str(getattr(self, self.variant_field)) if self.variant_field else ""

    @property
    def subject(self) -> str:
        """What the fact is about where that is not a channel: a column that is left out, a part of a log."""
        return str(getattr(self, self.subject_field)) if self.subject_field else ""

    @abstractmethod
    def sentence(self) -> str:
        """Return the fact in words, without the channel and the file that it is about."""


@frozen
class TemplateFact(Fact):
    """A fact whose sentence is `words`, with its fields in the places of their names in braces."""

    @property
    @abstractmethod
    def words(self) -> str:
        """The sentence as a template: `the values reach {largest:.3g}`."""

    def sentence(self) -> str:
        """Return the sentence with its numbers."""
        return self.words.format(**vars(self))


@frozen
class Remark(Fact):
    """A sentence without numbers, for plug-ins that need no kind of their own.

    >>> str(Finding(Remark("the recorder lost its clock"), "torque"))
    'torque: the recorder lost its clock'
    """

    text: str

    variant_field = "text"

    def sentence(self) -> str:
        """Return the text."""
        return self.text


@frozen
class Finding:
    """A fact about a file or a channel.

    Parameters
    ----------
    fact
        What holds, with its numbers.
    channel
        The channel, column or topic that it is about; empty for the whole file.
    severity
        "note", "warning", or "loss": data that the file held, or should hold, could not be read.
    file
        The name of the part that it is about, where a log has several.
    """

    fact: Fact
    channel: str = ""
    severity: Severity = "warning"
    file: str = ""

    __repr__ = short_repr

    def __post_init__(self) -> None:
        """Raise TypeError for anything but a fact, where a plug-in makes it and not where it is shown."""
        if not isinstance(self.fact, Fact):
            raise TypeError(f"a Finding needs a Fact, not {type(self.fact).__name__}: write Finding(Remark('...'))")

    @property
    def kind(self) -> str:
        """The kind of the fact."""
        return self.fact.kind

    @property
    def message(self) -> str:
        """The sentence, with the part of the log before it."""
        return f"{self.file}: {self.fact.sentence()}" if self.file else self.fact.sentence()

    def __str__(self) -> str:
        return f"{self.channel}: {self.message}" if self.channel else self.message

    def to_dict(self) -> dict[str, Any]:
        """As JSON values: the sentence, the channel, the severity, and the kind with its numbers."""
        return {
            "message": self.message,
            "channel": self.channel,
            "severity": self.severity,
            "file": self.file,
            "kind": self.kind,
            "numbers": asdict(self.fact),
        }


def worst_first(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """Losses, then warnings, then notes, each in the order that they are in."""
    return tuple(sorted(findings, key=lambda item: _SEVERITIES.index(item.severity)))
