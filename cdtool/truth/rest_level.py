"""The rest level of a load cell: a running, robust estimate from earlier samples, with its drift.

Conventions: readings are pooled into intervals of 50 ms by their median. The rest level at a time is that of the last
20 intervals without a contact that ended at least 0.3 s earlier: their median, or, if they clearly drift, the
Theil-Sen line (Sen 1968) through them, extended to that time. The gap of 0.3 s prevents a soft contact from being
mistaken as drift of the cell: a rise to the level within about 0.6 s is a contact, a slower rise is drift.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import NamedTuple, TypeVar

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.truth.rest_lines import (
    EXTENDED,
    GAP,
    WINDOW,
    intervals_of,
    line_of_start,
    lines_before,
    medians_of,
    noise_about,
)

_Time = TypeVar("_Time", float, FloatArray)


class RestLine(NamedTuple):
    """Rest level [N] over time: `level` at the time `at` [s], changing by `drift` [N/s].

    `error` [N] is the standard error of the level at `at`, `drift_error` [N/s] that of the slope, which also an
    insignificant drift (then 0) may have.
    """

    level: float
    drift: float
    at: float
    error: float
    drift_error: float

    def value(self, time: _Time) -> _Time:
        """The rest level [N] at a time, or at times (n,) [s]."""
        return self.level + self.drift * (time - self.at)

    def error_at(self, time: float) -> float:
        """Standard error of the level [N] at a time [s]."""
        return float(np.hypot(self.error, self.drift_error * (time - self.at)))


class RunningRest:
    """The rest level (n,) [N] before every sample of a load cell, at times (n,) [s] with readings (n,) [N].

    `noise` [N] is the standard deviation of the readings about it. `exclude` takes the samples of a contact out, so
    that later levels do not rest on them. No reading may be missing, and there is at least one.
    """

    def __init__(self, time: FloatArray, force: FloatArray) -> None:
        self.time, self.force = time, force
        self._first = intervals_of(time)
        self._ends = time[np.append(self._first[1:], len(time)) - 1]
        self._centre = 0.5 * (time[self._first] + self._ends)
        self._median = medians_of(force, self._first)
        self._start = line_of_start(time, force)
        self._rest = np.ones(len(self._first), dtype=bool)
        self._lines, self.levels = np.empty((len(self._first), 5)), np.empty(len(time))
        self._estimate(0, len(self._first), extended=math.inf)

    def _estimate(self, begin: int, stop: int, extended: float = EXTENDED) -> None:
        """Fill the lines of intervals `begin` to `stop` - 1, and the levels of all samples from there on."""
        self._lines[begin:stop] = self._lines_before(self.time[self._first[begin:stop]], GAP, extended)
        since = slice(self._first[begin], len(self.time))
        size = np.diff(self._first[begin:], append=len(self.time))
        level, drift, at, _, _ = np.repeat(self._lines[begin:], size, axis=0).T
        self.levels[since] = level + drift * (self.time[since] - at)

    def _lines_before(self, time: FloatArray, gap: float, extended: float = EXTENDED) -> FloatArray:
        """Return the lines (k, 5) for times (k,) [s]; `extended` [s] after its last interval a line is constant."""
        rest = self._rest
        known = self._ends[rest], self._centre[rest], self._median[rest]
        lines, last = lines_before(*known, self._start, time - gap)
        level, drift, at, error, drift_error = lines.T
        old = time - last > extended
        last = np.where(old, last, at)
        lines[old, 3] = np.hypot(error, drift_error * (last - at))[old]
        lines[old, 0] = (level + drift * (last - at))[old]
        lines[old, 1], lines[old, 2] = 0.0, last[old]
        return lines

    @cached_property
    def noise(self) -> float:
        """Return the standard deviation of the readings about the level [N], before anything was excluded."""
        return noise_about(self.force, self._first, self.levels)

    @property
    def start(self) -> float:
        """Return the rest level when the log begins [N]."""
        return float(self._start[0])

    def line(self, before: float, gap: float = GAP) -> RestLine:
        """The rest level for a time [s], from intervals without a contact that ended `gap` [s] before it."""
        return RestLine(*self._lines_before(np.array([before]), gap)[0].tolist())

    def exclude(self, start: float, end: float, level: float | None = None) -> None:
        """Take the samples from `start` to `end` [s] out of what is at rest, and estimate again from there on.

        `level` [N]: the rest level after them where no interval before them was at rest.
        """
        _ = self.noise  # that about the levels before they change
        first = self._interval_of(min(int(np.searchsorted(self.time, start)), len(self.time) - 1))
        last = self._interval_of(int(np.searchsorted(self.time, end, side="right")) - 1)
        self._rest[first : last + 1] = False
        if level is not None:
            self._start[0] = level
        later = np.flatnonzero(self._rest[last + 1 :]) + last + 1
        until = later[WINDOW] if len(later) > WINDOW else len(self._first) - 1
        begins = self.time[self._first]
        stop = min(int(np.searchsorted(begins, self._ends[until] + GAP, side="right")) + 1, len(begins))
        self._estimate(first, stop)

    def settled(self, begin: int, below: float, within: float) -> tuple[int, float] | None:
        """Where and at which level the cell comes to rest after sample `begin`: sample and level [N].

        For 0.2 s, or to the end of the log, the medians differ by at most `within` [N], and the level is at most
        `below` [N] in magnitude. None where it never does.
        """
        for i in range(self._interval_of(begin) + 1, len(self._median)):
            part = self._median[i : i + 4]
            if np.ptp(part) <= within and abs(np.median(part)) <= below:
                return int(self._first[i]), float(np.median(part))
        return None

    def reaches(self, first: int, last: int, level: float, lasting_level: float) -> bool:
        """Whether samples `first` to `last` reach `level` on its side of zero, or an interval `lasting_level` [N]."""
        side = float(np.sign(level))
        intervals = self._median[self._interval_of(first) : self._interval_of(last) + 1]
        longest = float(np.max(side * intervals))
        return float(np.max(side * self.force[first : last + 1])) > abs(level) or longest > abs(lasting_level)

    def _interval_of(self, sample: int) -> int:
        """Return the interval that a sample belongs to."""
        return int(np.searchsorted(self._first, sample, side="right")) - 1


def rest_before(time: FloatArray, force: FloatArray, onset: float) -> float:
    """The rest level [N] of a load cell just before `onset` [s]; its readings (n,) [N] hold no missing ones."""
    return RunningRest(time, force).line(onset).value(onset)
