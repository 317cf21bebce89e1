"""Which operations' traces are kept: all missed and all false alarms, the slowest, a sample, and one per group."""

from __future__ import annotations

import heapq
from copy import copy
from dataclasses import dataclass, field, replace

# Operations with a miss or a false alarm, the slowest ones, and those taken evenly from all.
MOST_STRIKING, MOST_SLOW, MOST_SAMPLED = 70, 20, 20
MOST_KEPT = MOST_STRIKING + MOST_SLOW + MOST_SAMPLED


@dataclass
class TraceChoice:
    """Selection of at most `MOST_KEPT` operations, and one of each group, from operations in order.

    `work` is the number of logs, without those of `examples`: groups of which only one operation each is kept. The
    choice becomes stricter with each operation: one that is not kept when it is offered is not kept later, and one that
    a choice after only some of these operations does not keep is not kept either. `left_out`: striking ones too many.
    """

    work: int
    examples: frozenset[str] = frozenset()
    left_out: int = 0
    offered: int = 0
    _striking: dict[int, str] = field(default_factory=dict)
    _sampled: set[int] = field(default_factory=set)
    _slow: list[tuple[float, int]] = field(default_factory=list)
    _first: dict[str, tuple[int, int]] = field(default_factory=dict)

    def offer(self, log: int, group: str, panels: int, striking: str, slowest: float) -> int | None:
        """Return the operation's number if it is kept at this moment, otherwise None.

        `log` is the number of its log, `panels` that of the detectors that judged it, `striking` states what is
        striking in it, `slowest` is its longest latency [s].
        """
        number = self.offered
        self.offered += 1
        is_first = group not in self._first or panels > self._first[group][0]
        if is_first:
            self._first[group] = panels, number
        if group in self.examples:
            return number if is_first else None
        return number if self._taken_up(number, log, striking, slowest) or is_first else None

    def _taken_up(self, number: int, log: int, striking: str, slowest: float) -> bool:
        if striking:
            if len(self._striking) == MOST_STRIKING:
                self.left_out += 1
                return False
            self._striking[number] = striking
            return True
        if log % max(1, -(-self.work // MOST_SAMPLED)) == 0 and len(self._sampled) < MOST_SAMPLED:
            self._sampled.add(number)
            return True
        if slowest > 0.0 and len(self._slow) < MOST_SLOW:
            heapq.heappush(self._slow, (slowest, -number))
            return True
        if slowest > 0.0 and slowest > self._slow[0][0]:
            heapq.heapreplace(self._slow, (slowest, -number))
            return True
        return False

    def kept(self) -> dict[int, str]:
        """Return the numbers of the operations that are kept, in order, and why."""
        why = {number: "example of its group" for _, number in self._first.values()}
        why |= {-number: "among the slowest" for _, number in self._slow}
        why |= dict.fromkeys(self._sampled, "evenly sampled from all") | self._striking
        return dict(sorted(why.items()))

    def copy(self) -> TraceChoice:
        """Return a choice that continues alone."""
        return replace(self, **{name: copy(value) for name, value in vars(self).items()})
