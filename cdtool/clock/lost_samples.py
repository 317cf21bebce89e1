"""Lost samples of channels: missing values, and samples that did not arrive when due."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from cdtool.clock.held_samples import ONE_BY_ONE, READ_MARKS, is_on_clock, search
from cdtool.clock.recent_steps import RECENT_STEPS, usual_steps
from cdtool.kernels import READ_ONLY, kernel
from cdtool.recording import BoolArray, FloatArray, Recording, Series

# A channel is late if its newest sample is older than this many times its longest usual step.
_LATE = 1.5
# A step longer than this many times the median is not a usual one: samples are missing within it.
_USUAL = 2.0
# A channel shares a clock if it has samples at this number of the clock's last 20 samples.
_SHARED_WINDOW, _SHARED_SAMPLES = 20, 15


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
    if is_on_clock(series, clock):
        return missing
    lost = np.empty((len(clock), series.joint_count), dtype=np.bool_)
    _fill_lost(series.time, usual_steps(series.time), missing, np.ascontiguousarray(clock), lost)
    return lost


@kernel(f"float64({READ_ONLY}, int64)")
def _longest_recent_step(time: FloatArray, at: int) -> float:
    """Return the longest of the last 9 steps up to sample `at`, which is not the first."""
    longest = 0.0
    for k in range(max(at - RECENT_STEPS + 1, 1), at + 1):
        longest = max(longest, time[k] - time[k - 1])
    return longest


@kernel(f"void({READ_ONLY}, {READ_ONLY}, {READ_MARKS}, {READ_ONLY}, b1[:, ::1])")
def _fill_lost(time: FloatArray, usual: FloatArray, missing: BoolArray, clock: FloatArray, lost: BoolArray) -> None:
    """Fill `lost` (m, J); `usual` (n,): the median step up to each sample, `missing` (n, J): which have no value.

    The longest usual step is the longest recent one, at most twice the median: never less than the median itself, so
    that it is determined only for a sample older than 1.5 times that.
    """
    at = -1
    # One bit for each of the last 20 times of the clock: whether the channel has a sample there.
    shared = 0
    count = 0
    for k in range(len(clock)):
        now = clock[k]
        if at >= 0 and now < time[at]:
            at = search(time, now, -1, at)
        passed = 0
        while at + 1 < len(time) and time[at + 1] <= now:
            at += 1
            passed += 1
            if passed == ONE_BY_ONE:
                at = search(time, now, at, len(time))
        age = now - time[max(at, 0)]
        late = count >= _SHARED_SAMPLES and age > 0.0
        if at > 0 and not late and age > _LATE * usual[at]:
            late = age > _LATE * min(_longest_recent_step(time, at), _USUAL * usual[at])
        for j in range(missing.shape[1]):
            lost[k, j] = at >= 0 and (late or missing[at, j])
        now_shared = 1 if age == 0.0 else 0
        count += now_shared - ((shared >> (_SHARED_WINDOW - 1)) & 1)
        shared = ((shared << 1) | now_shared) & ((1 << _SHARED_WINDOW) - 1)
