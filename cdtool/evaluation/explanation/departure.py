"""The deviation of each channel from its normal band: when it first left it, and for how long.

Conventions: a diagnosis after the event, for people: it uses the recording before and after the event, and no detector,
no threshold and no latency depends on it. Times are seconds on the recording's own clock. Load cell and labels are not
used. Departures count in normal spreads: of single samples, and of a channel's level, the mean over 50 ms, which shows
a small lasting shift that single samples hide.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cdtool.evaluation.explanation.movement import Movement
from cdtool.evaluation.explanation.transient import Transient
from cdtool.kernels import READ_ONLY, kernel
from cdtool.median_kernel import median_of
from cdtool.recording import FloatArray, Recording
from cdtool.thresholds.normal_motion import CHANNELS, POSITIONS, Comparison, NormalMotion, levels

# Two columns of a fit are the same straight line if the determinant is at most this share of its largest value.
_SINGULAR = 1e-13
# A channel has left its normal band if it is farther from the mean than impact-free runs are, by this factor (the runs
# learned from are closer to their own mean than others), and at least this many spreads.
_BEYOND, _LEAST_OUT = 1.5, 5.0
# The departure began where it last was within this share of that.
_BACK_TO = 0.4
_SUCCESSION = 3
# A departure that takes longer than this [s] to be certain may start with a slow drift: the bend of its curve is
# searched at this many samples, with this much of it before [s].
_SLOW, _BENDS, _BEFORE_BEND = 0.03, 60, 0.1
# A run's own constant distance from the mean counts up to this many spreads; more is a departure.
_OFFSET = 2.5
# Spreads by which a channel may deviate from its own past without a departure.
_OWN_REACH = 5.0
# Length of the interval from which a run's own distance is computed, up to the search [s].
_BASELINE = 0.5
_ENOUGH = 10
# A departure is brief if it is over after this time [s], followed by this much calm, within this many spreads.
_BRIEF, _CALM, _BACK = 0.15, 0.03, 3.5


@dataclass(frozen=True)
class Track:
    """One channel of one joint over the analysed time, compared with its normal band.

    `samples` and `level` (n,) are distances from the normal mean in normal spreads, minus the run's own constant
    distance; NaN if unknown. `value`, `mean`, `spread` are in `unit`. `raw`: `samples` including that distance. `out`
    and `level_out`: number of spreads outside which it has left its normal band.
    """

    channel: str
    joint: str
    unit: str
    time: FloatArray
    value: FloatArray
    mean: FloatArray
    spread: FloatArray
    raw: FloatArray
    samples: FloatArray
    level: FloatArray
    level_off: FloatArray
    level_mean: FloatArray
    out: FloatArray
    level_out: FloatArray

    def between(self, start: float, end: float) -> slice:
        """Return the samples from `start` to `end` [s]."""
        first, after = np.searchsorted(self.time, start), np.searchsorted(self.time, end, side="right")
        return slice(int(first), int(after))

    def shift(self, start: float, end: float) -> float:
        """Return the mean distance of the level from normal, in spreads, from `start` to `end` [s]; NaN if unknown."""
        return _mean(self.level[self.between(start, end)])

    def change(self, start: float, end: float) -> float:
        """Return the same in the channel's unit."""
        return _mean(self.level_off[self.between(start, end)])

    def normal(self, start: float, end: float) -> float:
        """Return the normal mean from `start` to `end` [s]."""
        return _mean(self.level_mean[self.between(start, end)])

    def movement(self, begin: float, end: float) -> Movement:
        """Return when and in which direction the channel left its normal band from `begin` to `end` [s], if it did."""
        part = self.between(begin, end)
        samples, level, raw = self.samples[part], self.level[part], self.raw[part]
        if np.count_nonzero(np.isfinite(samples)) < _SUCCESSION:
            return Movement(self.channel, self.joint, math.nan, reason="no normal band known here", unit=self.unit)
        shares = samples / self.out[part], level / self.level_out[part]
        at = _first_out(*shares)
        if at is None:
            first = first_beyond(np.where(np.abs(raw) > self.out[part], 2.0, 0.0), 1.0, _SUCCESSION)
            if first < 0:
                farthest = part.start + int(np.nanargmax(np.abs(raw)))
                return self._movement_at(math.nan, "", "within its usual range", farthest)
            return self._movement_at(math.nan, _side(raw[first]), "outside since before", part.start + first)
        k, upward, of_level = at
        sign = 1.0 if upward else -1.0
        start = part.start + _began(self.time[part][: k + 1], sign * shares[of_level][: k + 1])
        known = np.where(np.isfinite(samples), sign * samples, -np.inf)
        farthest = part.start + k + int(np.argmax(known[k:]))
        return self._movement_at(float(self.time[start]), "up" if upward else "down", "", farthest)

    def brief(self, begin: float, end: float) -> Transient | None:
        """Return a departure that began from `begin` to `end` [s] and soon ended, or None."""
        moved = self.movement(begin, end)
        if math.isnan(moved.time):
            return None
        part = self.between(moved.time, moved.time + _BRIEF)
        outside = np.flatnonzero(np.abs(self.samples[part]) > _BACK)
        if not len(outside) or self.time[part][outside[-1]] > moved.time + _BRIEF - _CALM:
            return None
        last = part.start + int(outside[-1])
        samples = self.samples[part.start : last + 1]
        off = (self.value - self.mean)[part.start : last + 1]
        k = int(np.nanargmax(np.abs(samples)))
        height = float(off[k])
        area = float(np.nansum(off[:-1] * np.diff(self.time[part.start : last + 1])))
        rings = bool((off < -0.3 * abs(height)).any() and (off > 0.3 * abs(height)).any())
        noises = float(abs(samples[k]))
        end = float(self.time[last])
        return Transient(self.channel, self.joint, self.unit, moved.time, end, height, noises, area, rings)

    def _movement_at(self, time: float, direction: str, reason: str, k: int) -> Movement:
        return Movement(
            self.channel,
            self.joint,
            time,
            direction,  # type: ignore[arg-type]
            reason,
            self.unit,
            float(self.value[k]),
            float(self.mean[k]),
            float(self.spread[k]),
        )


def tracks_of(
    recording: Recording, normal: NormalMotion | None, joints: Sequence[str], begin: float, end: float
) -> list[Track]:
    """Compare every channel of the joints from `begin` to `end` [s] with impact-free runs.

    Without `normal`, mean and spread of the run's own half second before `begin` are used.
    """
    tracks = []
    for channel in CHANNELS:
        if channel not in recording or (normal is not None and channel not in normal.channels):
            continue
        compared = normal.compare(recording, channel) if normal is not None else _own_past(recording, channel, begin)
        cut = slice(*np.searchsorted(compared.time, (begin - _BASELINE, end)))
        quiet = np.searchsorted(compared.time[cut], begin)
        for joint in joints:
            tracks.append(_track(channel, joint, recording.joints.index(joint), compared, cut, int(quiet)))
    return tracks


def _track(channel: str, joint: str, j: int, compared: Comparison, cut: slice, quiet: int) -> Track:
    raw, raw_level = compared.distance[cut, j], compared.level_distance[cut, j]
    # The assumed start of the motion shifts a whole position: only a change of its distance counts.
    reach = math.inf if channel in POSITIONS else _OFFSET
    own, own_level = (_own_offset(item[:quiet], reach) for item in (raw, raw_level))
    if channel in POSITIONS:
        raw = raw - own
    return Track(
        channel,
        joint,
        compared.unit,
        compared.time[cut],
        compared.value[cut, j],
        compared.mean[cut, j],
        compared.spread[cut, j],
        raw,
        raw - own,
        raw_level - own_level,
        compared.level_off[cut, j],
        compared.level_mean[cut, j],
        *(np.maximum(_BEYOND * item[cut, j], _LEAST_OUT) for item in (compared.reach, compared.level_reach)),
    )


def _own_past(recording: Recording, channel: str, begin: float) -> Comparison:
    """Compare the channel with its own half second before `begin`: constant mean and spread."""
    series = recording[channel]
    quiet = slice(*np.searchsorted(series.time, (begin - _BASELINE, begin)))
    level = levels(series.time, series.values)
    reach = np.full(series.values.shape, _OWN_REACH)
    samples, means = (_own_normal(values, quiet) for values in (series.values, level))
    return Comparison(series.unit, series.time, series.values, *samples, level, *means, reach, reach)


def _own_normal(values: FloatArray, quiet: slice) -> tuple[FloatArray, FloatArray]:
    past, shape = values[quiet], values.shape
    if np.count_nonzero(np.isfinite(past).all(axis=1)) < _ENOUGH:
        return np.full(shape, np.nan), np.full(shape, np.nan)
    spread = np.maximum(np.nanstd(past, axis=0), 1e-3 * np.nanmax(np.abs(past), axis=0))
    return np.broadcast_to(np.nanmean(past, axis=0), shape), np.broadcast_to(spread, shape)


def _own_offset(past: FloatArray, reach: float) -> float:
    """Return a run's own constant distance from the mean [spreads], up to `reach`.

    With too little data it is 0, or unknown (NaN) if it is unlimited.
    """
    middle = median_of_known(np.ascontiguousarray(past), np.empty(len(past)), _ENOUGH)
    if math.isnan(middle):
        return 0.0 if math.isfinite(reach) else math.nan
    return float(min(max(middle, -reach), reach))


def _first_out(samples: FloatArray, level: FloatArray) -> tuple[int, bool, bool] | None:
    """Return the first sample of a departure (above 1), whether it is upward, and whether it is the level's."""
    found = []
    for values, of_level in ((samples, False), (level, True)):
        for sign in (1.0, -1.0):
            k = first_beyond(values, sign, _SUCCESSION)
            if k >= 0:
                found.append((k, sign > 0.0, of_level))
    return min(found) if found else None


def _began(time: FloatArray, shares: FloatArray) -> int:
    """Return where an upward departure, certain at the last sample, began: traced back to `_BACK_TO` of its limit.

    If a channel had drifted that far before, its departure began at the bend of its curve.
    """
    last = len(shares) - 1
    within = np.flatnonzero(~(shares > _BACK_TO))
    first = min(int(within[-1]) + 1, last) if len(within) else 0
    if time[last] - time[first] <= _SLOW:
        return first
    return max(first, _bend(time, shares, first))


def _bend(time: FloatArray, shares: FloatArray, first: int) -> int:
    """Return the sample, `first` or later, at which the shares leave a straight line for a steeper one upward.

    By least squares over the samples from `_BEFORE_BEND` before `first` to the last.
    """
    begin = int(np.searchsorted(time, time[first] - _BEFORE_BEND))
    known = begin + np.flatnonzero(np.isfinite(shares[begin:]))
    candidates = np.unique(np.linspace(first, len(shares) - _SUCCESSION, _BENDS).astype(np.int64))
    since = time - time[begin]
    return int(steepest_bend(since[known], shares[known], first, since[candidates], candidates))


def _side(value: float) -> str:
    return "up" if value > 0.0 else "down"


def _mean(values: FloatArray) -> float:
    known = values[np.isfinite(values)]
    return float(known.mean()) if len(known) else math.nan


@kernel(f"int64({READ_ONLY}, float64, int64)")
def first_beyond(values: FloatArray, sign: float, succession: int) -> int:
    """Return the first of `succession` consecutive samples above 1 on that side, -1 without; NaN interrupts them."""
    run = 0
    for k in range(len(values)):
        run = run + 1 if sign * values[k] > 1.0 else 0
        if run == succession:
            return k - succession + 1
    return -1


@kernel(f"float64({READ_ONLY}, float64[::1], int64)", exact=True)
def median_of_known(values: FloatArray, scratch: FloatArray, least: int) -> float:
    """Return the median of the finite values, NaN with fewer than `least`; `scratch` (n,) is overwritten."""
    count = 0
    for value in values:
        if np.isfinite(value):
            scratch[count] = value
            count += 1
    return float(median_of(scratch, count)) if count >= least else np.nan


@kernel(f"int64({READ_ONLY}, {READ_ONLY}, int64, {READ_ONLY}, int64[::1])")
def steepest_bend(
    time: FloatArray, values: FloatArray, found: int, bends: FloatArray, candidates: npt.NDArray[np.int64]
) -> int:
    """Return the candidate at whose time in `bends` [s] two joined lines fit best, the second one steeper upward.

    Least squares of a + b t + c max(t - bend, 0) with c > 0 over `time` (n,) [s] and `values` (n,); `found` if no
    candidate has c > 0. If all samples are after a bend, the solution of least norm counts, as in numpy's `lstsq`.
    """
    n = len(time)
    mean_time = np.sum(time) / max(n, 1)
    mean_value = np.sum(values) / max(n, 1)
    best = np.inf
    for i in range(len(bends)):
        mean_after = 0.0
        for k in range(n):
            mean_after += max(time[k] - bends[i], 0.0)
        mean_after /= max(n, 1)
        tt = ta = aa = ty = ay = 0.0
        for k in range(n):
            t, y = time[k] - mean_time, values[k] - mean_value
            after = max(time[k] - bends[i], 0.0) - mean_after
            tt += t * t
            ta += t * after
            aa += after * after
            ty += t * y
            ay += after * y
        determinant = tt * aa - ta * ta
        if determinant > _SINGULAR * tt * aa:
            slope, more = (ty * aa - ay * ta) / determinant, (ay * tt - ty * ta) / determinant
        elif tt > 0.0 and aa > 0.0:
            line = ty / tt
            level = mean_value - line * mean_time
            more = (line - level * bends[i]) / (bends[i] * bends[i] + 2.0)
            slope = line - more
        else:
            continue
        if not more > 0.0:
            continue
        error = 0.0
        for k in range(n):
            after = max(time[k] - bends[i], 0.0) - mean_after
            left = values[k] - mean_value - slope * (time[k] - mean_time) - more * after
            error += left * left
        if error < best:
            best, found = error, candidates[i]
    return found
