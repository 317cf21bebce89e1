"""What of a file could not be read: where, why, how many bytes, chunks, messages and seconds."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

from cdtool.formats.mcap.container.chunks import ChunkHeader
from cdtool.formats.mcap.container.summary import Summary
from cdtool.plain_text import counted
from cdtool.recording import Finding

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

    def described(self, origin: int) -> str:
        """What is lost, in words; times in seconds after `origin` [ns]."""
        what = "a chunk of " if self.chunks else ""
        parts = [f"{what}{self.size} bytes lost"]
        if self.messages is not None:
            parts.append(f"{self.messages} messages")
        if self.time is not None:
            start, end = ((stamp - origin) / 1e9 for stamp in self.time)
            parts.append(f"{end - start:.3f} s from {start:.3f} s on")
        return ", ".join(parts)


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
            known = sum(loss.messages or 0 for loss in rest)
            text = f"damaged at {counted(len(rest), 'more place')}: {counted(sum(loss.size for loss in rest), 'byte')}"
            chunks = counted(sum(loss.chunks for loss in rest), "chunk")
            text += f" and {chunks} lost, {counted(known, 'message')} named by indexes"
            found.append(Finding(text, severity="loss"))
            if last is not None:
                found.append(self._finding(last, True, count, origin))
        for reason, lost in self.messages.items():
            found.append(Finding(f"{reason}: {counted(lost, 'message')} lost", severity="loss"))
        return found + self._refused()

    def _refused(self) -> list[Finding]:
        """The way out for an honest log: images of a dark camera shrink as no messages of joints and sensors do."""
        count = sum(loss.refused for loss in self.places)
        if not count:
            return []
        what = counted(count, "chunk", "are")
        text = f"{what} not damaged but refused: they would grow as only a bomb or images of nothing do"
        way = "If the log is yours, `mcap decompress LOG -o PLAIN` (mcap.dev) makes one that is read whole"
        return [Finding(f"{text}. {way}")]

    def _finding(self, loss: Loss, final: bool, count: int, origin: int) -> Finding:
        where = f"damaged at byte {loss.at} ({' '.join(loss.reason.split())[:200]})"
        if final:
            behind = f"; {loss.described(origin)}" if loss.size else ""
            return Finding(
                f"{where}: only what lies before it was read ({counted(count, 'message')}){behind}", severity="loss"
            )
        return Finding(f"{where}: {loss.described(origin)}", severity="loss")
