"""The level of a channel: the bits of the mean by whole arrays."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from cdtool.thresholds.normal_motion import LEVEL_SECONDS, levels

VALUES = st.sampled_from([0.0, 1.0, -2.5, 1e3, 0.1, 1e-9, np.nan, np.nan, np.inf])


def _by_whole_arrays(time, values):
    usual = min(LEVEL_SECONDS / float(np.median(np.diff(time))), float(len(time)))
    first = np.searchsorted(time, time - LEVEL_SECONDS, side="right")
    here = np.arange(len(time)) + 1
    present = np.isfinite(values)
    counts = np.vstack((np.zeros((1, values.shape[1])), np.cumsum(present, axis=0)))
    about = np.nanmedian(values, axis=0) if present.any(axis=0).all() else np.zeros(values.shape[1])
    sums = np.vstack((np.zeros((1, values.shape[1])), np.cumsum(np.where(present, values - about, 0.0), axis=0)))
    count, total = counts[here] - counts[first], sums[here] - sums[first]
    enough = count >= max(0.8 * usual, 1.0)
    return np.divide(total, count, out=np.full(values.shape, np.nan), where=enough) + about


@given(st.data(), st.integers(2, 120), st.integers(1, 3), st.sampled_from([1e-3, 0.0123, 0.05, 0.2]))
def test_levels_are_the_bits_of_sums_over_whole_arrays(data, count, joints, period):
    steps = data.draw(st.lists(st.sampled_from([0.5, 1.0, 1.0, 1.3, 7.0]), min_size=count, max_size=count))
    time = period * np.cumsum(np.array(steps))
    flat = data.draw(st.lists(VALUES, min_size=count * joints, max_size=count * joints))
    values = np.array(flat).reshape(count, joints)
    with np.errstate(invalid="ignore"):
        expected = _by_whole_arrays(time, values)
        np.testing.assert_array_equal(levels(time, values), expected)


def test_a_single_sample_is_its_own_level():
    assert levels(np.zeros(1), np.full((1, 2), 3.0)).tolist() == [[3.0, 3.0]]
