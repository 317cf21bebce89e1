"""Messages that never reached the log: where the numbers that their writers gave them jump.

A writer that counts numbers its messages 1, 2, 3 ...; one that does not leaves 0 (MCAP specification, Message). Most
count each channel by itself, some all channels together.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from cdtool.findings import Finding
from cdtool.findings.messages import MissingMessages
from cdtool.formats.mcap.container.log import Messages

Numbers = npt.NDArray[np.uint32]

# Of the steps of a count so many are 1 at least, and no more go back: a log that was thinned out has other ones.
_ONES, _BACK = 0.5, 0.01


class SequenceJumps:
    """The numbers of a log's messages, piece by piece in the file's order."""

    def __init__(self) -> None:
        self._counts: dict[int, _Count] = {}
        self._all = _Count("")
        self._shared = True  # as far as is known, channels are counted together

    def add(self, piece: Sequence[Messages], origin: int) -> None:
        """The messages of a piece, with times from `origin` [ns] on."""
        numbers, stamps = [], []
        for messages in piece:
            channel, batch = messages.stream, messages.batch
            found = batch.sequence
            if found.any():
                self._counts.setdefault(channel.id, _Count(channel.topic)).add(found, batch.log_time, origin)
                numbers.append(found)
                stamps.append(batch.log_time)
        if not numbers or not self._shared:
            return
        together = np.concatenate(numbers)
        order = np.argsort(together, kind="stable")
        together = together[order]
        # Counted together no number is there twice, and none comes a piece later.
        self._shared = bool(np.all(together[1:] != together[:-1])) and self._all.goes_on_with(together)
        self._all.add(together, np.concatenate(stamps)[order], origin)

    def findings(self) -> list[Finding]:
        """How many are missing, once all were seen; nothing where the numbers are no count."""
        counts = [self._all] if self._shared and len(self._counts) > 1 else list(self._counts.values())
        return [found for count in counts for found in count.findings()]


class _Count:
    """The steps of a count; `_where` [s] is the time before its first jump."""

    def __init__(self, topic: str) -> None:
        self._topic = topic
        self._last: Numbers = np.empty(0, np.uint32)
        self._last_time = self._where = 0.0
        self._steps = self._ones = self._back = self._jumps = self._missing = 0

    def goes_on_with(self, numbers: Numbers) -> bool:
        """Not far back, as pieces of one count may lie."""
        return not len(self._last) or int(numbers[0]) + len(numbers) // 2 > int(self._last[0])

    def add(self, numbers: Numbers, stamps: npt.NDArray[np.uint64], origin: int) -> None:
        known = np.concatenate((self._last, numbers))
        steps = np.diff(known).view(np.int32)  # modulo 2^32, where the count restarts
        jumps = np.flatnonzero(steps > 1)
        self._steps += len(steps)
        self._ones += int(np.count_nonzero(steps == 1))
        self._back += int(np.count_nonzero(steps < 1))
        if len(jumps):
            if not self._jumps:
                before = int(jumps[0]) - len(self._last)
                self._where = (int(stamps[before]) - origin) / 1e9 if before >= 0 else self._last_time
            self._jumps += len(jumps)
            self._missing += int(np.sum(steps[jumps].astype(np.int64) - 1))
        self._last, self._last_time = known[-1:].copy(), (int(stamps[-1]) - origin) / 1e9

    def findings(self) -> list[Finding]:
        counts = self._ones >= _ONES * self._steps and self._back <= _BACK * self._steps
        if not self._jumps or not counts:
            return []
        return [Finding(MissingMessages(self._jumps, self._missing, self._where, bool(self._topic)), self._topic)]
