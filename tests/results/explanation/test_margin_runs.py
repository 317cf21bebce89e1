"""Runs outside the band: the compiled search finds those of whole arrays."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from cdtool.detectors.detection import Status
from cdtool.results.explanation.margin import find_runs

VALUES = st.sampled_from([1.0, 0.0, -0.0, 1.0 + 1e-15, -1.0, 2.0, -np.inf, np.inf, np.nan])
LIMITS = st.sampled_from([1.0, 1.0, -1.0, np.inf, -np.inf, np.nan])


def _by_whole_arrays(value, lower, upper, status):
    with np.errstate(invalid="ignore"):
        margin = np.where(status == Status.VALID, np.minimum(upper - value, value - lower), np.nan)
    present = np.flatnonzero(status != Status.GAP)
    outside = np.concatenate(([False], margin[present] < 0.0, [False]))
    edges = np.flatnonzero(np.diff(outside.astype(np.int8)))
    first, after = edges[::2], edges[1::2]
    return np.column_stack((present[first], present[after - 1], after - first))


@given(st.lists(st.tuples(VALUES, LIMITS, LIMITS, st.sampled_from([0, 0, 0, 3, 4])), max_size=40))
def test_runs_outside_the_band_are_those_of_whole_arrays(rows):
    value, lower, upper = (np.array([row[i] for row in rows], dtype=np.float64) for i in range(3))
    status = np.array([row[3] for row in rows], dtype=np.uint8)
    expected = _by_whole_arrays(value, lower, upper, status)
    runs = np.full((len(rows) // 2 + 1, 3), -1, dtype=np.int64)
    assert find_runs(value, lower, upper, status, runs) == len(expected)
    np.testing.assert_array_equal(runs[: len(expected)], expected)
