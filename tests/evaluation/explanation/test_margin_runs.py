"""Runs outside the band: the compiled count finds those of whole arrays."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from cdtool.detection import Status
from cdtool.evaluation.explanation.margin import count_runs

MARGINS = st.sampled_from([1.0, 0.0, -0.0, -1e-300, -1.0, -np.inf, np.nan])


def _by_whole_arrays(margin, status):
    present = np.flatnonzero(status != Status.GAP)
    outside = np.concatenate(([False], margin[present] < 0.0, [False]))
    edges = np.flatnonzero(np.diff(outside.astype(np.int8)))
    first, after = edges[::2], edges[1::2]
    return np.column_stack((present[first], present[after - 1], after - first))


@given(st.lists(st.tuples(MARGINS, st.sampled_from([0, 0, 3, 3, 4])), max_size=40))
def test_runs_outside_the_band_are_those_of_whole_arrays(rows):
    margin = np.array([row[0] for row in rows], dtype=np.float64)
    status = np.array([row[1] for row in rows], dtype=np.uint8)
    expected = _by_whole_arrays(margin, status)
    runs = np.full((len(rows), 3), -1, dtype=np.int64)
    assert count_runs(margin, status, runs) == len(expected)
    np.testing.assert_array_equal(runs[: len(expected)], expected)
    assert count_runs(margin, status, np.empty((0, 3), dtype=np.int64)) == len(expected)
