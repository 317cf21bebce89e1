"""Mean and spread of many runs along one axis (time since motion start, or travel): a signature's statistics."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Self

import numpy as np

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.base.derived import SendsFields
from cdtool.base.kernels import READ_ONLY, kernel
from cdtool.detectors.detection import Signal
from cdtool.recordings.motion.progress import Progress
from cdtool.recordings.motion.smoothing import moving_mean
from cdtool.recordings.motion.speed_course import COVERAGE

# The spread is nowhere below this share of its median: a quantised signal may not vary at all at some points.
_SMALLEST_SPREAD = 0.1
# A sample stands for a grid point at most so many steps before it: of the grid, or of the log where those are wider.
_FURTHEST_STEPS = 2.0


@dataclass(frozen=True)
class Curve(SendsFields):
    """On the grid 0, step, 2 step, ...: `count`, `mean` and `squares` (sum of squared deviations), each (g, J).

    `window`: neighbours up to this distance on either side are pooled, in the unit of the grid.
    """

    step: float
    window: float
    count: FloatArray
    mean: FloatArray
    squares: FloatArray

    @classmethod
    def empty(cls, step: float, window: float, end: float, joints: int) -> Self:
        """Return a curve without runs from 0 to `end`."""
        shape = (math.floor(end / step) + 1, joints)
        return cls(step, window, np.zeros(shape), np.zeros(shape), np.zeros(shape))

    @cached_property
    def grid(self) -> FloatArray:
        """The grid points (g,), read-only."""
        points: FloatArray = np.arange(len(self.count), dtype=np.float64) * self.step
        points.flags.writeable = False
        return points

    @cached_property
    def end(self) -> float:
        """The last grid point that enough runs have reached."""
        covered = np.flatnonzero((self.count >= self.enough).all(axis=1))
        return float(covered[-1] * self.step) if len(covered) else 0.0

    def learned(self, samples: FloatArray) -> Curve:
        """Return the statistics of runs resampled on the grid, (runs, g, J), NaN where a run has no valid value."""
        present = np.isfinite(samples)
        count = present.sum(axis=0).astype(np.float64)
        total = np.where(present, samples, 0.0).sum(axis=0)
        mean = np.divide(total, count, out=np.zeros_like(total), where=count > 0)
        squares = np.where(present, (samples - mean) ** 2, 0.0).sum(axis=0)
        return replace(self, count=count, mean=mean, squares=squares)

    def updated(self, sample: FloatArray, effective_runs: float | None) -> Curve:
        """Return the curve with one more run (g, J): Welford's update, or one of weight 1 / `effective_runs`."""
        present = np.isfinite(sample)
        deviation = np.where(present, sample - self.mean, 0.0)
        if effective_runs is None:
            count = self.count + present
            mean = self.mean + np.divide(deviation, count, out=np.zeros_like(deviation), where=count > 0)
            squares = self.squares + deviation * np.where(present, sample - mean, 0.0)
            return replace(self, count=count, mean=mean, squares=squares)
        known = present & (self.count >= 2)
        weight = 1.0 / effective_runs
        variance = self._variance()
        moved = (1.0 - weight) * (variance + weight * deviation**2)
        squares = np.where(known, moved * np.maximum(self.count - 1.0, 1.0), self.squares)
        return replace(self, mean=self.mean + np.where(known, weight * deviation, 0.0), squares=squares)

    def without(self, sample: FloatArray) -> Curve:
        """Return the curve without one of the runs (g, J) that it was learned from: Welford's update undone."""
        present = np.isfinite(sample)
        count = self.count - present
        deviation = np.where(present, sample - self.mean, 0.0)
        moved = np.divide(deviation, count, out=np.zeros_like(deviation), where=count > 0)
        mean = np.where(count > 0, self.mean - moved, 0.0)
        squares = np.maximum(self.squares - deviation * np.where(present, sample - mean, 0.0), 0.0)
        return replace(self, count=count, mean=mean, squares=np.where(count > 0, squares, 0.0))

    def clipped(self, sample: FloatArray, cap: float, pooled: bool) -> FloatArray:
        """Return a run (g, J) clipped to `cap` spreads from the mean; unchanged where no spread is known yet."""
        _, spread = self.band(pooled)
        reach = np.where(np.isfinite(spread), cap * spread, np.inf)
        held: FloatArray = np.clip(sample, self.mean - reach, self.mean + reach)
        return held

    def band(self, pooled: bool) -> tuple[FloatArray, FloatArray]:
        """Return mean and spread (g, J), NaN where there are too few runs.

        Pooled: the mean smoothed over the window, and the spread from the variance pooled over the window, including
        the deviation of the mean from its smoothed curve. Otherwise point by point. Read-only: both are computed once.
        """
        return self._pooled_band if pooled else self._own_band

    @cached_property
    def _pooled_band(self) -> tuple[FloatArray, FloatArray]:
        known = self.count >= self.enough
        reach = round(self.window / self.step)
        mean = moving_mean(self.mean, known, reach)
        return self._where_known(mean, moving_mean(self._variance() + (self.mean - mean) ** 2, known, reach), known)

    @cached_property
    def _own_band(self) -> tuple[FloatArray, FloatArray]:
        return self._where_known(self.mean, self._variance(), self.count >= self.enough)

    @staticmethod
    def _where_known(mean: FloatArray, variance: FloatArray, known: BoolArray) -> tuple[FloatArray, FloatArray]:
        spread = np.sqrt(variance)
        for j in range(spread.shape[1]):
            if known[:, j].any():
                floor = _SMALLEST_SPREAD * float(np.median(spread[known[:, j], j]))
                spread[:, j] = np.maximum(spread[:, j], floor)
        band = np.where(known, mean, np.nan), np.where(known, spread, np.nan)
        for part in band:
            part.flags.writeable = False
        return band

    def to_dict(self) -> dict[str, Any]:
        """Return the curve as JSON values."""
        arrays = {name: getattr(self, name).tolist() for name in ("count", "mean", "squares")}
        return {"step": self.step, "window": self.window, **arrays}

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """Return the curve that `to_dict` has written; raises ValueError if it is damaged."""
        count, mean, squares = (np.array(values[name], dtype=np.float64) for name in ("count", "mean", "squares"))
        step, window = float(values["step"]), float(values["window"])
        alike = count.ndim == 2 and count.size and count.shape == mean.shape == squares.shape
        if not (alike and np.isfinite((count, mean, squares)).all() and min(count.min(), squares.min()) >= 0.0):
            raise ValueError(f"a curve of counts {count.shape}, means {mean.shape} and squares {squares.shape}")
        if not 0.0 < step <= window <= 1e6 * step:  # nothing was learned with a window of more steps
            raise ValueError(f"a curve with step {step:g} and window {window:g}")
        return cls(step, window, count, mean, squares)

    @property
    def enough(self) -> float:
        """The number of runs that a grid point needs to have a limit."""
        return max(2.0, math.ceil(COVERAGE * float(self.count.max(initial=0.0))))

    def _variance(self) -> FloatArray:
        return self.squares / np.maximum(self.count - 1.0, 1.0)


def resample(signal: Signal, at: Progress, curve: Curve, axis: FloatArray) -> FloatArray:
    """Return the values of one run (g, J) on the grid of a curve: the sample that first passes each grid point, or NaN.

    A sample, not a value between two: interpolation would average their noise and make the spread too small. In a log
    with fewer samples than grid points, each sample represents those that it has passed since the last one.
    """
    result = np.full((len(curve.count), signal.values.shape[1]), np.nan)
    located = np.isfinite(at.elapsed) & np.isfinite(axis)
    along, values = np.empty((2, len(axis)))
    for j in range(result.shape[1]):
        count = first_passes(axis, signal.values[:, j], signal.valid[:, j] & located, along, values)
        # After an interval without valid samples the next sample is too far away to represent the grid point.
        usual = float(np.median(np.diff(along[:count]))) if count > 1 else 0.0
        furthest = _FURTHEST_STEPS * max(curve.step, usual)
        fill_passed(curve.grid, along[:count], values[:count], furthest, result[:, j])
    return result


@kernel(
    f"int64({READ_ONLY}, Array(float64, 1, 'A', readonly=True), Array(bool, 1, 'C', readonly=True), float64[::1], "
    "float64[::1])",
    exact=True,
)
def first_passes(axis: FloatArray, samples: FloatArray, use: BoolArray, along: FloatArray, values: FloatArray) -> int:
    """Fill locations and values of the samples that are farther than all before them; return how many there are."""
    count = 0
    for k in range(len(axis)):
        if use[k] and (count == 0 or axis[k] > along[count - 1]):
            along[count], values[count] = axis[k], samples[k]
            count += 1
    return count


@kernel(f"void({READ_ONLY}, {READ_ONLY}, {READ_ONLY}, float64, float64[:])", exact=True)
def fill_passed(grid: FloatArray, along: FloatArray, values: FloatArray, furthest: float, result: FloatArray) -> None:
    """Fill the value of the first location at or after each grid point, if it is at most `furthest` beyond it."""
    at = 0
    for k in range(len(grid)):
        while at < len(along) and along[at] < grid[k]:
            at += 1
        if at < len(along) and along[at] - grid[k] <= furthest:
            result[k] = values[at]
