"""Lost samples of channels: missing values, and samples that did not arrive when due."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from cdtool.clock.coarse_clock import RECENT_STEPS, recent_medians
from cdtool.recording import BoolArray, FloatArray, Recording, Series

# A channel is late if its newest sample is older than this many times its longest usual step.
_LATE = 1.5
# A step longer than this many times the median is not a usual one: samples are missing within it.
_USUAL = 2.0
# A channel shares a clock if it has samples at this share of the clock's last 20 samples.
_SHARED_WINDOW, _SHARED_SHARE = 20, 0.75


def lost_samples(recording: Recording, channels: Iterable[str], clock: FloatArray) -> BoolArray | None:
    """Return at which times of `clock` (n,) [s] a sample of one of `channels` is lost (n, J); None if no sample is.

    A sample is lost if the channel's newest value is NaN, if a channel that shares the clock has no sample at that
    time, or if a channel with its own clock is late: its newest sample is older than 1.5 times the longest of its last
    9 steps. Before the first sample of a channel, none is lost. The result is causal.
    """
    lost: BoolArray | None = None
    own = recording.own_clock(clock)
    for name in channels:
        if name in recording and len(recording[name]):
            of_channel = _lost_once(recording[name], clock, own)
            if of_channel is not None:
                lost = of_channel if lost is None else lost | of_channel
    return lost


def _lost_once(series: Series, clock: FloatArray, own: FloatArray | None) -> BoolArray | None:
    """Return where a channel lost samples, None without any; computed once on the recording's `own` clock."""

    def compute() -> BoolArray | None:
        lost = _lost_in_channel(series, clock)
        return lost if lost.any() else None

    return compute() if own is None else series.derived("lost samples", compute, own)


def _lost_in_channel(series: Series, clock: FloatArray) -> BoolArray:
    missing: BoolArray = ~np.isfinite(series.values)
    if len(series.time) == len(clock) and np.array_equal(series.time, clock):
        return missing
    at = np.searchsorted(series.time, clock, side="right") - 1
    newest = np.maximum(at, 0)
    age = clock - series.time[newest]
    late = (age > _LATE * _longest_usual_step(series.time)[newest]) | (_shares_clock(age) & (age > 0.0))
    lost: BoolArray = (missing[newest] | late[:, np.newaxis]) & (at >= 0)[:, np.newaxis]
    return lost


def _longest_usual_step(time: FloatArray) -> FloatArray:
    """Return, at each sample, the longest usual step [s] of the last 9; infinite at the first sample."""
    longest = np.full(len(time), np.inf)
    if len(time) > 1:
        steps = np.diff(time)
        padded = np.concatenate((np.full(RECENT_STEPS - 1, steps[0]), steps))
        recent = np.lib.stride_tricks.sliding_window_view(padded, RECENT_STEPS).max(axis=1)
        longest[1:] = np.minimum(recent, _USUAL * recent_medians(steps, float(steps[0])))
    return longest


def _shares_clock(age: FloatArray) -> BoolArray:
    """Return where most of the preceding times of the clock were samples of the channel (n,)."""
    own = np.concatenate(([0.0], np.cumsum(age == 0.0)))
    index = np.arange(len(age))
    before = own[index] - own[np.maximum(index - _SHARED_WINDOW, 0)]
    shares: BoolArray = before >= _SHARED_SHARE * _SHARED_WINDOW
    return shares
