"""The losses of a file: position, reason, and numbers of bytes, chunks, messages and seconds."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import Any

from cdtool.base.findings import Finding
from cdtool.base.plain_text import LISTED
from cdtool.formats.mcap.chunks import ChunkHeader
from cdtool.formats.mcap.summary import McapSummary


@dataclass
class Loss:
    """A part of the file that is lost: `size` bytes from byte `at`.

    `messages` is their number in the message indexes (None: unknown), `time` the span of their log times [ns].
    `refused`: the chunk was not decompressed because it may be a decompression bomb.
    """

    at: int
    size: int
    reason: str
    chunks: int = 0
    messages: int | None = None
    time: tuple[int, int] | None = None
    refused: bool = False

    @classmethod
    def of_chunk(cls, header: ChunkHeader, summary: McapSummary, reason: str, refused: bool = False) -> Loss:
        """Return the loss of a whole chunk. Its header may be damaged: a verified summary takes precedence."""
        known = summary.chunks.get(header.at) if summary.verified else None
        times = known or header
        span = (times.message_start_time, times.message_end_time)
        usable = known is not None or span[0] <= span[1] < 1 << 63
        return cls(header.at, header.length, reason, 1, None, span if usable else None, refused)

    def since(self, origin: int) -> dict[str, Any]:
        """Return the lost bytes, with times in seconds after `origin` [ns]."""
        time = None if self.time is None else ((self.time[0] - origin) / 1e9, (self.time[1] - origin) / 1e9)
        return {"size": self.size, "is_chunk": bool(self.chunks), "messages": self.messages, "time": time}


@dataclass
class Losses:
    """All losses of a file; `stopped`: nothing after the last one could be read."""

    entries: list[Loss] = field(default_factory=list)
    messages: Counter[str] = field(default_factory=Counter)
    stopped: bool = False

    def __bool__(self) -> bool:
        return bool(self.entries or self.messages)

    def add(self, loss: Loss) -> Loss:
        """Add a loss and return it."""
        self.entries.append(loss)
        return loss

    def findings(self, count: int, origin: int) -> list[Finding]:
        """Return one finding per loss (the first ones, then the number of others), and one per reason for messages."""
        last = self.entries[-1] if self.stopped and self.entries else None
        findings = [self._finding(loss, loss is last, count, origin) for loss in self.entries[:LISTED]]
        rest = self.entries[LISTED:]
        if rest:
            more = {
                "places": len(rest),
                "size": sum(loss.size for loss in rest),
                "chunks": sum(loss.chunks for loss in rest),
                "messages": sum(loss.messages or 0 for loss in rest),
            }
            findings.append(Finding("more_damage", "", more))
            if last is not None:
                findings.append(self._finding(last, True, count, origin))
        for reason, lost in self.messages.items():
            findings.append(Finding("messages_lost", "", {"reason": reason, "count": lost}))
        return findings + self._refused()

    def _refused(self) -> list[Finding]:
        """Return the advice on refused chunks: images of a dark camera have higher ratios than any sensor data."""
        count = sum(loss.refused for loss in self.entries)
        return [Finding("chunks_refused", "", {"count": count})] if count else []

    def _finding(self, loss: Loss, final: bool, count: int, origin: int) -> Finding:
        reason = " ".join(loss.reason.split())[:200]
        return Finding(
            "damaged_at",
            "",
            {"byte": loss.at, "reason": reason, "lost": loss.since(origin), "read_before": count if final else None},
        )
