"""What of a file could not be read: where, why, how many bytes, chunks, messages and seconds."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

from cdtool.findings import Finding
from cdtool.findings.containers import ChunksRefused, DamagedAt, LostBytes, MessagesLost, MoreDamage
from cdtool.formats.mcap.container.chunks import ChunkHeader
from cdtool.formats.mcap.container.summary import Summary

_LISTED = 10


@dataclass
class Loss:
    """A place of the file that is lost: `size` bytes from byte `at`.

    `messages`: how many of them its indexes name (None: nothing tells). `time`: their log times' span [ns]. `refused`:
    it may be whole, but would grow as only a bomb does.
    """

    at: int
    size: int
    reason: str
    chunks: int = 0
    messages: int | None = None
    time: tuple[int, int] | None = None
    refused: bool = False

    @classmethod
    def of_chunk(cls, header: ChunkHeader, summary: Summary, reason: str, refused: bool = False) -> Loss:
        """A whole chunk. Its header may be what is damaged: the summary's figures count where its CRC fits."""
        known = summary.chunks.get(header.at) if summary.verified else None
        told = known or header
        span = (told.message_start_time, told.message_end_time)
        usable = known is not None or span[0] <= span[1] < 1 << 63
        return cls(header.at, header.length, reason, 1, None, span if usable else None, refused)

    def since(self, origin: int) -> LostBytes:
        """What is lost, with times in seconds after `origin` [ns]."""
        time = None if self.time is None else ((self.time[0] - origin) / 1e9, (self.time[1] - origin) / 1e9)
        return LostBytes(self.size, bool(self.chunks), self.messages, time)


@dataclass
class Losses:
    """All that was lost of a file; `stopped` where nothing behind the last place could be read."""

    places: list[Loss] = field(default_factory=list)
    messages: Counter[str] = field(default_factory=Counter)
    stopped: bool = False

    def __bool__(self) -> bool:
        return bool(self.places or self.messages)

    def add(self, loss: Loss) -> Loss:
        """Take a place that is lost."""
        self.places.append(loss)
        return loss

    def findings(self, count: int, origin: int) -> list[Finding]:
        """One finding a place (the first ones, then how many more), one a reason for single messages."""
        last = self.places[-1] if self.stopped and self.places else None
        found = [self._finding(loss, loss is last, count, origin) for loss in self.places[:_LISTED]]
        rest = self.places[_LISTED:]
        if rest:
            more = MoreDamage(
                len(rest),
                sum(loss.size for loss in rest),
                sum(loss.chunks for loss in rest),
                sum(loss.messages or 0 for loss in rest),
            )
            found.append(Finding(more, severity="loss"))
            if last is not None:
                found.append(self._finding(last, True, count, origin))
        for reason, lost in self.messages.items():
            found.append(Finding(MessagesLost(reason, lost), severity="loss"))
        return found + self._refused()

    def _refused(self) -> list[Finding]:
        """The way out for an honest log: images of a dark camera shrink as no messages of joints and sensors do."""
        count = sum(loss.refused for loss in self.places)
        return [Finding(ChunksRefused(count))] if count else []

    def _finding(self, loss: Loss, final: bool, count: int, origin: int) -> Finding:
        reason = " ".join(loss.reason.split())[:200]
        return Finding(DamagedAt(loss.at, reason, loss.since(origin), count if final else None), severity="loss")
