"""Glitches of sensors before an event: a spike, missing samples, a value that stands still.

Only what the samples show: whether the glitch raised the alarm is not assessed.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.recordings.recording import REFERENCES, Recording, Series
from cdtool.results.explanation.departure import COMMANDS, Departure, quantisation

#: A spike is shorter than half of this [s], the window of the median it is compared with.
MEDIAN_SECONDS = 0.07
#: That window has at least this many samples.
MEDIAN_SAMPLES = 7
#: A spike is this many of the channel's own noises off.
SPIKE = 6.5
#: Samples off within this time are one spike [s].
TOGETHER = 0.02
#: The time before that shows a channel's own noise [s].
NOISE_SECONDS = 1.0
#: 95 % of Gaussian noise is within this many of its standard deviations.
TWO_SIDED = 1.96
#: Equal samples over this time are a frozen value [s], if there are `FROZEN` times as many as before.
FROZEN_SECONDS = 0.02
#: See `FROZEN_SECONDS`: a quantised channel repeats values.
FROZEN = 3
#: Samples are missing where a step is this many periods, and longer than nearly all steps of a jittering clock.
MISSING = 1.7


@dataclass(frozen=True)
class Glitch:
    """A glitch of a channel from `start` to `end` [s], over `samples` samples: a "spike", "dropout" or "frozen" value.

    A spike is off by at most `size`, and a frozen value is `size`, in `unit`. Dropouts concern every joint (`joint` is
    empty): about `samples` are missing, and `size` is NaN.
    """

    kind: str
    channel: str
    joint: str
    unit: str
    start: float
    end: float
    samples: int
    size: float


def glitches(
    recording: Recording, channels: Sequence[str], departed: Sequence[Departure], begin: float, end: float
) -> tuple[Glitch, ...]:
    """Return the glitches of some channels that began from `begin` to `end` [s], in order of time.

    Spikes and frozen values only of a sensor that no other one confirms: none of those in `departed` left its normal
    band. A contact shows in several.
    """
    moved = {(item.channel, item.joint) for item in departed if item.time == item.time and item.channel not in COMMANDS}
    found: list[Glitch] = []
    for channel in channels:
        if channel not in recording or channel in REFERENCES:
            continue
        series = recording[channel].between(begin - NOISE_SECONDS, end + MEDIAN_SECONDS)
        found += _dropouts(recording[channel], channel, begin, end)
        for j, joint in enumerate(recording.joints):
            known = np.isfinite(series.values[:, j])
            time, value = series.time[known], series.values[known, j]
            if len(time) < 3 * MEDIAN_SAMPLES or moved - {(channel, joint)}:
                continue
            for kind, first, last, size in (*_spikes(time, value), *_frozen(time, value, begin)):
                if begin <= time[first] <= end:
                    times = float(time[first]), float(time[last])
                    found.append(Glitch(kind, channel, joint, series.unit, *times, last - first + 1, size))
    return tuple(sorted(found, key=lambda item: item.start))


def _spikes(time: FloatArray, value: FloatArray) -> Iterator[tuple[str, int, int, float]]:
    """Yield the first and last sample of each spike, and by how much it is off the median of its neighbours."""
    reach = max(MEDIAN_SAMPLES // 2, round(0.5 * MEDIAN_SECONDS / float(np.median(np.diff(time)))))
    neighbours = np.lib.stride_tricks.sliding_window_view(np.pad(value, reach, mode="edge"), 2 * reach + 1)
    off = value - np.median(neighbours, axis=1)
    noise = max(float(np.percentile(np.abs(off), 95.0)) / TWO_SIDED, quantisation(value))
    outside = np.flatnonzero(np.abs(off) > SPIKE * noise)
    for group in np.split(outside, np.flatnonzero(np.diff(time[outside]) > TOGETHER) + 1):
        if len(group) and time[group[-1]] - time[group[0]] < MEDIAN_SECONDS:
            yield "spike", int(group[0]), int(group[-1]), float(max(off[group], key=abs))


def _frozen(time: FloatArray, value: FloatArray, begin: float) -> Iterator[tuple[str, int, int, float]]:
    """Yield the first and last sample of equal values, if there are far more of them than before."""
    edges = np.flatnonzero(np.concatenate(([True], np.diff(value) != 0.0, [True])))
    counts = np.diff(edges)
    usual = int(counts[time[edges[:-1]] < begin].max(initial=1))
    for first, count in zip(edges[:-1].tolist(), counts.tolist(), strict=True):
        is_long = count > FROZEN * usual and time[first + count - 1] - time[first] >= FROZEN_SECONDS
        if is_long and value[first] != 0.0:  # 0: an axis at rest
            yield "frozen", first, first + count - 1, float(value[first])


def _dropouts(series: Series, channel: str, begin: float, end: float) -> Iterator[Glitch]:
    """Yield gaps of the clock, and samples without a value."""
    time = series.time[np.isfinite(series.values).all(axis=1)]
    steps = np.diff(time)
    long = np.flatnonzero((steps > MISSING * series.period) & (time[1:] >= begin) & (time[:-1] <= end))
    if len(steps) < MEDIAN_SAMPLES or not len(long):
        return
    for k in long[steps[long] > 1.2 * float(np.percentile(steps, 99.0))]:
        missing = max(round(float(steps[k]) / series.period) - 1, 1)
        yield Glitch("dropout", channel, "", series.unit, float(time[k]), float(time[k + 1]), missing, np.nan)
