"""Facts about a log in several parts."""

from __future__ import annotations

from dataclasses import dataclass

from cdtool.findings.finding import Fact


@dataclass(frozen=True)
class PartMissing(Fact):
    """A part that the metadata file names is not there."""

    part: str
    metadata: str

    @property
    def subject(self) -> str:
        """What it is about."""
        return self.part

    def sentence(self) -> str:
        """Return the part."""
        return f"part {self.part} of {self.metadata} is not in the folder"


@dataclass(frozen=True)
class PartCompressed(Fact):
    """A part is compressed as a whole."""

    part: str
    metadata: str

    @property
    def subject(self) -> str:
        """What it is about."""
        return self.part

    def sentence(self) -> str:
        """Return the part, and how to decompress it."""
        return f"part {self.part} of {self.metadata} is compressed as a whole: decompress it, e.g. with zstd -d"


@dataclass(frozen=True)
class PartOfOtherKind(Fact):
    """A part is of another format than the others."""

    part: str
    metadata: str

    @property
    def subject(self) -> str:
        """What it is about."""
        return self.part

    def sentence(self) -> str:
        """Return the part."""
        return f"part {self.part} of {self.metadata} is left out: the folder holds parts of another kind too"


@dataclass(frozen=True)
class PartUnreadable(Fact):
    """A part cannot be read."""

    part: str
    reason: str

    @property
    def subject(self) -> str:
        """What it is about."""
        return self.part

    def sentence(self) -> str:
        """Return part and reason."""
        return f"part {self.part} is left out, it cannot be read: {self.reason}"


@dataclass(frozen=True)
class PartsOverlap(Fact):
    """A part begins before the one before it ends; `column` shows it."""

    part: str
    column: str

    @property
    def subject(self) -> str:
        """What it is about."""
        return self.part

    def sentence(self) -> str:
        """Return part and column."""
        return f"{self.part} begins before the part before it ends ({self.column}): put in the order of the times"


@dataclass(frozen=True)
class PartGap(Fact):
    """Between a part and the one before it nothing was logged for `gap` [s]; `channels`: only of these."""

    gap: float
    channels: tuple[str, ...] = ()

    def sentence(self) -> str:
        """Return gap and channels."""
        whose = f" ({', '.join(self.channels)})" if self.channels else ""
        return f"begins {self.gap:.3g} s after the part before it ends{whose}: nothing is logged between"
