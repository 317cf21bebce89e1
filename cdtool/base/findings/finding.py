"""A finding: of which kind, about which channel and file, with which numbers, how severe."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from cdtool.base.findings.kinds import Severity, kind_of
from cdtool.base.findings.words import FindingWords
from cdtool.base.plain_text import NAMED

_SEVERITIES: tuple[Severity, ...] = ("loss", "warning", "note")


@dataclass(frozen=True)
class Finding:
    """What holds of a file or a channel.

    Parameters
    ----------
    kind
        A kind of `kinds.toml`, which has its sentence.
    channel
        The channel, column or topic that it is about; empty for the whole file.
    numbers
        The numbers and names of its kind: exactly those that `kinds.toml` lists, as JSON values and tuples.
    severity
        "note", "warning", or "loss": data that the file held, or should hold, could not be read. That of its kind,
        where none is given.
    file
        The name of the part that it is about, where a log has several.
    """

    kind: str
    channel: str = ""
    numbers: Mapping[str, Any] = field(default_factory=dict)
    severity: Severity = ""  # type: ignore[assignment]  # completed below
    file: str = ""

    def __post_init__(self) -> None:
        """Raise ValueError for an unknown kind or other numbers than its own, where it is made."""
        kind = kind_of(self.kind)
        if self.numbers.keys() != set(kind.numbers):
            raise ValueError(f"a finding '{self.kind}' has the numbers {kind.numbers}, not {tuple(self.numbers)}")
        object.__setattr__(self, "severity", self.severity or kind.severity)
        object.__setattr__(self, "numbers", {name: _with_tuples(value) for name, value in self.numbers.items()})

    def __hash__(self) -> int:
        return hash((self.kind, self.channel, self.severity, self.file))  # its numbers may be nested

    @property
    def sentence(self) -> str:
        """What holds in words, without the channel and the file."""
        return FindingWords(kind_of(self.kind), self.numbers).sentence()

    def words_for(self, name: str) -> str:
        """Return the words that its kind has for the value of a number."""
        return FindingWords(kind_of(self.kind), self.numbers).words_for(name)

    @property
    def subject(self) -> str:
        """What it is about where that is not a channel: a column that is left out, a part of a log."""
        return str(self.numbers.get(kind_of(self.kind).subject, ""))

    @property
    def variant(self) -> str:
        """What tells findings of one kind apart that are not to be merged; empty for most kinds."""
        return str(self.numbers.get(kind_of(self.kind).variant, ""))

    @property
    def message(self) -> str:
        """The sentence, with the part of the log before it."""
        return f"{self.file}: {self.sentence}" if self.file else self.sentence

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
            "numbers": dict(self.numbers),
        }


def _with_tuples(value: Any) -> Any:
    """Return a value whose lists are tuples: a finding that was read from JSON equals the one that was written."""
    return tuple(map(_with_tuples, value)) if isinstance(value, list | tuple) else value


def remark(text: str, channel: str = "", severity: Severity = "warning") -> Finding:
    """Return a finding in words, for plug-ins and what has no numbers.

    >>> str(remark("the recorder lost its clock", "torque"))
    'torque: the recorder lost its clock'
    """
    return Finding("remark", channel, {"text": text}, severity)


def lines_of(lines: Sequence[int]) -> dict[str, Any]:
    """Return the numbers of a finding about lines: how many, the first three and the last; a log may have millions."""
    return {"count": len(lines), "first": tuple(lines[:NAMED]), "last": lines[-1]}


def worst_first(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """Losses, then warnings, then notes, each in the order that they are in."""
    return tuple(sorted(findings, key=lambda item: _SEVERITIES.index(item.severity)))
