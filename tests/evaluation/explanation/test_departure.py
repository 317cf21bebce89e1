"""The compiled loops of a departure find what numpy finds with windows and least squares."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from cdtool.evaluation.explanation.departure import first_beyond, median_of_known, steepest_bend

VALUES = st.sampled_from([0.0, 0.5, 1.0, 1.0 + 1e-15, 1.5, -1.0, -2.0, np.inf, -np.inf, np.nan])


@given(st.lists(VALUES, max_size=30), st.sampled_from([1.0, -1.0]), st.integers(1, 4))
def test_the_first_of_consecutive_samples_outside_is_that_of_a_sliding_window(values, sign, succession):
    samples = np.array(values, dtype=np.float64)
    expected = -1
    if len(samples) >= succession:
        run = np.lib.stride_tricks.sliding_window_view(sign * samples > 1.0, succession).all(axis=1)
        expected = int(np.argmax(run)) if run.any() else -1
    assert first_beyond(samples, sign, succession) == expected


def _fitted(time, values, bend):
    design = np.column_stack((np.ones(len(time)), time, np.maximum(time - bend, 0.0)))
    fitted, *_ = np.linalg.lstsq(design, values, rcond=None)
    return float(fitted[2]), float(np.sum((values - design @ fitted) ** 2))


@given(
    st.integers(0, 2**32 - 1),
    st.integers(3, 300),
    st.integers(0, 60),
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
    found = steepest_bend(time, values, -1, time[candidates], candidates)
    size = float(np.sum((values - values.mean()) ** 2)) + 1e-12
    # A slope that is zero but for rounding may be found or not.
    upward = [(error, k) for (more, error), k in zip(fits, candidates, strict=True) if more > 0.0]
    surely = [(error, k) for (more, error), k in zip(fits, candidates, strict=True) if more > 1e-6]
    if found < 0:
        assert not surely
        return
    error = dict(zip(candidates.tolist(), fits, strict=True))[found][1]
    assert error <= min(upward, default=(np.inf, 0))[0] + 1e-11 * size


@given(st.lists(VALUES, max_size=40), st.integers(1, 12))
def test_the_median_of_known_values_is_numpys(values, least):
    samples = np.array(values, dtype=np.float64)
    known = samples[np.isfinite(samples)]
    expected = np.median(known) if len(known) >= least else np.nan
    np.testing.assert_array_equal(median_of_known(samples, np.empty(len(samples)), least), expected)
