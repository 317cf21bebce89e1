"""The rest level of a load cell: a running, robust estimate from earlier samples, with its drift.

Conventions: readings are pooled into intervals of 50 ms by their median. The rest level at a time is that of the last
20 intervals without a contact that ended at least 0.3 s earlier: their median, or, if they clearly drift, the
Theil-Sen line (Sen 1968) through them, extended to that time. The gap of 0.3 s prevents a soft contact from being
mistaken as drift of the cell: a rise to the level within about 0.6 s is a contact, a slower rise is drift.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cdtool.recording import BoolArray, FloatArray

INTERVAL = 0.05
_GAP = 0.3
_WINDOW = 20
# A line needs this many intervals and a slope of this many standard errors, more of them with few intervals n:
# 3 (1 + 10 / n). Otherwise the level is constant.
_LINE, _BEYOND_DOUBT, _FEW = 6, 3.0, 10.0
# A line is extended for at most this long [s]; after that its last value is used.
_EXTENDED = 1.0
# Until two intervals are old enough the level is that of the log's first samples [s], at least this many.
_FIRST, _FEWEST = 0.1, 3
# A standard deviation from the median absolute deviation of Gaussian noise; that of a median, in units of a mean's.
_MAD, _OF_MEDIAN = 1.4826, 1.2533
# Intervals deviate by more than so many times what the quietest third does: they say nothing about the noise at rest.
_RESTLESS = 3.0
# Windows fitted at once: bounds memory.
_AT_ONCE = 4096

IntArray = npt.NDArray[np.intp]


@dataclass(frozen=True)
class RestLine:
    """Rest level [N] over time: `level` at the time `at` [s], changing by `drift` [N/s].

    `error` [N] is the standard error of the level at `at`, `drift_error` [N/s] that of the slope, which also an
    insignificant drift (then 0) may have.
    """

    level: float
    drift: float
    at: float
    error: float
    drift_error: float

    def value(self, time: FloatArray) -> FloatArray:
        """The rest level [N] at times (n,) [s]."""
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
        number = np.floor((time - time[0]) / INTERVAL).astype(np.int64)
        self._first = np.flatnonzero(np.concatenate(([True], np.diff(number) > 0)))
        self._last = np.concatenate((self._first[1:], [len(time)])) - 1
        self._own = np.repeat(np.arange(len(self._first)), self._last - self._first + 1)
        self._median = self._by_interval(force)
        self._centre = 0.5 * (time[self._first] + time[self._last])
        self._rest = np.ones(len(self._first), dtype=bool)
        count = max(_FEWEST, int(np.searchsorted(time, time[0] + _FIRST)))
        self.start = float(np.median(force[:count]))
        self._start_error = _OF_MEDIAN * _spread(force[:count]) / np.sqrt(min(count, len(force)))
        self._fits = self._fit_all()
        self.levels = self._evaluated(0, len(self._first))
        deviations = self._by_interval(np.abs(force - self.levels))
        # In a contact the force is no line: intervals far noisier than the quietest third are not at rest.
        quiet = deviations <= _RESTLESS * float(np.quantile(deviations, 1.0 / 3.0))
        self.noise = _MAD * float(np.median(deviations[quiet]))

    def line(self, before: float, gap: float = _GAP) -> RestLine:
        """The rest level for a time [s], from intervals without a contact that ended `gap` [s] before it."""
        rest = np.flatnonzero(self._rest)
        known = rest[: np.searchsorted(self.time[self._last[rest]], before - gap, side="right")][-_WINDOW:]
        if len(known) < 2:
            return RestLine(self.start, 0.0, float(self.time[0]), self._start_error, 0.0)
        fit = _fit(self._centre[np.newaxis, known], self._median[np.newaxis, known])[:, 0]
        line = RestLine(*(float(value) for value in fit))
        last = float(self.time[self._last[known[-1]]])
        if before - last <= _EXTENDED:
            return line
        return RestLine(float(line.value(np.array([last]))[0]), 0.0, last, line.error_at(last), line.drift_error)

    def exclude(self, start: float, end: float, level: float | None = None) -> None:
        """Take the samples from `start` to `end` [s] out of what is at rest, and estimate again from there on.

        `level` [N]: the rest level after them where no interval before them was at rest.
        """
        first = int(self._own[min(int(np.searchsorted(self.time, start)), len(self.time) - 1)])
        last = int(self._own[np.searchsorted(self.time, end, side="right") - 1])
        self._rest[first : last + 1] = False
        if level is not None:
            self.start = level
        later = np.flatnonzero(self._rest[last + 1 :]) + last + 1
        until = later[_WINDOW] if len(later) > _WINDOW else len(self._first) - 1
        stop = int(np.searchsorted(self.time[self._first], self.time[self._last[until]] + _GAP, side="right"))
        for i in range(first, min(stop + 1, len(self._first))):
            line = self.line(float(self.time[self._first[i]]))
            self._fits[:, i] = line.level, line.drift, line.at, line.error, line.drift_error
        self.levels[self._first[first] :] = self._evaluated(first, len(self._first))

    def settled(self, begin: int, below: float, within: float) -> tuple[int, float] | None:
        """Where and at which level the cell comes to rest after sample `begin`: sample and level [N].

        For 0.2 s, or to the end of the log, the medians differ by at most `within` [N], and the level is at most
        `below` [N] in magnitude. None where it never does.
        """
        first = int(self._own[begin]) + 1
        for i in range(first, len(self._median)):
            part = self._median[i : i + 4]
            if np.ptp(part) <= within and abs(np.median(part)) <= below:
                return int(self._first[i]), float(np.median(part))
        return None

    def reaches(self, first: int, last: int, level: float, lasting: float) -> bool:
        """Whether samples `first` to `last` reach a level [N] on its side of zero, or for an interval `lasting` [N]."""
        side = float(np.sign(level))
        intervals = self._median[self._own[first] : self._own[last] + 1]
        longest = float(np.max(side * intervals))
        return float(np.max(side * self.force[first : last + 1])) > abs(level) or longest > abs(lasting)

    def _by_interval(self, values: FloatArray) -> FloatArray:
        """The median of each interval."""
        ordered = values[np.lexsort((values, self._own))]
        low = self._first + (self._last - self._first) // 2
        high = self._first + (self._last - self._first + 1) // 2
        return np.asarray(0.5 * (ordered[low] + ordered[high]))

    def _fit_all(self) -> FloatArray:
        """Level, drift, time, error and error of the drift (5, intervals), nothing being excluded."""
        ready = np.searchsorted(self.time[self._last], self.time[self._first] - _GAP, side="right")
        fits = np.empty((5, len(ready)))
        fits[:] = np.array([[self.start], [0.0], [self.time[0]], [self._start_error], [0.0]])
        for i in np.flatnonzero((ready >= 2) & (ready < _WINDOW)):
            known = slice(0, int(ready[i]))
            fits[:, i] = _fit(self._centre[np.newaxis, known], self._median[np.newaxis, known])[:, 0]
        full = np.flatnonzero(ready >= _WINDOW)
        for part in np.array_split(full, -(-len(full) // _AT_ONCE) or 1):
            columns = ready[part, np.newaxis] - _WINDOW + np.arange(_WINDOW)
            fits[:, part] = _fit(self._centre[columns], self._median[columns])
        return fits

    def _evaluated(self, first: int, last: int) -> FloatArray:
        """The rest level of the samples of some intervals."""
        begin, end = self._first[first], self._last[last - 1] + 1
        own = self._own[begin:end]
        level, drift, at = self._fits[:3]
        return np.asarray(level[own] + drift[own] * (self.time[begin:end] - at[own]))


def rest_before(time: FloatArray, force: FloatArray, onset: float) -> float:
    """The rest level [N] of a load cell just before `onset` [s]; its readings (n,) [N] hold no missing ones."""
    line = RunningRest(time, force).line(onset)
    return float(line.value(np.array([onset]))[0])


def _fit(time: FloatArray, values: FloatArray) -> FloatArray:
    """Robust lines through windows (m, w): level, drift, time, error and error of the drift (5, m)."""
    size = time.shape[1]
    at = time.mean(axis=1)
    constant = np.median(values, axis=1)
    drift = np.zeros(len(time))
    level = constant
    spread = _MAD * np.median(np.abs(values - constant[:, np.newaxis]), axis=1)
    drift_error = np.zeros(len(time))
    if size >= _LINE:
        a, b = np.triu_indices(size, 1)
        slope = np.median((values[:, b] - values[:, a]) / (time[:, b] - time[:, a]), axis=1)
        centred = time - at[:, np.newaxis]
        left = values - slope[:, np.newaxis] * centred
        middle = np.median(left, axis=1)
        about = _MAD * np.median(np.abs(left - middle[:, np.newaxis]), axis=1)
        drift_error = about / np.sqrt(np.sum(centred**2, axis=1))
        sure: BoolArray = np.abs(slope) > _BEYOND_DOUBT * (1.0 + _FEW / size) * drift_error
        drift, level = np.where(sure, slope, 0.0), np.where(sure, middle, constant)
        spread = np.where(sure, about, spread)
    return np.stack((level, drift, at, _OF_MEDIAN * spread / np.sqrt(size), drift_error))


def _spread(values: FloatArray) -> float:
    return _MAD * float(np.median(np.abs(values - np.median(values))))
