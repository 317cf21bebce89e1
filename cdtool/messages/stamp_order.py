"""Check that the time stamps of a topic increase.

Messages are sorted by their time stamps; without this check, sorting would hide a clock that restarted.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from cdtool.findings import Finding

Stamps = npt.NDArray[np.uint64] | npt.NDArray[np.int64]

# Recorders with several threads write messages a few periods late; a larger step back means that the clock was reset.
_PERIODS = 10


class StampOrders:
    """The order of a topic's time stamps, channel by channel: different channels of a topic may be interleaved."""

    def __init__(self, topic: str) -> None:
        self._topic = topic
        self._orders: dict[int, StampOrder] = {}

    def add(self, channel: int, stamps: Stamps, ascending: bool = False) -> None:
        """Add the time stamps [ns] of a channel's next messages; `ascending`: they are known to be in order."""
        self._orders.setdefault(channel, StampOrder()).add(stamps, ascending)

    def findings(self) -> list[Finding]:
        """Return the findings on the order, once all messages have been added."""
        return [finding for order in self._orders.values() for finding in order.findings(self._topic)]


class StampOrder:
    """The order of one channel's time stamps [ns], added in the order of the file."""

    def __init__(self) -> None:
        self._count = 0
        self._late = 0  # messages that follow one with a later time stamp
        self._largest_step_back = 0  # [ns]
        self._latest_message = 0  # number of the message with the largest step back
        self._lowest: int | None = None
        self._highest = 0

    def add(self, stamps: Stamps, ascending: bool = False) -> None:
        """Add the time stamps of the next messages; `ascending`: they are known to be in order."""
        if not len(stamps):
            return
        if self._lowest is None:
            self._lowest = self._highest = int(stamps[0])
        ascending = ascending or not bool(np.any(stamps[1:] < stamps[:-1]))
        if int(stamps[0]) < self._highest or not ascending:
            self._count_late(stamps)
        self._count += len(stamps)
        self._lowest = min(self._lowest, int(stamps[0] if ascending else stamps.min()))
        self._highest = max(self._highest, int(stamps[-1] if ascending else stamps.max()))

    def _count_late(self, stamps: Stamps) -> None:
        highest = np.maximum.accumulate(np.maximum(stamps, np.array(self._highest).astype(stamps.dtype)))
        is_late = stamps < highest
        step_back = (highest[is_late].view(np.uint64) - stamps[is_late].view(np.uint64)).astype(np.uint64)
        self._late += len(step_back)
        if len(step_back) and int(step_back.max()) > self._largest_step_back:
            self._largest_step_back = int(step_back.max())
            self._latest_message = self._count + int(np.flatnonzero(is_late)[np.argmax(step_back)])

    def findings(self, topic: str) -> list[Finding]:
        """Return the finding on the order, if messages are late, once all have been added."""
        if not self._late or self._lowest is None:
            return []
        period = (self._highest - self._lowest) / max(1, self._count - 1)
        is_set_back = self._largest_step_back > _PERIODS * period
        step_back = self._largest_step_back / 1e9
        fact = {
            "count": self._late,
            "messages": self._count,
            "back": step_back,
            "set_back": is_set_back,
            "worst": self._latest_message,
        }
        return [Finding("out_of_order", topic, fact, "warning" if is_set_back else "note")]
