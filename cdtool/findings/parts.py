"""Facts about a log in several parts."""

from __future__ import annotations

from cdtool.findings.finding import Fact, TemplateFact
from cdtool.frozen import frozen


@frozen
class PartMissing(TemplateFact):
    """A part that the metadata file names is not there."""

    part: str
    metadata: str

    subject_field = "part"
    words = "part {part} of {metadata} is not in the folder"


@frozen
class PartCompressed(TemplateFact):
    """A part is compressed as a whole."""

    part: str
    metadata: str

    subject_field = "part"
    words = "part {part} of {metadata} is compressed as a whole: decompress it, e.g. with zstd -d"


@frozen
class PartOfOtherKind(TemplateFact):
    """A part is of another format than the others."""

    part: str
    metadata: str

    subject_field = "part"
    words = "part {part} of {metadata} is left out: the folder also contains parts of another kind"


@frozen
class PartUnreadable(TemplateFact):
    """A part cannot be read."""

    part: str
    reason: str

    subject_field = "part"
    words = "part {part} is left out, it cannot be read: {reason}"


@frozen
class PartsOverlap(TemplateFact):
    """A part begins before the one before it ends; `column` shows it."""

    part: str
    column: str

    subject_field = "part"
    words = "{part} begins before the part before it ends ({column}): put in the order of the times"


@frozen
class PartGap(Fact):
    """Between a part and the one before it nothing was logged for `gap` [s]; `channels`: only of these."""

    gap: float
    channels: tuple[str, ...] = ()

    def sentence(self) -> str:
        """Return gap and channels."""
        whose = f" ({', '.join(self.channels)})" if self.channels else ""
        return f"begins {self.gap:.3g} s after the part before it ends{whose}: nothing is logged between"
