"""Lost samples of channels: missing values, and samples that did not arrive when due."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.recordings.clock.held_samples import is_on_clock
from cdtool.recordings.clock.recent_steps import RECENT_STEPS, usual_steps
from cdtool.recordings.recording import Recording, Series

# A channel shares a clock if it has samples at 15 of the clock's last 20 samples.
_SHARED_WINDOW = 20


def lost_samples(recording: Recording, channels: Iterable[str], clock: FloatArray) -> BoolArray | None:
    """Return at which times of `clock` (n,) [s] a sample of one of `channels` is lost (n, J); None if no sample is.

    A sample is lost if the channel's newest value is NaN, if a channel that shares the clock has no sample at that
    time, or if a channel with its own clock is late: its newest sample is older than 1.5 times the longest of its last
    9 steps, each counted as at most twice their median. A channel shares the clock if it has samples at 15 of its last
    20 times. Before the first sample of a channel, none is lost. The result is causal.
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
    if is_on_clock(series, clock):
        return missing
    time, usual = series.time, usual_steps(series.time)
    if not len(time):
        return np.zeros((len(clock), series.joint_count), dtype=bool)
    at = np.searchsorted(time, clock, side="right") - 1
    age = clock - time[np.maximum(at, 0)]
    # How many of the last 20 times before each one have a sample.
    shared = np.concatenate((np.zeros(_SHARED_WINDOW + 1), np.cumsum(age == 0.0)))
    due = (shared[_SHARED_WINDOW:-1] - shared[: -_SHARED_WINDOW - 1] >= 15) & (age > 0.0)
    longest = _longest_recent_steps(time)
    # A channel is late if its newest sample is older than 1.5 times its longest usual step. A step longer than twice
    # the median is not a usual one: samples are missing within it.
    late = due | ((at > 0) & (age > 1.5 * np.minimum(longest, 2.0 * usual)[at]))
    return np.asarray((at >= 0)[:, np.newaxis] & (late[:, np.newaxis] | missing[at]))


def _longest_recent_steps(time: FloatArray) -> FloatArray:
    """Return the longest of the last 9 steps up to each sample (n,); 0 at the first."""
    steps = np.concatenate((np.zeros(RECENT_STEPS), np.diff(time)))
    longest: FloatArray = sliding_window_view(steps, RECENT_STEPS).max(axis=1)
    return longest
