"""The distance of a statistic from its limits over time, and its closest approach to an alarm.

Conventions: the margin is the distance from the statistic to its nearest limit, in the signal's unit: positive inside,
negative outside the band. The share of the limit is the safety factor at which the sample would meet its limit, over
the set one: 0 in the middle of the band (the learned mean, or 0 for a limit set by hand), 1 at the limit, more outside,
below 0 on the side without a limit. It is the same for one-sided and two-sided bands.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from cdtool.alarms.pipeline import Detection
from cdtool.base.arrays import FloatArray
from cdtool.detectors.detection import REASONS, Status


@dataclass(frozen=True)
class Moment:
    """The statistic at a time [s] with its nearest limit, both in the signal's unit.

    `margin` and `share` are NaN if the sample was not assessable, and `reason` states why.
    """

    time: float
    statistic: float
    limit: float
    margin: float
    share: float
    reason: str = ""


@dataclass(frozen=True)
class Approach:
    """How near a joint came to an alarm: its `nearest` sample, and the `longest` run of samples outside the band.

    `outside_from` [s] is the beginning of that run, NaN without one. `held` is the largest share of the limit held
    for the whole debounce: with `held` times the safety factor there would be an alarm; NaN if never assessable for
    that long. `latched_from` [s]: outside since then, with its crossing before the contact; NaN otherwise.
    """

    joint: str
    nearest: Moment
    longest: int
    outside_from: float
    held: float
    latched_from: float = math.nan


@dataclass(frozen=True)
class JointMargin:
    """One joint's `margin` [signal's unit] and `share` of the limit, both (n,), NaN where not assessable."""

    detection: Detection
    joint: int

    @property
    def name(self) -> str:
        """Return the joint's name."""
        return self.detection.statistic.joints[self.joint]

    @property
    def time(self) -> FloatArray:
        """(n,) [s]."""
        return self.detection.statistic.time

    @cached_property
    def margin(self) -> FloatArray:
        """Return the distance of the statistic from its nearest limit."""
        statistic, band, j = self.detection.statistic, self.detection.band, self.joint
        value = statistic.values[:, j]
        margin = np.minimum(band.upper[:, j] - value, value - band.lower[:, j])
        margin[statistic.status[:, j] != Status.VALID] = np.nan
        return margin

    @cached_property
    def share(self) -> FloatArray:
        """Return the share of the limit; NaN everywhere if no threshold applies."""
        detection = self.detection
        if detection.threshold is None:
            return np.full(len(self.time), np.nan)
        share = detection.exceedance()[:, self.joint] / detection.threshold.safety_factor
        return np.where(detection.statistic.status[:, self.joint] == Status.VALID, share, np.nan)

    def moment(self, k: int) -> Moment:
        """Sample k."""
        statistic, band, j = self.detection.statistic, self.detection.band, self.joint
        time, value = float(self.time[k]), float(statistic.values[k, j])
        reason = REASONS.get(int(statistic.status[k, j]), "")
        lower, upper = float(band.lower[k, j]), float(band.upper[k, j])
        limit = math.nan if reason else upper if upper - value <= value - lower else lower
        return Moment(time, value, limit, float(self.margin[k]), float(self.share[k]), reason)

    def moments(self, times: Sequence[float]) -> tuple[Moment, ...]:
        """Return the last sample at or before each of `times` [s]; in order of time, each sample once."""
        # An alarm minus 5 ms is the sample 5 ms before it, independent of the last bit of the difference.
        at = np.searchsorted(self.time, np.asarray(times) + 1e-9, side="right") - 1
        return tuple(self.moment(k) for k in sorted({k for k in at.tolist() if k >= 0}))

    @cached_property
    def runs(self) -> npt.NDArray[np.int64]:
        """Return runs outside the band, as counted by the activation (r, 3): first and last sample, how many.

        Missing samples do not interrupt a run and do not count.
        """
        present = np.flatnonzero(self.detection.statistic.status[:, self.joint] != Status.GAP)
        outside = np.concatenate(([False], self.margin[present] < 0.0, [False]))
        first, after = np.flatnonzero(np.diff(outside)).reshape(-1, 2).T
        return np.column_stack((present[first], present[after - 1], after - first))

    def approach(self, start: float, end: float, debounce: int) -> Approach | None:
        """Return how near it came to an alarm from `start` to `end` [s]; None without limit or assessable sample."""
        first, after = np.searchsorted(self.time, start), np.searchsorted(self.time, end, side="right")
        margin = self.margin[first:after]
        if not np.isfinite(margin).any():
            return None
        nearest = self.moment(int(first + np.nanargmin(margin)))
        runs = self.runs
        runs = runs[(runs[:, 1] >= first) & (runs[:, 0] < after)]
        latched = math.nan
        if len(runs) and np.count_nonzero(self.margin[runs[0, 0] : first] < 0.0) >= debounce:
            latched = float(self.time[runs[0, 0]])
            runs = runs[1:]
        longest, since = 0, math.nan
        if len(runs):
            best = runs[int(np.argmax(runs[:, 2]))]
            longest, since = int(best[2]), float(self.time[best[0]])
        present = self.detection.statistic.status[first:after, self.joint] != Status.GAP
        return Approach(self.name, nearest, longest, since, _held(self.share[first:after][present], debounce), latched)


def joint_margins(detection: Detection) -> tuple[JointMargin, ...]:
    """Return the margin of every joint of a detection.

    Parameters
    ----------
    detection : Detection
        The result of a detector for an operation.

    Returns
    -------
    tuple of JointMargin
        One per column of the statistic: margin [signal's unit] and share of the limit, both (n,). The shares are NaN
        if no threshold applies.

    Notes
    -----
    margin = min(upper - statistic, statistic - lower), share = k* / k: k* is the safety factor at which the sample
    would meet its limit (`exceedance` of the thresholds), k the set one. Both are NaN where the sample is not
    assessable.

    Examples
    --------
    The margin is smallest shortly after the contact, where the statistic is far outside its limit of 400 N.

    >>> import cdtool
    >>> log, machine = "sample_logs/gate/stiff/03.csv", "sample_logs/gate/machine.toml"
    >>> found = cdtool.detect(log, machine, detector="momentum", settings={"threshold.limits": 400.0}).detected
    >>> (gate,) = joint_margins(found.detections[0])
    >>> gate.name, bool(np.nanmin(gate.margin) < 0.0), bool(np.nanmax(gate.share) > 1.0)
    ('gate', True, True)
    """
    return tuple(JointMargin(detection, j) for j in range(detection.statistic.values.shape[1]))


def _held(share: FloatArray, debounce: int) -> float:
    """Return the largest share that `debounce` consecutive samples all had; a sample that is NaN interrupts them."""
    if len(share) < debounce:
        return math.nan
    least = np.lib.stride_tricks.sliding_window_view(share, debounce).min(axis=1)
    return math.nan if np.isnan(least).all() else float(np.nanmax(least))
