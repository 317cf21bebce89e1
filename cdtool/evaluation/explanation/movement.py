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
from cdtool.kernels import READ_ONLY, kernel
from cdtool.median_kernel import median_of
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
    start, direction = -1, 0
    if len(time) >= _SUCCESSION:
        start, direction = find_movement(time, value, value.mean(), begin, before, np.empty((5, len(time) + 1)))
    if direction:
        return Movement(channel, joint, float(time[start]), "up" if direction > 0 else "down")
    return Movement(channel, joint, math.nan, reason="too few samples" if start < 0 else "no departure found")


@kernel(
    f"UniTuple(int64, 2)({READ_ONLY}, {READ_ONLY}, float64, float64, float64, float64[:, ::1])",
    exact=True,
)
def find_movement(
    time: FloatArray, value: FloatArray, mean: float, begin: float, length: float, sums: FloatArray
) -> tuple[int, int]:
    """Return the sample at which a channel moved after `begin` [s], and its direction, 1 or -1; 0 if it did not.

    Then the sample is 0, or -1 if there are too few. `mean` is that of the values (n,), and `length` [s] that of a
    line. `sums` (5, n + 1) is overwritten.
    """
    fill_sums(time, value, mean, sums)
    first = past = 0
    for k in range(len(time)):
        first += time[k] < begin - length
        past += time[k] <= begin
    if len(time) - past < _SUCCESSION:
        return -1, 0
    usual = (
        _usual(time, value, mean, sums, first, past, _AHEAD[0], length),
        _usual(time, value, mean, sums, first, past, _AHEAD[1], length),
        _usual(time, value, mean, sums, first, past, _AHEAD[2], length),
    )
    off, line = sums[4], line_of(time, sums, first, past, length)
    is_known = math.isfinite(usual[0]) and math.isfinite(usual[1]) and math.isfinite(usual[2])
    size = 0.0
    for k in range(len(time)):
        size = max(size, abs(value[k]))
        off[k] = value[k] - mean - line[1] - line[2] * (time[k] - time[0] - line[0])
        is_known = is_known and (k < past or math.isfinite(off[k]))
    if not is_known:
        return -1, 0
    least = max(_ROUNDING * _step(value, past), _SMALLEST * size)
    outside = 0
    for k in range(past, len(time)):
        outside = outside + 1 if abs(off[k]) > _MOVED * max(_interpolated(time[k] - begin, usual), least) else 0
        if outside == _SUCCESSION:
            at = k - _SUCCESSION + 1
            sign = 1 if off[at] > 0.0 else -1
            while at > past and sign * off[at - 1] > _BACK_TO * max(_interpolated(time[at - 1] - begin, usual), least):
                at -= 1
            return at, sign
    return 0, 0


@kernel(f"void({READ_ONLY}, {READ_ONLY}, float64, float64[:, ::1])", exact=True)
def fill_sums(time: FloatArray, value: FloatArray, mean: float, sums: FloatArray) -> None:
    """Fill the sums up to each sample of time, value, time squared, and time by value.

    From the first sample and about the mean, so that they keep their digits at any time and offset.
    """
    sums[:4, 0] = 0.0
    for k in range(len(time)):
        t, v = time[k] - time[0], value[k] - mean
        terms = (t, v, t * t, t * v)
        for i in range(4):
            sums[i, k + 1] = sums[i, k] + terms[i] if k > 0 else terms[i]


@kernel(f"UniTuple(float64, 3)({READ_ONLY}, float64[:, ::1], int64, int64, float64)", exact=True)
def line_of(time: FloatArray, sums: FloatArray, first: int, after: int, length: float) -> tuple[float, float, float]:
    """Return the least-squares line through the samples from `first` until `after`: mean time and value, and slope.

    NaN if they are too few, or cover less than half of the `length` [s].
    """
    count = float(after - first)
    if count < _ENOUGH or not time[after - 1] - time[first] >= 0.5 * length:
        return math.nan, math.nan, math.nan
    mean_t = (sums[0, after] - sums[0, first]) / count
    mean_v = (sums[1, after] - sums[1, first]) / count
    variance = (sums[2, after] - sums[2, first]) / count - mean_t * mean_t
    covariance = (sums[3, after] - sums[3, first]) / count - mean_t * mean_v
    return mean_t, mean_v, covariance / variance


@kernel(
    f"float64({READ_ONLY}, {READ_ONLY}, float64, float64[:, ::1], int64, int64, float64, float64)",
    exact=True,
)
def _usual(  # noqa: PLR0913  a kernel: arrays and numbers one by one
    time: FloatArray,
    value: FloatArray,
    mean: float,
    sums: FloatArray,
    first: int,
    after: int,
    ahead: float,
    length: float,
) -> float:
    """Return the usual deviation of the samples from `first` until `after` from lines that end `ahead` [s] before each.

    A standard deviation. A log that begins shortly before the event has nothing to extrapolate: then it is that from
    the line through these samples; NaN if they are too few for that, too.
    """
    sizes = sums[4]
    known = begins = ends = 0
    for k in range(first, after):
        end = time[k] - ahead
        while begins < len(time) and time[begins] < end - length:
            begins += 1
        while ends < len(time) and time[ends] <= end:
            ends += 1
        line = line_of(time, sums, begins, ends, length)
        sizes[known] = abs(value[k] - mean - line[1] - line[2] * (time[k] - time[0] - line[0]))
        known += math.isfinite(sizes[known])
    if known >= _ENOUGH:
        return float(_MAD * median_of(sizes, known))
    known = 0
    line = line_of(time, sums, first, after, length)
    for k in range(first, after):
        sizes[known] = abs(value[k] - mean - line[1] - line[2] * (time[k] - time[0] - line[0]))
        known += math.isfinite(sizes[known])
    return float(_MAD * median_of(sizes, known)) if known >= _ENOUGH else math.nan


@kernel("float64(float64, UniTuple(float64, 3))", exact=True)
def _interpolated(since: float, usual: tuple[float, float, float]) -> float:
    """Return the usual deviation this long after the end of a line [s], between those after `_AHEAD`."""
    if since <= _AHEAD[0]:
        return usual[0]
    if since >= _AHEAD[2]:
        return usual[2]
    i = 0 if since < _AHEAD[1] else 1
    slope = (usual[i + 1] - usual[i]) / (_AHEAD[i + 1] - _AHEAD[i])
    return float(slope * (since - _AHEAD[i]) + usual[i])


@kernel(f"float64({READ_ONLY}, int64)", exact=True)
def _step(value: FloatArray, count: int) -> float:
    """Return the smallest step between the first samples, that of a quantised channel; 0 if they do not change."""
    size = 0.0
    for k in range(count):
        size = max(size, abs(value[k]))
    smallest = math.inf
    for k in range(1, count):
        step = abs(value[k] - value[k - 1])
        if step > _SMALLEST * size:
            smallest = min(smallest, step)
    return smallest if smallest < math.inf else 0.0
