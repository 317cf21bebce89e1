"""Learned curves at the locations of a run: the bits of numpy's interpolation."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from cdtool.detectors.detection import Signal
from cdtool.recordings.motion.progress import Progress
from cdtool.thresholds.curve_lookup import LearnedColumn, look_up
from cdtool.thresholds.normal_motion import NormalCurves, farthest_lasting
from cdtool.thresholds.signature_curve import Curve, resample

VALUES = st.sampled_from([0.0, 1.0, 1.0, 0.1, -2.5, 1e3, np.nan])
WITH_INFINITE = st.sampled_from([0.0, 1.0, 0.1, -2.5, np.nan, np.inf, -np.inf])
PLACES = st.one_of(st.sampled_from([0.0, 0.1, 0.2, 0.3, 0.6, np.nan, -0.1, 0.05, 0.15]), st.floats(-0.2, 1.2))


def _interpolated(values, grid, step, axis):
    """Return values given on the grid at any location; an infinite one counts up to the middle between two points."""
    with np.errstate(invalid="ignore"):
        result = np.interp(axis, grid, values, left=np.nan, right=np.nan)
    nearest = np.clip(np.rint(np.nan_to_num(axis) / step).astype(int), 0, len(values) - 1)
    return np.where(np.isinf(values[nearest]), values[nearest], result)


@given(st.data(), st.integers(1, 8), st.lists(st.tuples(PLACES, st.booleans()), max_size=30), st.booleans())
def test_values_between_grid_points_are_the_bits_of_numpys_interpolation(data, points, rows, has_infinite):
    kind = WITH_INFINITE if has_infinite else VALUES
    mean, spread = (np.array(data.draw(st.lists(kind, min_size=points, max_size=points))) for _ in range(2))
    axis, running = np.array([row[0] for row in rows]), np.array([row[1] for row in rows], dtype=bool)
    curve = Curve.empty(0.1, 0.1, (points - 0.5) * 0.1, 1)
    found = np.full((2, len(rows)), 77.0)
    look_up(axis, running, True, _column(curve, mean, spread), np.inf, 0.05, *found)
    expected = [_interpolated(part, curve.grid, 0.1, axis) for part in (mean, spread)]
    np.testing.assert_array_equal(found[0], np.where(running, expected[0], 77.0))
    np.testing.assert_array_equal(found[1], np.where(running, np.maximum(expected[1], 0.05), 77.0))


def _column(curve: Curve, mean: np.ndarray, spread: np.ndarray) -> LearnedColumn:
    vars(curve)["_pooled_band"] = mean[:, np.newaxis], spread[:, np.newaxis]
    return curve.columns[0]


def _curve(random: np.random.Generator, end: float, joints: int) -> Curve:
    curve = Curve.empty(0.05, 0.1, end, joints)
    samples = random.standard_normal((6, len(curve.count), joints))
    samples[random.random(samples.shape) < 0.1] = np.nan
    samples[1:, -1:] = np.nan  # too few runs at the end
    return curve.learned(samples)


def _looked_up(curve, axis):
    mean, spread = curve.band(pooled=True)
    columns = range(mean.shape[1])
    return [
        np.column_stack([np.interp(axis, curve.grid, part[:, j], left=np.nan, right=np.nan) for j in columns])
        for part in (mean, spread)
    ]


@given(st.integers(0, 2**32 - 1), st.integers(0, 200), st.integers(1, 3), st.sampled_from([0.01, 0.3]), st.booleans())
def test_curves_by_time_and_by_travel_are_those_of_whole_arrays(seed, count, joints, end, has_travel):
    random = np.random.default_rng(seed)
    by_time, by_travel = _curve(random, end, joints), _curve(random, 0.8, joints) if has_travel else None
    curves = NormalCurves(by_time, by_travel, np.zeros(joints), np.zeros(joints))
    elapsed, travel = np.sort(random.uniform(-0.1, 0.6, count)), random.uniform(-0.1, 1.0, count)
    elapsed[elapsed < 0.0] = np.nan
    travel[random.random(count) < 0.1] = np.nan
    where = Progress(elapsed, travel, elapsed > 0.2)
    mean, spread = _looked_up(by_time, np.minimum(elapsed, by_time.end))
    if by_travel is None:
        mean, spread = (np.where(elapsed[:, np.newaxis] > by_time.end, np.nan, part) for part in (mean, spread))
        largest = np.abs(by_time.mean).max(axis=0)
    else:
        along = _looked_up(by_travel, travel)
        mean, spread = (
            np.where(where.running[:, np.newaxis], other, part)
            for part, other in zip((mean, spread), along, strict=True)
        )
        largest = np.maximum(np.abs(by_time.mean).max(axis=0), np.abs(by_travel.mean).max(axis=0))
    found = curves.at(where, 0.5)
    np.testing.assert_array_equal(found[0], mean)
    np.testing.assert_array_equal(found[1], np.maximum(spread, 0.5 * largest))


DISTANT = st.sampled_from([0.0, -0.0, 0.5, 1.0, 2.0, -3.0, np.nan, np.inf])


@given(st.lists(st.tuples(DISTANT, DISTANT, DISTANT, st.booleans()), max_size=30))
def test_the_farthest_lasting_distances_are_those_of_sliding_windows(rows):
    value, mean, spread = (np.array([row[i] for row in rows], dtype=np.float64) for i in range(3))
    running = np.array([row[3] for row in rows], dtype=bool)
    with np.errstate(invalid="ignore", divide="ignore"):
        off = np.abs(value - mean) / spread
    off = np.where(np.isfinite(off), off, 0.0)
    kept = np.zeros(len(off))
    if len(off) >= 3:
        kept[2:] = np.lib.stride_tricks.sliding_window_view(off, 3).min(axis=1)
    expected = tuple(kept[part].max(initial=0.0) for part in (~running, running))
    assert farthest_lasting(value, mean, spread, running, 3) == expected


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
