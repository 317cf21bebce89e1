"""One check of a channel by mechanics, before it becomes a finding."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Literal

from cdtool.base.findings import Finding

Answer = Literal["agrees", "contradicts", "not checked"]


@dataclass(frozen=True)
class ChannelCheck:
    """What a check found; its fields are the numbers of the finding `channel_check`."""

    check: Literal["friction", "inertia", "derivative"]
    answer: Answer
    found: str
    joint: str = ""
    channel: str = ""
    value: float = 0.0
    unit: str = ""
    expected: float = 0.0
    share: float = 0.0
    other: str = ""
    between: str = ""

    def finding(self) -> Finding:
        """Return it as a finding about its channel: a loss if the channel is not what the machine file says."""
        severity: Literal["loss", "note"] = "loss" if self.answer == "contradicts" else "note"
        return Finding("channel_check", self.channel, asdict(self), severity)
