"""Facts about topics of messages: what never reached the log, what cannot be decoded, what is left out."""

from __future__ import annotations

from cdtool.findings.finding import Fact
from cdtool.frozen import frozen
from cdtool.plain_text import counted


@frozen
class MissingMessages(Fact):
    """The writer's numbers of a topic's messages, or of all together, jump; the first time behind `after` [s]."""

    jumps: int
    missing: int
    after: float
    of_topic: bool

    def sentence(self) -> str:
        """Return where, and how many messages are missing."""
        places = "one place" if self.jumps == 1 else f"{self.jumps} places"
        return (
            f"the numbers of {'its' if self.of_topic else 'the'} messages jump in {places}, the first after "
            f"{self.after:.3f} s: {self.missing} did not reach the log"
        )


@frozen
class OtherJointsOnly(Fact):
    """Messages that name other joints than the mapped one."""

    count: int

    def sentence(self) -> str:
        """Return how many."""
        return f"{counted(self.count, 'message', 'name')} other joints only: left out"


@frozen
class EmptyArrays(Fact):
    """Messages in which the array is empty."""

    count: int

    def sentence(self) -> str:
        """Return how many."""
        return f"{counted(self.count, 'message', 'hold')} an empty array: NaN"


@frozen
class ArrayLengthsDiffer(Fact):
    """Arrays of one field whose length varies, so that it cannot be a column."""

    lengths: tuple[int, ...]

    def sentence(self) -> str:
        """Return the lengths."""
        return f"arrays of {' and '.join(map(str, self.lengths))} elements: left out"


@frozen
class UndecodableMessages(Fact):
    """Messages that cannot be decoded, with the first reason."""

    count: int
    messages: int
    reason: str

    variant_field = "reason"

    def sentence(self) -> str:
        """Return how many and why."""
        return f"{self.count} of {counted(self.messages, 'message')} cannot be decoded: {self.reason}"
