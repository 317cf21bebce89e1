"""The first channel to move: a diagnosis after the event, for people.

Conventions: it uses the recording before and after the event; no detector, no threshold and no latency depends on it.
Times are seconds on the recording's own clock. The load cell and labels are not used.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from cdtool.detection import WHOLE_MACHINE
from cdtool.errors import UsageError, nearest
from cdtool.recording import MEASURED, REFERENCES, FloatArray, Recording

# Commands to the machine. The reference torque is not one: it is a controller output and responds to a contact.
COMMANDS = ("reference_position", "reference_speed")

# Extrapolation of a channel's line that is tested before the event [s]; deviations grow with it.
_AHEAD = (0.05, 0.1, 0.2)
# Noises off its line at which a channel has moved, and to which the movement is traced back.
_MOVED, _BACK_TO = 6.0, 2.0
_SUCCESSION = 3
_ENOUGH = 10
# A standard deviation from the median absolute deviation of Gaussian noise, and of rounding to a step of 1.
_MAD, _ROUNDING = 1.4826, 1.0 / math.sqrt(12.0)
# Rounding errors of computed values: changes below this share of the channel's size do not count.
_SMALLEST = 1e-9


@dataclass(frozen=True)
class Movement:
    """When and in which direction a channel of a joint moved away: `time` [s]; NaN if it did not, with the reason.

    Compared with impact-free runs: its `value` where the deviation is largest, with their `mean` and `spread` there, in
    `unit`; NaN if the run's own past was used. `brief`: it returned within a few samples.
    """

    channel: str
    joint: str
    time: float
    direction: Literal["up", "down", ""] = ""
    reason: str = ""
    unit: str = ""
    value: float = math.nan
    mean: float = math.nan
    spread: float = math.nan
    brief: bool = False


def which_moved_first(
    recording: Recording, joint: str, around: float, *, before: float = 0.5, lead: float = 0.05, after: float = 0.5
) -> tuple[Movement, ...]:
    """Return the channels of a joint in the order in which they moved, compared with their own past.

    Parameters
    ----------
    recording : Recording
        The recording on the load side.
    joint : str
        A joint, or the whole machine (`WHOLE_MACHINE`): then the channels of every joint.
    around : float
        Time of the event [s].
    before : float
        Length of the past to which a channel's line is fitted [s].
    lead : float
        The past ends, and the search begins, this long before the event [s].
    after : float
        The search ends this long after the event [s].

    Returns
    -------
    tuple of Movement
        The measured and reference channels: those that moved in order of time, then the others with the reason.

    Raises
    ------
    UsageError
        The joint is unknown.

    Notes
    -----
    A channel moves at the first of 3 consecutive samples with |x - line| > 6 s, traced back to 2 s. The line is the
    least-squares line through the past, extrapolated. The noise s is the usual deviation of the channel's past from
    such a line, extrapolated equally far (at most 0.2 s): 1.4826 times the median absolute deviation, and at least the
    rounding error of a quantised channel, its step / sqrt(12).

    Fails for a channel that oscillates slowly, or if the motion changed within the second before the event. A filtered
    channel moves late.

    Examples
    --------
    A leaf at constant speed is braked from 1 s; its torque stays constant.

    >>> from cdtool.recording import Series
    >>> time = np.arange(2000) * 1e-3
    >>> speed = Series(time, np.where(time < 1.0, 0.5, 0.5 - 2.0 * (time - 1.0)), "m/s")
    >>> run = Recording("run", "", ("leaf",), {"torque": Series(time, np.full(2000, 30.0), "N"), "speed": speed})
    >>> [(item.channel, item.direction, round(item.time, 3)) for item in which_moved_first(run, "leaf", 1.0)]
    [('speed', 'down', 1.001), ('torque', '', nan)]
    """
    names = recording.joints if (joint,) == WHOLE_MACHINE else (joint,)
    for name in names:
        if name not in recording.joints:
            raise UsageError(f"{recording.name}: unknown joint '{name}'", nearest(name, recording.joints))
    begin = around - lead
    found = []
    for channel in (*MEASURED, *REFERENCES):
        if channel not in recording:
            continue
        series = recording[channel].between(begin - 2.0 * before - _AHEAD[-1], around + after)
        for name in names:
            column = series.values[:, recording.joints.index(name)]
            present = np.isfinite(column)
            found.append(_movement(channel, name, series.time[present], column[present], begin, before))
    return tuple(sorted(found, key=lambda item: (math.isnan(item.time), item.time)))


def _movement(channel: str, joint: str, time: FloatArray, value: FloatArray, begin: float, before: float) -> Movement:
    off = _off_line(time, value, np.full(len(time), begin), before)
    quiet = (time >= begin - before) & (time <= begin)
    # A log that begins shortly before the event has nothing to extrapolate: the line's own residuals are used.
    usual = [_usual(_off_line(time, value, time - ahead, before)[quiet], off[quiet]) for ahead in _AHEAD]
    later = np.flatnonzero(time > begin)
    if len(later) < _SUCCESSION or not np.isfinite([*usual, *off[later]]).all():
        return Movement(channel, joint, math.nan, reason="too few samples")
    least = max(_ROUNDING * _step(value[time <= begin]), _SMALLEST * float(np.abs(value).max()))
    noise = np.maximum(np.interp(time[later] - begin, _AHEAD, usual), least)
    off = off[later]
    outside = np.abs(off) > _MOVED * noise
    run = np.lib.stride_tricks.sliding_window_view(outside, _SUCCESSION).all(axis=1)
    if not run.any():
        return Movement(channel, joint, math.nan, reason="no departure found")
    first = int(np.argmax(run))
    upward = bool(off[first] > 0.0)
    calm = np.flatnonzero((off if upward else -off)[:first] <= _BACK_TO * noise[:first])
    start = int(calm[-1]) + 1 if len(calm) else 0
    return Movement(channel, joint, float(time[later[start]]), "up" if upward else "down")


def _usual(tried: FloatArray, residuals: FloatArray) -> float:
    """Return the usual deviation of a channel from its line: a standard deviation; NaN with too few samples."""
    for off in (tried, residuals):
        known = off[np.isfinite(off)]
        if len(known) >= _ENOUGH:
            return _MAD * float(np.median(np.abs(known)))
    return math.nan


def _off_line(time: FloatArray, value: FloatArray, ends: FloatArray, length: float) -> FloatArray:
    """Return each sample's distance from the least-squares line through the `length` seconds up to its entry of `ends`.

    NaN if that interval has too few samples, or covers less than half of its length.
    """
    if not len(time):
        return np.empty(0)
    # Sums from the first sample, about it and about the mean, so that they keep their digits at any time and offset.
    t, v = time - time[0], value - value.mean()
    first = np.searchsorted(time, ends - length, side="left")
    after = np.searchsorted(time, ends, side="right")
    count = (after - first).astype(np.float64)

    def total(terms: FloatArray) -> FloatArray:
        sums = np.concatenate(([0.0], np.cumsum(terms)))
        difference: FloatArray = sums[after] - sums[first]
        return difference

    held = time[np.maximum(after, 1) - 1] - time[np.minimum(first, len(time) - 1)]
    enough = (count >= _ENOUGH) & (held >= 0.5 * length)
    count = np.maximum(count, 1.0)
    mean_t, mean_v = total(t) / count, total(v) / count
    variance = total(t * t) / count - mean_t**2
    covariance = total(t * v) / count - mean_t * mean_v
    slope = np.divide(covariance, variance, out=np.zeros(len(t)), where=enough)
    return np.where(enough, v - mean_v - slope * (t - mean_t), np.nan)


def _step(value: FloatArray) -> float:
    """Return the smallest step between samples, that of a quantised channel; 0 for a channel that does not change."""
    steps = np.abs(np.diff(value))
    steps = steps[steps > _SMALLEST * np.abs(value).max(initial=0.0)]
    return float(steps.min()) if len(steps) else 0.0
