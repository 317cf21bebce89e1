"""Do the stamps of a topic run forward? Messages are sorted by them, which must not hide that a clock restarted."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from cdtool.findings import Finding
from cdtool.findings.clocks import OutOfOrder

Stamps = npt.NDArray[np.uint64] | npt.NDArray[np.int64]

# Recorders with several threads write messages a few periods late; further back goes a clock that was set.
_PERIODS = 10


class StampOrders:
    """The stamps of a topic, channel by channel: several channels' messages do not come in the file's order."""

    def __init__(self, topic: str) -> None:
        self._topic = topic
        self._orders: dict[int, StampOrder] = {}

    def add(self, channel: int, stamps: Stamps, ascending: bool = False) -> None:
        """The stamps of a channel's next messages; `ascending`: they are known to be."""
        self._orders.setdefault(channel, StampOrder()).add(stamps, ascending)

    def findings(self) -> list[Finding]:
        """What is odd about their order, once all were seen."""
        return [finding for order in self._orders.values() for finding in order.findings(self._topic)]


class StampOrder:
    """Fed with stamps [ns] in the file's order."""

    def __init__(self) -> None:
        self._count = 0
        self._behind = 0  # messages before which a later one stands
        self._back = 0  # by how much at most [ns]
        self._first = 0  # number of the message that is furthest behind
        self._lowest: int | None = None
        self._highest = 0

    def add(self, stamps: Stamps, ascending: bool = False) -> None:
        """The stamps of the next messages; `ascending`: they are known to be."""
        if not len(stamps):
            return
        if self._lowest is None:
            self._lowest = self._highest = int(stamps[0])
        ascending = ascending or not bool(np.any(stamps[1:] < stamps[:-1]))
        if int(stamps[0]) < self._highest or not ascending:
            self._look(stamps)
        self._count += len(stamps)
        self._lowest = min(self._lowest, int(stamps[0] if ascending else stamps.min()))
        self._highest = max(self._highest, int(stamps[-1] if ascending else stamps.max()))

    def _look(self, stamps: Stamps) -> None:
        highest = np.maximum.accumulate(np.maximum(stamps, np.array(self._highest).astype(stamps.dtype)))
        behind = stamps < highest
        back = (highest[behind].view(np.uint64) - stamps[behind].view(np.uint64)).astype(np.uint64)
        self._behind += len(back)
        if len(back) and int(back.max()) > self._back:
            self._back = int(back.max())
            self._first = self._count + int(np.flatnonzero(behind)[np.argmax(back)])

    def findings(self, topic: str) -> list[Finding]:
        """What is odd about their order, once all were seen."""
        if not self._behind or self._lowest is None:
            return []
        period = (self._highest - self._lowest) / max(1, self._count - 1)
        is_set_back = self._back > _PERIODS * period
        fact = OutOfOrder(self._behind, self._count, self._back / 1e9, is_set_back, self._first)
        return [Finding(fact, topic, "warning" if is_set_back else "note")]
