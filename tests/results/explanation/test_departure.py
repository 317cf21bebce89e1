"""The compiled loops of a departure find what numpy finds with windows and least squares."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from cdtool.results.explanation.departure import Departure, Limits, _steepest_bend, find_departure


def _first_beyond(values, sign):
    outside = sign * values > 1.0
    if len(values) < 3:
        return -1
    runs = np.lib.stride_tricks.sliding_window_view(outside, 3).all(axis=1)
    return int(np.argmax(runs)) if runs.any() else -1


def _by_windows(raw, level, running, limits, shift, own, own_level):
    """Return what is found with shares of the limits and sliding windows over whole arrays."""
    raw = raw - shift
    samples, level = raw - own, level - own_level
    out, level_out = (np.where(running, limits[i + 1], limits[i]) for i in (0, 2))
    if np.count_nonzero(np.isfinite(samples)) < 3:
        return Departure.UNKNOWN, -1, -1
    both = ((samples / out, Departure.SAMPLES_DOWN), (level / level_out, Departure.LEVEL_DOWN))
    found = [
        (_first_beyond(shares, sign), down + (2 if sign > 0.0 else 0))
        for shares, down in both
        for sign in (1.0, -1.0)
        if _first_beyond(shares, sign) >= 0
    ]
    if not found:
        first = _first_beyond(np.where(np.abs(raw) > out, 2.0, 0.0), 1.0)
        if first >= 0:
            return Departure.BEFORE, first, -1
        return Departure.NONE, -1, int(np.nanargmax(np.abs(raw)))
    k, what = min(found)
    known = np.where(np.isfinite(samples), (1.0 if what >= Departure.SAMPLES_UP else -1.0) * samples, -np.inf)
    return what, k, k + int(np.argmax(known[k:]))


SHARES = [0.0, 0.4, 0.4 + 1e-15, 0.9, 0.9, 0.9, 1.5, -2.0, np.inf, np.nan]
DISTANCES = st.sampled_from([0.0, -0.0, 4.0, 5.0, 5.0 + 1e-15, 5.1, 6.0, 9.0, -5.0, -6.0, -9.0, np.nan])


@given(
    st.lists(st.tuples(DISTANCES, DISTANCES, st.booleans()), max_size=25),
    st.tuples(*[st.sampled_from([5.0, 7.5, 5.0 + 1e-15])] * 4),
    st.tuples(*[st.sampled_from([0.0, 1.0, -2.5, np.nan])] * 3),
    st.integers(0, 4),
    st.integers(0, 4),
)
def test_a_departure_is_that_of_sliding_windows_over_the_shares(rows, limits, offsets, before, after):
    raw, level, running = (np.array([row[i] for row in rows]) for i in range(3))
    raw, level, running = raw.astype(float), level.astype(float), running.astype(bool)
    part = slice(min(before, len(rows)), max(len(rows) - after, min(before, len(rows))))
    expected = _by_windows(raw[part], level[part], running[part], limits, *offsets)
    found = find_departure(raw, level, running, Limits(*limits), *offsets, part.start, part.stop, 3)
    assert found == (expected[0], *(k + part.start if k >= 0 else -1 for k in expected[1:]))


def _fitted(time, values, bend):
    design = np.column_stack((np.ones(len(time)), time, np.maximum(time - bend, 0.0)))
    fitted, *_ = np.linalg.lstsq(design, values, rcond=None)
    return float(fitted[2]), float(np.sum((values - design @ fitted) ** 2))


@given(
    st.integers(0, 2**32 - 1),
    st.integers(3, 300),
    st.integers(1, 60),
    st.sampled_from([0.0, 1e-9, 0.05, 1.0]),
    st.data(),
)
def test_the_bend_is_that_of_the_smallest_error_by_lstsq(seed, count, bends, noise, data):
    random = np.random.default_rng(seed)
    time = np.cumsum(random.uniform(0.5e-3, 1.5e-3, count)) - 1e-3 * data.draw(st.integers(0, 3))
    at, before, after = random.uniform(time[0], time[-1]), random.uniform(-20, 20), random.uniform(-50, 50)
    values = 3.0 + before * time + after * np.maximum(time - at, 0.0) + noise * random.standard_normal(count)
    candidates = np.unique(random.integers(0, count, bends))
    fits = [_fitted(time, values, time[k]) for k in candidates]
    bend = _steepest_bend(time, values, time[candidates])
    size = float(np.sum((values - values.mean()) ** 2)) + 1e-12
    # A slope that is zero but for rounding may be found or not.
    upward = [(error, k) for (more, error), k in zip(fits, candidates, strict=True) if more > 0.0]
    surely = [(error, k) for (more, error), k in zip(fits, candidates, strict=True) if more > 1e-6]
    if bend is None:
        assert not surely
        return
    error = fits[bend][1]
    assert error <= min(upward, default=(np.inf, 0))[0] + 1e-11 * size
