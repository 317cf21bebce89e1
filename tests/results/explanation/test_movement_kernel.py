"""The compiled search for a movement finds what numpy finds with lines from sums over whole arrays."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdtool.results.explanation.movement import _found

AHEAD = (0.05, 0.1, 0.2)


def _off_line(time, value, ends, length):
    """Return each sample's distance from the line through the `length` seconds up to its entry of `ends`."""
    t, v = time - time[0], value - value.mean()
    first, after = np.searchsorted(time, ends - length), np.searchsorted(time, ends, side="right")
    count = (after - first).astype(np.float64)

    def total(terms):
        sums = np.concatenate(([0.0], np.cumsum(terms)))
        return sums[after] - sums[first]

    held = time[np.maximum(after, 1) - 1] - time[np.minimum(first, len(time) - 1)]
    enough = (count >= 10) & (held >= 0.5 * length)
    count = np.maximum(count, 1.0)
    mean_t, mean_v = total(t) / count, total(v) / count
    variance, covariance = total(t * t) / count - mean_t**2, total(t * v) / count - mean_t * mean_v
    slope = np.divide(covariance, variance, out=np.zeros(len(t)), where=enough)
    return np.where(enough, v - mean_v - slope * (t - mean_t), np.nan)


def _usual(tried, residuals):
    for off in (tried, residuals):
        known = off[np.isfinite(off)]
        if len(known) >= 10:
            return 1.4826 * float(np.median(np.abs(known)))
    return math.nan


def _step(value):
    steps = np.abs(np.diff(value))
    steps = steps[steps > 1e-9 * np.abs(value).max(initial=0.0)]
    return float(steps.min()) if len(steps) else 0.0


def _by_whole_arrays(time, value, begin, before):
    off = _off_line(time, value, np.full(len(time), begin), before)
    quiet = (time >= begin - before) & (time <= begin)
    usual = [_usual(_off_line(time, value, time - ahead, before)[quiet], off[quiet]) for ahead in AHEAD]
    later = np.flatnonzero(time > begin)
    if len(later) < 3 or not np.isfinite([*usual, *off[later]]).all():
        return -1, 0
    least = max(_step(value[time <= begin]) / math.sqrt(12.0), 1e-9 * float(np.abs(value).max()))
    noise, off = np.maximum(np.interp(time[later] - begin, AHEAD, usual), least), off[later]
    run = np.lib.stride_tricks.sliding_window_view(np.abs(off) > 6.0 * noise, 3).all(axis=1)
    if not run.any():
        return 0, 0
    first = int(np.argmax(run))
    upward = bool(off[first] > 0.0)
    calm = np.flatnonzero((off if upward else -off)[:first] <= 2.0 * noise[:first])
    return int(later[int(calm[-1]) + 1 if len(calm) else 0]), 1 if upward else -1


SHAPES = {
    "noise": lambda random, time: random.standard_normal(len(time)),
    "quantised": lambda random, time: np.round(3.0 * random.standard_normal(len(time))),
    "constant": lambda _, time: np.zeros(len(time)),
    "constant of either sign": lambda random, time: np.where(random.random(len(time)) < 0.5, 0.0, -0.0),
    "slow": lambda random, time: 10.0 * np.sin(7.0 * time) + 0.01 * random.standard_normal(len(time)),
    "line": lambda random, time: 1e6 + 3.0 * time + 1e-3 * random.standard_normal(len(time)),
}


@pytest.mark.filterwarnings("ignore:(divide by zero|invalid value)")
@given(
    st.integers(0, 2**32 - 1),
    st.integers(1, 700),
    st.sampled_from(sorted(SHAPES)),
    st.sampled_from([0.0, 3.0, 1e5]),
    st.sampled_from([0.5, 0.1, 0.02]),
    st.booleans(),
)
def test_a_movement_is_the_bits_of_lines_from_whole_arrays(seed, count, shape, origin, length, has_step):
    random = np.random.default_rng(seed)
    time = origin + np.cumsum(random.choice([1e-3, 1.3e-3, 5e-3, 0.05], count, p=[0.8, 0.15, 0.045, 0.005]))
    value = SHAPES[shape](random, time)
    if has_step:
        value[random.integers(count) :] += 20.0 * random.standard_normal()
    begin = float(time[random.integers(count)])
    found = _found(time, value, begin, length)
    assert found == _by_whole_arrays(time, value, begin, length)
