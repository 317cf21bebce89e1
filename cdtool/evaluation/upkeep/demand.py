"""Which safety factor each location of a run demands: the distance to its alarm, along the stroke.

Conventions: signed exceedances e of the band's middle, in spreads, place by place (p,) along the stroke, for each
joint (J,) and monitored side (s,): a run alarms where `held` exceeds the safety factor. A change that shifts the
signal by d spreads at a place adds d to `held` of the upper side there, and -d to that of the lower one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cdtool.activation import Activation
from cdtool.detection import Status
from cdtool.evaluation.upkeep.deviation import Axis, deviations_of
from cdtool.motion.progress import Progress
from cdtool.pipeline import Detection
from cdtool.recording import FloatArray
from cdtool.short_repr import short_repr
from cdtool.thresholds.fitted_signature import FittedSignature

# A place has a mean where it holds at least so many samples.
_LEAST_SAMPLES = 3


@dataclass(frozen=True)
class Demand:
    """What one run demands: `held` (s, p, J) and the mean exceedance `mean` (p, J), in spreads.

    `held` is the largest exceedance of the side that lasted as long as the debounce; -inf (and NaN in `mean`) where the
    run was not assessable. `sides` (s,): +1, -1. `shift` (J,): that of the whole stroke from what was learned, in
    spreads, which is not followed by a band that follows the run. `alarm`: whether the run raised one.
    """

    name: str
    sides: tuple[int, ...]
    held: FloatArray
    mean: FloatArray
    shift: FloatArray
    alarm: bool

    __repr__ = short_repr

    @property
    def critical_factor(self) -> float:
        """Return the safety factor below which the run alarms."""
        return float(self.held.max(initial=-np.inf))


@dataclass(frozen=True)
class Places:
    """The places of a signature: `at` (p,) are their middles; the first `by_time` of them [s], the others along travel.

    They are as its limits are: by time while the axis accelerates, where the friction of the start needs a fine
    division, and by travel afterwards. Each is a window wide.
    """

    at: FloatArray
    by_time: int
    widths: tuple[float, float]

    __repr__ = short_repr

    @classmethod
    def of(cls, signature: FittedSignature) -> Places:
        """Return the places of a signature."""
        time, travel = signature.by_time, signature.by_position
        middles = [
            (np.arange(max(math.ceil((len(curve.count) - 1) * curve.step / curve.window), 1)) + 0.5) * curve.window
            if signature.alignment in (alignment, "time_then_position")
            else np.empty(0)
            for alignment, curve in (("time", time), ("position", travel))
        ]
        return cls(np.concatenate(middles), len(middles[0]), (time.window, travel.window))

    def axis(self, place: int) -> Axis:
        """Return along what a place is."""
        return "time" if place < self.by_time else "travel"

    def index(self, where: Progress) -> npt.NDArray[np.int64]:
        """Return the place (n,) of each sample; -1 before the motion begins."""
        travels = len(self.at) - self.by_time
        by_travel = where.running if self.by_time else np.ones(len(where.running), dtype=bool)
        by_travel = by_travel & (travels > 0)
        along = np.where(by_travel, where.travel / self.widths[1], where.elapsed / self.widths[0])
        known = np.isfinite(along)
        last = np.where(by_travel, travels, self.by_time) - 1
        place = np.clip(np.where(known, along, 0.0).astype(np.int64), 0, last)
        found: npt.NDArray[np.int64] = np.where(known, np.where(by_travel, place + self.by_time, place), -1)
        return found


def demand_of(signature: FittedSignature, detection: Detection, activation: Activation) -> Demand:
    """Return what a run demands at each place of its signature.

    Parameters
    ----------
    signature : FittedSignature
        The signature that the run was compared with.
    detection : Detection
        The run.
    activation : Activation
        What raises an alarm.

    Returns
    -------
    Demand
        Its exceedances by side, place and joint.

    Notes
    -----
    The place of a debounced exceedance is that of its last sample. Samples beyond the last place count as in it. With
    two sides, an exceedance that changes the side within the debounce counts on neither.

    Examples
    --------
    `cdtool.forecast_signature` forecasts from the demands of a season's runs.
    """
    statistic, places = detection.statistic, Places.of(signature)
    recording = detection.operation.recording.without_ground_truth()
    index = places.index(signature.progress(recording, statistic.time))
    known = index >= 0
    exceedance = detection.exceedance()
    if not signature.watched:
        middle = 0.5 * (detection.band.lower + detection.band.upper)
        with np.errstate(invalid="ignore"):
            exceedance = np.where(statistic.values < middle, -exceedance, exceedance)
    sides = (1,) if signature.watched else (1, -1)
    joints = exceedance.shape[1]
    held = np.full((len(sides), len(places.at), joints), -np.inf)
    mean = np.full((len(places.at), joints), np.nan)
    needed = activation.needed(statistic.time)
    for joint in range(joints):
        status = statistic.status[:, joint]
        present = (status != Status.GAP) & known
        valid = (status == Status.VALID)[present] & np.isfinite(exceedance[present, joint])
        values, at = exceedance[present, joint], index[present]
        for row, side in enumerate(sides):
            lasting = _lasting(np.where(valid, side * values, -np.inf), needed[present])
            np.maximum.at(held[row, :, joint], at, lasting)
        count = np.bincount(at[valid], minlength=len(places.at))
        total = np.bincount(at[valid], weights=values[valid], minlength=len(places.at))
        mean[:, joint] = np.where(count >= _LEAST_SAMPLES, total / np.maximum(count, 1), np.nan)
    shift = deviations_of(signature, [detection]).overall[0]
    return Demand(detection.operation.name, sides, held, mean, shift, detection.verdict.outcome == "alarm")


def _lasting(values: FloatArray, needed: npt.NDArray[np.int64]) -> FloatArray:
    """Return at each sample (n,) what the last `needed` (n,) samples all reach; -inf where there are not as many."""
    lasting = np.full(len(values), -np.inf)
    for count in np.unique(needed[needed > 0]).tolist():
        if count > len(values):
            continue
        lowest = np.lib.stride_tricks.sliding_window_view(values, count).min(axis=1)
        rows = np.flatnonzero(needed == count)
        rows = rows[rows >= count - 1]
        lasting[rows] = lowest[rows - count + 1]
    return lasting
