"""Stamps far off those around them: a clock that leaps ahead for some rows and returns costs these rows, no others.

Which they are is decided by what comes before and by the next 100 rows at most, never by the rest of a log.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from cdtool.recording import BoolArray, FloatArray

# A leap ahead spans at most so many rows; at the edges of a log, where one side is unknown, so many.
WILD_ROWS, EDGE_ROWS = 50, 3
# A step of 3 years [s] at an edge of a log is no pause: the stamps beyond it are of another clock.
EPOCH = 1e8
# A leap is longer than this many usual steps; these are looked for among so many rows before it.
_LEAP, _STEPS_BEFORE = 2.5, 9
# So many stamps in order show where a log that begins with wild ones really begins; shorter logs show nothing.
_IN_ORDER, _SHORTEST = 3, 8
_AHEAD, _BEHIND = 2 * WILD_ROWS, 4 * WILD_ROWS


class WildStamps:
    """Marks the wild stamps of a clock that comes piece by piece; those of a row are known 100 rows later.

    Wild are up to 50 rows between a stamp g and the next one n >= g that they all lie above, by more than 2.5 usual
    steps, where at least as many rows follow below them: then fewer rows are lost than by taking n to run backward.
    Wild are up to 3 rows at the start of a log that lie above the next ones, and at either edge those that lie 3 years
    off.
    """

    def __init__(self) -> None:
        self._stamps, self._wild = np.empty(0), np.empty(0, dtype=bool)
        self._next = 1  # the first row whose step has not been looked at
        self._given = self._total = 0  # rows held that are decided, rows so far

    def add(self, stamps: FloatArray, final: bool = False) -> BoolArray:
        """The next finite stamps [s]; returns which are wild of the rows that are decided now, in their order."""
        starts = self._total < _SHORTEST
        self._stamps = np.concatenate((self._stamps, stamps))
        self._wild = np.concatenate((self._wild, np.zeros(len(stamps), dtype=bool)))
        self._total += len(stamps)
        count = len(self._stamps)
        if starts and (final or self._total >= _SHORTEST):
            leading = leading_wild(self._stamps, EPOCH)
            self._wild[:leading] = True
            self._next = max(self._next, leading + 1)
        until = count if final else max(count - WILD_ROWS, self._next)
        if starts and self._total < _SHORTEST and not final:
            until = self._next
        for fall in (np.flatnonzero(np.diff(self._stamps[self._next - 1 : until]) < 0.0) + self._next).tolist():
            self._mark(fall)
        self._next = max(self._next, until)
        if final and self._total >= _SHORTEST:
            rows = np.flatnonzero(~self._wild)[-EDGE_ROWS - 1 :]
            self._wild[rows[len(rows) - _trailing_wild(self._stamps[rows]) :]] = True
        return self._decided(count if final else max(count - _AHEAD, self._given))

    def _decided(self, until: int) -> BoolArray:
        decided = self._wild[self._given : until].copy()
        forget = max(0, until - _BEHIND)
        self._stamps, self._wild = self._stamps[forget:], self._wild[forget:]
        self._next, self._given = max(self._next - forget, 1), until - forget
        return decided

    def _mark(self, fall: int) -> None:
        """Mark the rows before a step back that the clock had leapt ahead in."""
        first = max(0, fall - 2 * WILD_ROWS)
        before = self._stamps[first:fall].tolist()
        wild = self._wild[first:fall].tolist()
        back = float(self._stamps[fall])
        lowest, rows, i = np.inf, 0, len(before) - 1
        while i >= 0 and (wild[i] or before[i] > back):
            if not wild[i]:
                lowest, rows = min(lowest, before[i]), rows + 1
            i -= 1
        if i < 0 or not 0 < rows <= WILD_ROWS or first + i < 0:
            return
        usual = _usual_step([x for x, off in zip(before[: i + 1], wild[: i + 1], strict=True) if not off])
        if lowest - before[i] <= _LEAP * max(back - before[i], usual):
            return
        after = self._stamps[fall : fall + rows]
        if len(after) == rows and bool(np.all(after < lowest)):
            self._wild[first + i + 1 : fall] = True


def leading_wild(stamps: FloatArray, years: float) -> int:
    """How many finite stamps at the start of a log, up to 3, are wild; `years`: a step that is no pause."""
    begin = stamps[: 2 * EDGE_ROWS + _IN_ORDER]
    for rows in range(1, EDGE_ROWS + 1):
        then = begin[rows : rows + _IN_ORDER]
        if len(then) < _IN_ORDER or np.any(np.diff(then) < 0.0):
            continue
        if then[-1] < begin[:rows].min():
            return rows
        if len(stamps) >= _SHORTEST and then[0] - begin[:rows].max() > years and then[-1] - then[0] < years:
            return rows
    return 0


def _trailing_wild(stamps: FloatArray) -> int:
    """How many of the last stamps lie 3 years ahead of the one before them."""
    leaps = np.flatnonzero(np.diff(stamps) > EPOCH)
    return len(stamps) - 1 - int(leaps[0]) if len(leaps) else 0


def _usual_step(stamps: list[float]) -> float:
    """The shortest step ahead among the last stamps, 0 where there is none."""
    last = stamps[-_STEPS_BEFORE - 1 :]
    return min((b - a for a, b in pairwise(last) if b > a), default=0.0)
