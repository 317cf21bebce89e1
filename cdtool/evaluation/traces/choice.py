"""Which operations' traces are kept: all missed and all false alarms, the slowest, a sample, and one per group."""

from __future__ import annotations

import heapq
from collections.abc import Callable
from dataclasses import dataclass, field

from cdtool.evaluation.traces.trace import Trace

# Operations with a miss or a false alarm, the slowest ones, and those taken evenly from all.
MOST_STRIKING, MOST_SLOW, MOST_SAMPLED = 70, 20, 20
MOST_KEPT = MOST_STRIKING + MOST_SLOW + MOST_SAMPLED


@dataclass
class TraceChoice:
    """Selection of at most `MOST_KEPT` traces from operations in order; `work` is the number of logs.

    A trace is computed only for an operation that is kept at that moment, so that thousands need no memory.
    """

    work: int
    left_out: int = 0
    _striking: dict[int, Trace] = field(default_factory=dict)
    _sampled: dict[int, Trace] = field(default_factory=dict)
    _slow: list[tuple[float, int, Trace]] = field(default_factory=list)
    _first: dict[str, tuple[int, int, Trace]] = field(default_factory=dict)
    _taken: int = 0

    def offer(
        self, log: int, group: str, panels: int, striking: str, slowest: float, make: Callable[[str], Trace]
    ) -> None:
        """One operation of log number `log`: how many detectors judged it, what is striking in it, its slowest latency.

        `make` gives the trace for the reason why it is kept.
        """
        number = self._taken
        self._taken += 1
        if group not in self._first or panels > self._first[group][0]:
            self._first[group] = (panels, number, make("example of its group"))
        if striking:
            if len(self._striking) < MOST_STRIKING:
                self._striking[number] = make(striking)
            else:
                self.left_out += 1
            return
        if log % max(1, -(-self.work // MOST_SAMPLED)) == 0 and len(self._sampled) < MOST_SAMPLED:
            self._sampled[number] = make("evenly sampled from all")
            return
        if slowest > 0.0 and (len(self._slow) < MOST_SLOW or slowest > self._slow[0][0]):
            item = (slowest, -number, make("among the slowest"))
            if len(self._slow) < MOST_SLOW:
                heapq.heappush(self._slow, item)
            else:
                heapq.heapreplace(self._slow, item)

    def kept(self) -> tuple[Trace, ...]:
        """The traces in the order in which they came."""
        chosen = {number: trace for _, number, trace in self._first.values()}
        chosen |= {-number: trace for _, number, trace in self._slow}
        chosen |= self._sampled | self._striking
        return tuple(chosen[number] for number in sorted(chosen))
