"""A run on the grid of a signature's curve: that of whole arrays."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from cdtool.detectors.detection import Signal
from cdtool.recordings.motion.progress import Progress
from cdtool.thresholds.signature_curve import Curve, resample


def _resampled(values, use, axis, grid, step):
    """Return the first sample that passes each grid point, found with whole arrays."""
    result = np.full(len(grid), np.nan)
    if not use.any():
        return result
    along = axis[use]
    passing = np.concatenate(([True], along[1:] > np.maximum.accumulate(along)[:-1]))
    along, samples = along[passing], values[use][passing]
    at = np.searchsorted(along, grid, side="left")
    usual = float(np.median(np.diff(along))) if len(along) > 1 else 0.0
    reached = np.flatnonzero(at < len(along))
    near = reached[along[at[reached]] - grid[reached] <= 2.0 * max(step, usual)]
    result[near] = samples[at[near]]
    return result


ALONG = st.one_of(st.sampled_from([0.0, -0.0, 0.1, 0.2, 0.2, 0.3, 0.75, np.nan]), st.floats(-0.1, 1.0))


@given(st.lists(st.tuples(ALONG, st.sampled_from([0.5, np.nan, *([0.1] * 4)]), st.integers(0, 4)), max_size=40))
def test_a_run_on_the_grid_is_that_of_whole_arrays(rows):
    axis, elapsed = np.array([row[0] for row in rows], dtype=float), np.array([row[1] for row in rows], dtype=float)
    status = np.array([[int(row[2] == 4), int(row[2] > 2)] for row in rows], dtype=np.uint8).reshape(-1, 2)
    values = np.random.default_rng(len(rows)).standard_normal((len(rows), 2))
    curve = Curve.empty(0.1, 0.1, 0.8, 2)
    where = Progress(elapsed, axis, np.zeros(len(rows), dtype=bool))
    found = resample(Signal(np.arange(len(rows)) * 1.0, values, status, ""), where, curve, axis)
    use = np.isfinite(elapsed) & np.isfinite(axis)
    for j in range(2):
        expected = _resampled(values[:, j], use & (status[:, j] == 0), axis, curve.grid, 0.1)
        np.testing.assert_array_equal(found[:, j], expected)
