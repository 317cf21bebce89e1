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

from cdtool.evaluation.truth.rest_level_kernels import (
    EXTENDED,
    GAP,
    INTERVAL,
    SCRATCH,
    WINDOW,
    estimate,
    estimate_again,
    fit_before,
    noise_about,
)
from cdtool.recording import FloatArray

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
        most = min(len(time), math.floor((time[-1] - time[0]) / INTERVAL) + 1)
        first, self._lines = np.empty(most, dtype=np.intp), np.empty((most, 5))
        ends, centre, median = np.empty((3, most))
        self._start, self.levels = np.empty(5), np.empty(len(time))
        count = estimate(time, force, first, ends, centre, median, self._start, self._lines, self.levels)
        self._first, self._ends, self._centre, self._median = (
            first[:count],
            ends[:count],
            centre[:count],
            median[:count],
        )
        self._rest = np.ones(count, dtype=bool)

    @cached_property
    def noise(self) -> float:
        """Return the standard deviation of the readings about the level [N], before anything was excluded."""
        return float(noise_about(self.force, self._first, self.levels))

    @property
    def start(self) -> float:
        """Return the rest level when the log begins [N]."""
        return float(self._start[0])

    def line(self, before: float, gap: float = GAP) -> RestLine:
        """The rest level for a time [s], from intervals without a contact that ended `gap` [s] before it."""
        found, scratch = np.empty(5), np.empty(SCRATCH)
        intervals = self._ends, self._centre, self._median, self._rest
        last = fit_before(*intervals, self._start, before - gap, scratch, found)
        line = RestLine(*found.tolist())
        if before - last <= EXTENDED:
            return line
        return RestLine(line.value(last), 0.0, last, line.error_at(last), line.drift_error)

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
        intervals = self._first, self._ends, self._centre, self._median, self._rest
        estimate_again(self.time, *intervals, self._start, first, stop, self._lines, self.levels)

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

    def reaches(self, first: int, last: int, level: float, lasting: float) -> bool:
        """Whether samples `first` to `last` reach a level [N] on its side of zero, or for an interval `lasting` [N]."""
        side = float(np.sign(level))
        intervals = self._median[self._interval_of(first) : self._interval_of(last) + 1]
        longest = float(np.max(side * intervals))
        return float(np.max(side * self.force[first : last + 1])) > abs(level) or longest > abs(lasting)

    def _interval_of(self, sample: int) -> int:
        """Return the interval that a sample belongs to."""
        return int(np.searchsorted(self._first, sample, side="right")) - 1


def rest_before(time: FloatArray, force: FloatArray, onset: float) -> float:
    """The rest level [N] of a load cell just before `onset` [s]; its readings (n,) [N] hold no missing ones."""
    return RunningRest(time, force).line(onset).value(onset)
