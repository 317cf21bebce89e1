"""Where channels have lost samples: missing values, and samples that have not come when they were due."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from cdtool.clock.coarse_clock import RECENT_STEPS, recent_medians
from cdtool.recording import BoolArray, FloatArray, Recording, Series

# A channel is late where its newest sample is older than this many of its longest usual steps.
_LATE = 1.5
# A step longer than this many medians is no usual one: it holds lost samples itself.
_USUAL = 2.0
# A channel shares its clock where so many of the clock's last samples were its own, too.
_SHARED_WINDOW, _SHARED_SHARE = 20, 0.75


def lost_samples(recording: Recording, channels: Iterable[str], clock: FloatArray) -> BoolArray | None:
    """Return where on `clock` (n,) [s] a sample of one of `channels` was lost: (n, J), or None where none was.

    A sample is lost where the channel's newest value is NaN, where a channel that shares the clock has no sample of
    its own, and where a channel with a clock of its own is late: its newest sample is older than 1.5 of the longest of
    its last 9 steps. Before its first sample a channel has lost nothing. Causal: a later sample changes nothing.
    """
    lost: BoolArray | None = None
    for name in channels:
        if name in recording and len(recording[name]):
            of_channel = _lost(recording[name], clock)
            if of_channel.any():
                lost = of_channel if lost is None else lost | of_channel
    return lost


def _lost(series: Series, clock: FloatArray) -> BoolArray:
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
    """At each sample (n,) the longest of its last 9 steps [s] that hold no lost sample; infinite at the first."""
    longest = np.full(len(time), np.inf)
    if len(time) > 1:
        steps = np.diff(time)
        padded = np.concatenate((np.full(RECENT_STEPS - 1, steps[0]), steps))
        recent = np.lib.stride_tricks.sliding_window_view(padded, RECENT_STEPS).max(axis=1)
        longest[1:] = np.minimum(recent, _USUAL * recent_medians(steps, float(steps[0])))
    return longest


def _shares_clock(age: FloatArray) -> BoolArray:
    """Whether most of the samples of the clock before each one (n,) were the channel's own."""
    own = np.concatenate(([0.0], np.cumsum(age == 0.0)))
    index = np.arange(len(age))
    before = own[index] - own[np.maximum(index - _SHARED_WINDOW, 0)]
    shares: BoolArray = before >= _SHARED_SHARE * _SHARED_WINDOW
    return shares
