"""Detect messages that are missing from the log by jumps of their sequence numbers.

A writer numbers its messages 1, 2, 3 ..., or leaves all sequence numbers 0 (MCAP specification, Message). Most writers
count each channel separately, some count all channels together.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from cdtool.base.findings import Finding
from cdtool.formats.messages.batch import Batch, Stream

Numbers = npt.NDArray[np.uint32]
Times = npt.NDArray[np.uint64]

# Numbers are a count if at least this share of the steps is 1, and at most this share is backward. A log from which
# messages were removed regularly has other steps.
_ONES, _BACK = 0.5, 0.01


class SequenceJumps:
    """The sequence numbers of a log's messages, added piece by piece in the file's order."""

    def __init__(self) -> None:
        self._counts: dict[int, _SequenceCount] = {}
        self._all = _SequenceCount("")
        self._shared = True  # until a piece shows that the channels are not counted together

    def add(self, piece: Sequence[tuple[Stream, Batch, bool]], origin: int) -> None:
        """Add the messages of a piece; times in findings are relative to `origin` [ns]."""
        numbers, stamps = [], []
        for channel, batch, _ in piece:
            sequence = batch.sequence
            if sequence.any():
                count = self._counts.setdefault(channel.id, _SequenceCount(channel.topic))
                count.add(sequence, batch.log_time, origin)
                numbers.append(sequence)
                stamps.append(batch.log_time)
        if not numbers or not self._shared:
            return
        together = np.concatenate(numbers)
        order = np.argsort(together, kind="stable")
        together = together[order]
        # In a common count no number is repeated, and none is in a later piece.
        self._shared = bool(np.all(together[1:] != together[:-1])) and self._all.is_continued_by(together)
        self._all.add(together, np.concatenate(stamps)[order], origin)

    def findings(self) -> list[Finding]:
        """Return warnings on missing messages, after the last piece; empty if the numbers are not a count."""
        counts = [self._all] if self._shared and len(self._counts) > 1 else list(self._counts.values())
        return [finding for count in counts for finding in count.findings()]


class _SequenceCount:
    """The steps of a count; `_jump_time` [s] is the time of the message before its first jump."""

    def __init__(self, topic: str) -> None:
        self._topic = topic
        self._last: Numbers = np.empty(0, np.uint32)
        self._last_time: Times = np.empty(0, np.uint64)
        self._jump_time: float | None = None
        self._steps = self._ones = self._back = self._jumps = self._missing = 0

    def is_continued_by(self, numbers: Numbers) -> bool:
        """Return whether the numbers of the next piece can continue this count: they are not far behind it."""
        return not len(self._last) or int(numbers[0]) + len(numbers) // 2 > int(self._last[0])

    def add(self, numbers: Numbers, stamps: Times, origin: int) -> None:
        known, times = np.concatenate((self._last, numbers)), np.concatenate((self._last_time, stamps))
        steps = np.diff(known).view(np.int32)  # modulo 2^32, where the count overflows
        jumps = np.flatnonzero(steps > 1)
        self._steps += len(steps)
        self._ones += int(np.count_nonzero(steps == 1))
        self._back += int(np.count_nonzero(steps < 1))
        self._jumps += len(jumps)
        self._missing += int(np.sum(steps[jumps].astype(np.int64) - 1))
        if len(jumps) and self._jump_time is None:
            self._jump_time = (int(times[jumps[0]]) - origin) / 1e9
        self._last, self._last_time = known[-1:].copy(), times[-1:].copy()

    def findings(self) -> list[Finding]:
        is_count = self._ones >= _ONES * self._steps and self._back <= _BACK * self._steps
        fact = {
            "jumps": self._jumps,
            "missing": self._missing,
            "after": self._jump_time,
            "of_topic": bool(self._topic),
        }
        return [Finding("missing_messages", self._topic, fact)] if self._jumps and is_count else []
