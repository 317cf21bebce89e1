"""The first channel to move: a diagnosis after the event, for people.

Conventions: it uses the recording before and after the event; no detector, no threshold and no latency depends on it.
Times are seconds on the recording's own clock. The load cell and labels are not used.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt
from numpy.lib.stride_tricks import sliding_window_view

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import UsageError, nearest
from cdtool.detectors.detection import WHOLE_MACHINE
from cdtool.recordings.recording import MEASURED, REFERENCES, Recording

IndexArray = npt.NDArray[np.int64]

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

    >>> from cdtool.recordings.recording import Series
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
        start, direction = _found(time, value, begin, before)
    if direction:
        return Movement(channel, joint, float(time[start]), "up" if direction > 0 else "down")
    return Movement(channel, joint, math.nan, reason="too few samples" if start < 0 else "no departure found")


def _found(time: FloatArray, value: FloatArray, begin: float, length: float) -> tuple[int, int]:
    """Return the sample at which a channel moved after `begin` [s], and its direction, 1 or -1; 0 if it did not.

    Then the sample is 0, or -1 if there are too few. `length` [s] is that of a line.
    """
    lines = _Lines(time, value, length)
    first, past = int(np.searchsorted(time, begin - length)), int(np.searchsorted(time, begin, side="right"))
    if len(time) - past < _SUCCESSION:
        return -1, 0
    usual = [_usual(lines, first, past, ahead) for ahead in _AHEAD]
    off = lines.off(np.arange(past, len(time)), np.array([first]), np.array([past]))
    if not np.isfinite(usual).all() or not np.isfinite(off).all():
        return -1, 0
    least = max(_ROUNDING * _step(value[:past]), _SMALLEST * float(np.max(np.abs(value))))
    limit = np.maximum(np.interp(time[past:] - begin, _AHEAD, usual), least)
    lasts = sliding_window_view(np.abs(off) > _MOVED * limit, _SUCCESSION).all(axis=1)
    if not lasts.any():
        return 0, 0
    at = int(lasts.argmax())
    sign = 1 if off[at] > 0.0 else -1
    near = np.flatnonzero(~(sign * off[:at] > _BACK_TO * limit[:at]))
    return past + (int(near[-1]) + 1 if len(near) else 0), sign


class _Lines:
    """Least-squares lines of a `length` [s] through parts of a channel.

    By the sums up to each sample of time, value, time squared, and time by value, from the first sample and about the
    mean, so that they keep their digits at any time and offset.
    """

    def __init__(self, time: FloatArray, value: FloatArray, length: float) -> None:
        self.time, self.length = time, length
        self._t, self._v = time - time[0], value - value.mean()
        terms = np.stack((self._t, self._v, self._t * self._t, self._t * self._v))
        self._sums = np.concatenate((np.zeros((4, 1)), np.cumsum(terms, axis=1)), axis=1)

    def off(self, rows: IndexArray, first: IndexArray, after: IndexArray) -> FloatArray:
        """Return how far samples are from the lines through those from `first` until `after`.

        NaN where these are too few, or cover less than half of the length.
        """
        count = after - first
        long = self.time[after - 1] - self.time[np.minimum(first, len(self.time) - 1)] >= 0.5 * self.length
        with np.errstate(divide="ignore", invalid="ignore"):
            mean_t, mean_v, squares, products = (self._sums[:, after] - self._sums[:, first]) / count
            slope = (products - mean_t * mean_v) / (squares - mean_t * mean_t)
        off = self._v[rows] - mean_v - slope * (self._t[rows] - mean_t)
        return np.where((count >= _ENOUGH) & long, off, np.nan)


def _usual(lines: _Lines, first: int, after: int, ahead: float) -> float:
    """Return the usual deviation of the samples from `first` until `after` from lines that end `ahead` [s] before each.

    A standard deviation. A log that begins shortly before the event has nothing to extrapolate: then it is that from
    the line through these samples; NaN if they are too few for that, too.
    """
    rows = np.arange(first, after)
    ends = lines.time[rows] - ahead
    begins = np.searchsorted(lines.time, ends - lines.length)
    for off in (
        lines.off(rows, begins, np.searchsorted(lines.time, ends, side="right")),
        lines.off(rows, np.array([first]), np.array([after])),
    ):
        known = np.abs(off[np.isfinite(off)])
        if len(known) >= _ENOUGH:
            return _MAD * float(np.median(known))
    return math.nan


def _step(value: FloatArray) -> float:
    """Return the smallest step between samples, that of a quantised channel; 0 if they do not change."""
    steps = np.abs(np.diff(value))
    steps = steps[steps > _SMALLEST * np.max(np.abs(value), initial=0.0)]
    return float(np.min(steps)) if len(steps) else 0.0
