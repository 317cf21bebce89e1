"""Missing samples of a load cell: what is a hole in the force, and what only the rhythm of its clock.

Conventions: times in s. A step between two samples is a hole if it is longer than 5 ms and than the clock makes it with
one sample lost: 2.5 periods, or with jitter one period and 1.1 times the step that one in 20 exceeds. 5 ms is the
interval of a force meter of 200 Hz, the slowest that door standards allow (EN 12453:2017, annex C: rise and fall within
5 ms): samples that are closer together hide nothing from it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import RecordingError
from cdtool.recordings.recording import Series

#: The interval of the slowest force meter that door standards allow [s].
CLOSE_ENOUGH = 5e-3
# A step longer than so many periods is no jitter of a regular clock: the force in it is not simply what is beside it.
PERIODS = 1.5


@dataclass(frozen=True)
class CellClock:
    """The times of the samples of a load cell, `time` (n,) [s], and what its steps are like."""

    time: FloatArray

    @property
    def period(self) -> float:
        """Return the median step [s]; 0 below two samples, where the period of a `Series` is NaN."""
        return self._steps[0]

    @cached_property
    def longest_step(self) -> float:
        """Return the longest step between samples that is not a hole [s]."""
        if len(self.time) < 2:
            return CLOSE_ENOUGH
        period, long_step = self._steps
        # With one sample lost; with jitter one period and 1.1 times the step that one in 20 exceeds.
        return max(CLOSE_ENOUGH, 2.5 * period, period + 1.1 * long_step)

    @property
    def batch_length(self) -> float:
        """Return how far a stamp may be behind its sample if samples are stamped in batches [s]; else 0.

        In batches the step that one in 20 exceeds is many times the median one.
        """
        period, long_step = self._steps
        return long_step if long_step > 5.0 * period else 0.0  # many times the median step

    @cached_property
    def _steps(self) -> tuple[float, float]:
        """Return the median step and the one that one in 20 exceeds [s], by one selection; 0 below two samples."""
        if len(self.time) < 2:
            return 0.0, 0.0
        steps = np.diff(self.time)
        last = len(steps) - 1
        place = last * 0.95
        before, middle = int(place), len(steps) // 2
        steps.partition(sorted({middle - 1 + len(steps) % 2, middle, before, min(before + 1, last)}))
        period = 0.5 * float(steps[middle - 1 + len(steps) % 2] + steps[middle])
        low, high = float(steps[before]), float(steps[min(before + 1, last)])
        # As numpy interpolates: from the nearer of the two.
        weight = place - before
        long_step = high - (high - low) * (1.0 - weight) if weight >= 0.5 else low + (high - low) * weight
        return period, long_step


@dataclass(frozen=True)
class CellSamples:
    """The samples of a load cell that are not missing: `force` (n,) [N] at the times of `clock`."""

    clock: CellClock
    force: FloatArray

    @property
    def time(self) -> FloatArray:
        """Return the times (n,) [s]."""
        return self.clock.time


def cell_samples(force: Series) -> CellSamples:
    """Return the samples of a load cell that are not missing, each time the same object.

    Parameters
    ----------
    force : Series
        The load cell [N]; NaN: a missing sample.

    Returns
    -------
    CellSamples
        The samples with their clock.

    Raises
    ------
    RecordingError
        The force is a vector: `with_scalar_force` reduces it.

    Examples
    --------
    >>> samples = cell_samples(Series(np.arange(4) * 1e-3, np.array([0.0, np.nan, 2.0, 3.0]), "N"))
    >>> samples.time.tolist(), samples.force.tolist()
    ([0.0, 0.002, 0.003], [0.0, 2.0, 3.0])
    """
    return force.derived("samples of the load cell", lambda: _existing(force))


def _existing(force: Series) -> CellSamples:
    if force.joint_count > 1:
        raise RecordingError(f"the force has {force.joint_count} axes", "reduce it to one, with with_scalar_force")
    reading = np.ascontiguousarray(force.values[:, 0])
    present = np.isfinite(reading)
    if present.all():
        return CellSamples(CellClock(force.time), reading)
    return CellSamples(CellClock(force.time[present]), reading[present])


def longest_step(time: FloatArray) -> float:
    """Return the longest step between samples of a load cell that is not a hole.

    Parameters
    ----------
    time : ndarray of float, shape (n,)
        Times of the samples [s].

    Returns
    -------
    float
        The step [s].

    Examples
    --------
    >>> longest_step(np.arange(1000) * 1e-3), round(longest_step(np.arange(100) * 1e-2), 6)
    (0.005, 0.025)
    """
    return CellClock(time).longest_step


def time_to_shoulder(time: FloatArray, force: FloatArray, period: float) -> float:
    """Return how long after its first sample a contact's force stops rising as it did at first [s].

    `force` (n,) [N] is relative to the rest level, positive if it presses, from the onset. It stops where over 5 ms, or
    three periods, it rises by less than a quarter of its steepest rise so far. A touch of the same two bodies takes at
    least about twice as long, however fast they meet: stiffness and mass are the same.
    """
    span = max(CLOSE_ENOUGH, 3.0 * period)
    after = np.searchsorted(time, time + span)
    known = after < len(time)
    rise = (force[after[known]] - force[known]) / (time[after[known]] - time[known])
    flat = np.flatnonzero(rise < 0.25 * np.maximum.accumulate(rise)) if len(rise) else np.empty(0)
    return float(time[int(flat[0])] - time[0]) if len(flat) else 0.0
