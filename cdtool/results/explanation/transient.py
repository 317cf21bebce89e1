"""Transients within a few samples: pulses and ringing of one channel, and lost samples.

A diagnosis after the event: a channel is compared with its own centred running median.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.recordings.recording import Recording, Series

# The running median spans this time in total [s], and at least this many samples: an event shorter than half of it is a
# pulse.
_MEDIAN_SECONDS, _MEDIAN_SAMPLES = 0.07, 7
# A pulse deviates by this many of the channel's own noises from its running median; an accelerometer's noise varies.
_PULSE_OUT, _KNOCK_OUT = 6.5, 8.0
# Samples outside less than this apart are one transient [s].
_TOGETHER = 0.02
# 95 % of Gaussian noise is within this many of its standard deviations.
_TWO_SIDED = 1.96
_ROUNDING = 1.0 / np.sqrt(12.0)
# The share of a pulse's area that the position must show for the axis to have moved.
_SHARE = 0.5


@dataclass(frozen=True)
class Transient:
    """A channel of a joint that left its own running median from `start` to `end` [s], by at most `height` [unit].

    `noises`: that height over the channel's own noise. `area` [unit s] is the integral of the deviation. `rings`: it
    deviated in both directions.
    """

    channel: str
    joint: str
    unit: str
    start: float
    end: float
    height: float
    noises: float
    area: float
    rings: bool


@dataclass(frozen=True)
class MissingSamples:
    """Missing samples of a channel from `start` to `end` [s]; `samples`: about how many."""

    channel: str
    start: float
    end: float
    samples: int


def transients(
    series: Series, channel: str, joint: str, column: int, begin: float, end: float, least: float = 0.0
) -> list[Transient]:
    """Return the transients of a channel that begin from `begin` to `end` [s], the highest first.

    `least` [unit]: lower bound of its noise.
    """
    around = series.between(begin - 1.0, end + _MEDIAN_SECONDS)
    values = around.values[:, column]
    present = np.isfinite(values)
    time, values = around.time[present], values[present]
    if len(time) < 3 * _MEDIAN_SAMPLES:
        return []
    off = values - running_median(time, values)
    # A monotonous section equals its running median, so its deviation is no evidence.
    before = np.abs(off[time < begin])
    noise = max(
        float(np.percentile(before if len(before) else np.abs(off), 95.0)) / _TWO_SIDED, _ROUNDING * _step(values)
    )
    noise = max(noise, least)
    if not noise > 0.0:
        noise = 1e-9 * max(float(np.abs(values).max()), 1e-300)
    limit = _KNOCK_OUT if channel == "acceleration" else _PULSE_OUT
    outside = np.flatnonzero(np.abs(off) > limit * noise)
    found = []
    groups = np.split(outside, np.flatnonzero(np.diff(time[outside]) > _TOGETHER) + 1) if len(outside) else []
    for group in groups:
        # From where it rises out of the noise to where it falls back into it.
        first, last = int(group[0]), int(group[-1])
        while first > 0 and abs(off[first - 1]) > 3.0 * noise and off[first - 1] * off[first] > 0.0:
            first -= 1
        while last < len(off) - 1 and abs(off[last + 1]) > 3.0 * noise:
            last += 1
        part = off[first : last + 1]
        height = float(part[int(np.argmax(np.abs(part)))])
        if not begin <= time[first] <= end:
            continue
        rings = bool((part < -0.3 * abs(height)).any() and (part > 0.3 * abs(height)).any())
        steps = (
            np.diff(time[first : last + 2], append=time[last])
            if last + 1 >= len(time)
            else np.diff(time[first : last + 2])
        )
        area = float(np.sum(part * steps[: len(part)]))
        found.append(
            Transient(
                channel,
                joint,
                series.unit,
                float(time[first]),
                float(time[last]),
                height,
                abs(height) / noise,
                area,
                rings,
            )
        )
    return sorted(found, key=lambda item: -item.noises)


def shown_by_position(pulse: Transient, position: Series, column: int) -> bool:
    """Whether the position moved as a pulse of the speed indicates: then the axis moved, and the sensor is right."""
    length = max(0.02, pulse.end - pulse.start)
    before = position.between(pulse.start - 3.0 * length, pulse.start)
    after = position.between(pulse.end, pulse.end + 3.0 * length)
    parts = [(part.time, part.values[:, column]) for part in (before, after)]
    if any(len(time) < 3 or not np.isfinite(value).all() for time, value in parts):
        return False
    middle = 0.5 * (pulse.start + pulse.end)
    ends = [np.polyval(np.polyfit(time - middle, value, 1), 0.0) for time, value in parts]
    return bool(abs((ends[1] - ends[0]) - pulse.area) < _SHARE * abs(pulse.area))


def losses(recording: Recording, channels: tuple[str, ...], begin: float, end: float) -> list[MissingSamples]:
    """Return samples missing from `begin` to `end` [s], the longest first: a gap in the clock, or no value."""
    found = []
    for channel in channels:
        if channel not in recording:
            continue
        series = recording[channel]
        if len(series) < _MEDIAN_SAMPLES:
            continue
        present = np.isfinite(series.values).all(axis=1)
        time = series.time[present]
        steps = np.diff(time)
        if not len(steps):
            continue
        usual = max(1.7 * series.period, 1.2 * float(np.percentile(steps, 99.0)))
        for k in np.flatnonzero(steps > usual):
            if begin <= time[k + 1] and time[k] <= end:
                missing = max(round(float(steps[k]) / series.period) - 1, 1)
                found.append(MissingSamples(channel, float(time[k]), float(time[k + 1]), missing))
    return sorted(found, key=lambda item: item.start - item.end)


def running_median(time: FloatArray, values: FloatArray) -> FloatArray:
    """Return the median of the neighbours within `_MEDIAN_SECONDS`, half of it to either side."""
    period = float(np.median(np.diff(time)))
    reach = max(_MEDIAN_SAMPLES // 2, round(0.5 * _MEDIAN_SECONDS / period))
    padded = np.pad(values, reach, mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + 1)
    median: FloatArray = np.median(windows, axis=1)
    return median


def _step(values: FloatArray) -> float:
    """Return the smallest step of a quantised channel; 0 for one that does not change."""
    steps = np.abs(np.diff(values))
    steps = steps[steps > 1e-9 * np.abs(values).max(initial=0.0)]
    return float(steps.min()) if len(steps) else 0.0
