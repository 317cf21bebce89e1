"""Check that the time stamps of a topic increase.

Messages are sorted by their time stamps; without this check, sorting would hide a clock that restarted.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cdtool.base.findings import Finding

Stamps = npt.NDArray[np.uint64] | npt.NDArray[np.int64]


@dataclass
class _Order:
    """The stamps [ns] of a channel so far; `late` follow a later one, `worst` is the one furthest `back`."""

    lowest: int
    highest: int
    count: int = 0
    late: int = 0
    back: int = 0
    worst: int = 0


class StampOrders:
    """The order of a topic's time stamps, channel by channel: different channels of a topic may be interleaved."""

    def __init__(self, topic: str) -> None:
        self._topic = topic
        self._orders: dict[int, _Order] = {}

    def add(self, channel: int, stamps: Stamps) -> None:
        """Add the time stamps [ns] of a channel's next messages."""
        if not len(stamps):
            return
        order = self._orders.setdefault(channel, _Order(int(stamps[0]), int(stamps[0])))
        before = np.full(1, order.highest, stamps.dtype)
        highest = np.maximum.accumulate(np.concatenate((before, stamps)))
        back = highest[1:].view(np.uint64) - stamps.view(np.uint64)
        worst = int(back.argmax())
        if int(back[worst]) > order.back:
            order.back, order.worst = int(back[worst]), order.count + worst
        order.late += int(np.count_nonzero(back))
        order.count += len(stamps)
        order.lowest, order.highest = min(order.lowest, int(stamps.min())), int(highest[-1])

    def findings(self) -> list[Finding]:
        """Return the findings on channels with late messages, once all messages have been added."""
        findings = []
        for order in self._orders.values():
            if order.late:
                # Recorders with several threads write messages a few periods late; after ten, the clock was reset.
                is_set_back = order.back > 10 * (order.highest - order.lowest) / max(1, order.count - 1)
                fact = {
                    "count": order.late,
                    "messages": order.count,
                    "back": order.back / 1e9,
                    "set_back": is_set_back,
                    "worst": order.worst,
                }
                findings.append(Finding("out_of_order", self._topic, fact, "warning" if is_set_back else "note"))
        return findings
