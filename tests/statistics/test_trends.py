"""Drift, step or neither: rank tests compared with closed forms, and the false-positive rate on steady values."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdtool.statistics.trends import LEAST_RUNS, change_over_runs, linear_trend, may_change, pettitt_p

RUNS = np.arange(40)


def noise(seed: int, n: int = 40) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=n)


def test_a_line_has_its_slope_and_the_least_p_of_so_few_runs():
    trend = linear_trend(3.0 + 0.5 * np.arange(6.0), np.arange(6))
    assert (trend.slope.value, trend.slope.low, trend.slope.high) == pytest.approx((0.5, 0.5, 0.5))
    assert trend.p == pytest.approx(2.0 / 720.0)  # one order of 6 runs only rises, one only falls
    assert trend.at(4.0) == pytest.approx(5.0)


def test_a_missing_run_neither_shifts_the_slope_nor_the_step():
    values = 0.2 * np.arange(40.0)
    values[[3, 17, 18]] = np.nan
    course = change_over_runs(values)
    assert course.n == 37 and course.kind == "drift"
    assert course.trend.slope.value == pytest.approx(0.2) and course.change == pytest.approx(0.2 * 39)
    steps = np.where(np.arange(40) < 25, 0.0, 5.0) + 0.01 * noise(1)
    steps[[2, 24]] = np.nan
    assert change_over_runs(steps).step.run == 25


def test_pettitts_statistic_is_that_of_all_pairs():
    values = noise(4, 25)
    signs = np.sign(values[np.newaxis, :] - values[:, np.newaxis])  # each later minus each earlier value
    pairs = [abs(signs[:t, t:].sum()) for t in range(1, 25)]
    largest = max(pairs)
    assert pettitt_p(values) == pytest.approx(min(1.0, 2.0 * np.exp(-6.0 * largest**2 / (25**3 + 25**2))))


def test_a_drift_is_reported_as_a_drift_and_a_step_as_a_step():
    drift, step = change_over_runs(noise(2) + 0.5 * RUNS), change_over_runs(noise(2) + 10.0 * (RUNS >= 22))
    assert (drift.kind, step.kind) == ("drift", "step")
    assert drift.trend.slope.value == pytest.approx(0.5, abs=0.08)  # the standard error of a slope is 0.014
    assert drift.change == pytest.approx(drift.trend.slope.value * 39)
    assert step.step.run == 22 and step.step.height == pytest.approx(10.0, abs=2.0)  # standard error: 0.4
    assert step.change == step.step.height


def test_steady_values_show_something_in_at_most_one_season_of_a_hundred():
    shown = sum(change_over_runs(noise(seed, 20)).kind != "steady" for seed in range(500))
    assert shown <= 13  # usual is one in 190: more than 13 of 500 once in a million
    assert change_over_runs(np.full(40, 2.0)).change == 0.0


def test_equal_values_and_few_runs_are_steady():
    still = change_over_runs(np.full(20, 2.0))
    assert still.kind == "steady" and still.trend.p == 1.0 and still.trend.slope.value == 0.0
    few = change_over_runs(np.arange(LEAST_RUNS - 1.0))
    assert few.kind == "steady" and few.trend is None and few.n == LEAST_RUNS - 1


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.floats(-5.0, 5.0) | st.just(float("nan")), min_size=0, max_size=30),
    st.floats(-1.0, 1.0),
    st.integers(1, 50),
)
def test_the_quick_check_agrees_with_the_full_test(values, slope, comparisons):
    given_values = np.array(values) + slope * np.arange(len(values))
    assert may_change(given_values, comparisons) == (change_over_runs(given_values, comparisons).kind != "steady")
