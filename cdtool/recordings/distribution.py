"""The frequency of each value: the median and other quantiles of more values than memory can hold."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from cdtool.base.arrays import FloatArray

# Number of distinct values (1 MiB); values are collected up to this number, since sorting is the main cost.
_MOST = 1 << 16


class Distribution:
    """Finite values by frequency, in memory that does not grow with their number.

    Exact up to 65,536 distinct values. Beyond that, the last bits of all values are dropped until that number is met;
    any quantile is then accurate to `resolution`, relative. Steps between stamps that vary by a factor of two keep 5
    digits.
    """

    def __init__(self, most: int = _MOST) -> None:
        self._most = most
        self._values = np.empty(0)
        self._counts = np.empty(0, np.int64)
        self._waiting: list[FloatArray] = []
        self._waiting_count = 0
        self._dropped = 0  # bits

    def add(self, values: FloatArray) -> None:
        """Add values, all of them finite."""
        if len(values):
            self._waiting.append(values)
            self._waiting_count += len(values)
            if self._waiting_count >= self._most:
                self._sort()

    @property
    def count(self) -> int:
        """Return the number of values."""
        self._sort()
        return int(self._counts.sum())

    @property
    def resolution(self) -> float:
        """Return the largest relative error of a quantile; 0: exact."""
        self._sort()
        return 2.0 ** (self._dropped - 53) if self._dropped else 0.0  # a float64 has 52 bits, and half of the last one

    @property
    def median(self) -> float:
        """Return the median; NaN without values."""
        count = self.count
        return 0.5 * (self._at((count - 1) // 2) + self._at(count // 2)) if count else float("nan")

    def percentile(self, percent: float) -> float:
        """Return a percentile, interpolated linearly as numpy.percentile; NaN without values."""
        count = self.count
        if not count:
            return float("nan")
        place = (count - 1) * percent / 100.0
        before = int(place)
        low, high = self._at(before), self._at(min(before + 1, count - 1))
        return low + (place - before) * (high - low)

    def share(self, low: float, high: float) -> float:
        """Return the share of the values between two bounds, both included; NaN without values."""
        self._sort()
        values = self._shown(self._values)
        inside = (values >= low) & (values <= high)
        return float(self._counts[inside].sum() / self._counts.sum()) if len(self._counts) else float("nan")

    def _at(self, rank: int) -> float:
        """Return the value of that rank, from 0."""
        place = int(np.searchsorted(np.cumsum(self._counts), rank, side="right"))
        return float(self._shown(self._values[place : place + 1])[0])

    def _shown(self, values: FloatArray) -> FloatArray:
        """Return the values with the dropped bits at their centre."""
        if not self._dropped:
            return values
        middle = (values.view(np.int64) | (1 << (self._dropped - 1))).view(np.float64)
        return np.where(values == 0.0, 0.0, middle)

    def _sort(self) -> None:
        if not self._waiting:
            return
        waiting = np.concatenate(self._waiting).astype(np.float64)
        self._waiting, self._waiting_count = [], 0
        values = np.concatenate((self._values, self._rounded(waiting)))
        counts = np.concatenate((self._counts, np.ones(len(waiting), np.int64)))
        self._values, self._counts = _merged(values, counts)
        while len(self._values) > self._most and self._dropped < 52:
            self._dropped += 1
            self._values, self._counts = _merged(self._rounded(self._values), self._counts)

    def _rounded(self, values: FloatArray) -> FloatArray:
        cut: FloatArray = (values.view(np.int64) >> self._dropped << self._dropped).view(np.float64)
        return cut


def _merged(values: FloatArray, counts: npt.NDArray[np.int64]) -> tuple[FloatArray, npt.NDArray[np.int64]]:
    """Return each value once, in ascending order, with its frequency."""
    order = np.argsort(values, kind="stable")
    values, counts = values[order], counts[order]
    first = np.concatenate(([True], values[1:] != values[:-1]))
    return values[first], np.add.reduceat(counts, np.flatnonzero(first))
