"""BCa intervals, compared with R 4.2.2 with boot 1.3-28.1.

R: b <- boot(data, statistic, R = 199999), set.seed(1), then the BCa formula with the acceleration from leaving one
cluster out. For the bias, resamples equal to the statistic count half, as in scipy. (boot.ci does not count them, which
shifts the median's interval.)
"""

from __future__ import annotations

import math
import tracemalloc

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdtool.errors import UsageError
from cdtool.evaluation.statistics.bootstrap import bca
from tests.noted_times import noted

LATENCIES = [
    *(31.2, 27.9, 44.0, 35.1, 29.3, 61.7, 33.8, 38.2, 26.4, 52.5),
    *(30.9, 34.6, 41.3, 28.7, 36.0, 47.8, 32.1, 29.9, 39.4, 70.2),
]
RECORDINGS = [
    *([31.2, 27.9], [44.0, 35.1, 29.3], [61.7], [33.8, 38.2], [26.4, 52.5, 30.9, 34.6]),
    *([41.3], [28.7, 36.0, 47.8], [32.1, 29.9], [39.4], [70.2, 58.1]),
]
CLUSTERED = [latency for recording in RECORDINGS for latency in recording]
RECORDING = [f"run {number}" for number, recording in enumerate(RECORDINGS) for _ in recording]

VALUES = st.lists(st.tuples(st.integers(0, 100), st.integers(0, 15)), min_size=1, max_size=40)
STATISTICS = st.sampled_from(["mean", "std", "median"])


@pytest.mark.parametrize(
    ("statistic", "value", "low", "high"),
    [("mean", 38.55, 34.535, 44.870), ("std", 11.664363, 7.577249, 16.983474), ("median", 34.85, 31.05, 40.35)],
)
def test_independent_values_give_rs_interval(statistic, value, low, high):
    interval = bca(LATENCIES, range(20), statistic)
    assert interval.value == pytest.approx(value, abs=1e-6)
    assert (interval.low, interval.high) == pytest.approx((low, high), abs=0.25)


@pytest.mark.parametrize(
    ("statistic", "value", "low", "high"),
    [("mean", 39.480952, 35.41860, 49.33529), ("std", 12.143089, 7.595449, 16.512365), ("median", 35.1, 31.2, 41.3)],
)
def test_recordings_of_several_contacts_are_resampled_as_a_whole_as_in_r(statistic, value, low, high):
    interval = bca(CLUSTERED, RECORDING, statistic)
    assert interval.value == pytest.approx(value, abs=1e-6)
    assert (interval.low, interval.high) == pytest.approx((low, high), abs=0.5)


def test_more_resamples_come_closer_to_r():
    interval = bca(LATENCIES, range(20), "mean", resamples=199_999)
    assert (interval.low, interval.high) == pytest.approx((34.535, 44.870), abs=0.03)


@pytest.mark.parametrize("statistic", ["mean", "std", "median"])
def test_copies_of_a_contact_in_its_recording_do_not_make_the_interval_shorter(statistic):
    once = bca(LATENCIES, range(20), statistic)
    copied = bca(np.repeat(LATENCIES, 5), np.repeat(np.arange(20), 5), statistic)
    believed = bca(np.repeat(LATENCIES, 5), range(100), statistic)
    assert copied.high - copied.low > 0.9 * (once.high - once.low)
    assert believed.high - believed.low < 0.6 * (once.high - once.low)


def test_the_same_seed_gives_the_same_bytes_and_another_one_does_not():
    assert bca(LATENCIES, range(20), "mean", seed=7) == bca(LATENCIES, range(20), "mean", seed=7)
    assert bca(LATENCIES, range(20), "mean", seed=7) != bca(LATENCIES, range(20), "mean", seed=8)


@settings(deadline=None, max_examples=40)
@given(VALUES, STATISTICS, st.randoms(use_true_random=False))
def test_neither_order_nor_names_nor_unit_matter(pairs, statistic, random):
    def interval(factor: float, name: str) -> np.ndarray:
        found = bca([factor * v for v, _ in pairs], [f"{name}{c}" for _, c in pairs], statistic, resamples=199)
        return np.array([found.value, found.low, found.high])

    before = interval(1.0, "campaign ")
    random.shuffle(pairs)
    np.testing.assert_array_equal(interval(4.0, "run "), 4.0 * before)


@settings(deadline=None, max_examples=40)
@given(VALUES, STATISTICS)
def test_the_value_is_numpys_and_a_bound_is_missing_only_below_ten_clusters(pairs, statistic):
    values, clusters = np.array([v for v, _ in pairs]), [c for _, c in pairs]
    found = bca(values, clusters, statistic, resamples=199)
    if statistic == "std" and len(values) == 1:
        assert not found.known
    else:
        expected = {"mean": np.mean(values), "median": np.median(values), "std": np.std(values, ddof=len(values) > 1)}
        assert found.value == pytest.approx(expected[statistic], abs=1e-9)
    assert math.isnan(found.low) == math.isnan(found.high) == (len(set(clusters)) < 10)
    assert not found.low > found.high


@pytest.mark.parametrize(("statistic", "value"), [("mean", 0.1), ("std", 0.0), ("median", 0.1)])
def test_equal_values_give_an_interval_of_no_width(statistic, value):
    interval = bca([0.1] * 17, range(17), statistic)
    assert (interval.value, interval.low, interval.high) == (value, value, value)


def test_ties_that_leave_no_acceleration_give_percentiles():
    # Leaving out any one value leaves the median at 40: the acceleration is 0 / 0.
    interval = bca([40.0] * 9 + [60.0] * 7, range(16), "median")
    assert (interval.value, interval.low, interval.high) == (40.0, 40.0, 60.0)


def test_a_higher_level_gives_a_longer_interval():
    narrow, wide = bca(LATENCIES, range(20), "mean", 0.8), bca(LATENCIES, range(20), "mean", 0.99)
    assert wide.low < narrow.low < narrow.high < wide.high
    assert (narrow.level, wide.level) == (0.8, 0.99)


def test_five_thousand_contacts_take_little_memory():
    values = np.random.default_rng(1).lognormal(3.4, 0.5, 5000)
    bca(values[:3], range(3), "mean", resamples=1)
    with noted(5.0):  # about 0.5 s
        bca(values, range(5000), "mean")
    tracemalloc.start()
    bca(values, range(5000), "median", resamples=999)
    assert tracemalloc.get_traced_memory()[1] < 200e6
    tracemalloc.stop()


@pytest.mark.parametrize(
    ("values", "clusters", "statistic", "said"),
    [
        ([1.0, 2.0], [0, 1], "avarage", "unknown statistic 'avarage'"),
        ([1.0, 2.0], [0], "mean", "do not match"),
        ([1.0, math.nan], [0, 1], "mean", "missing or infinite"),
        ([1.0, math.inf], [0, 1], "mean", "missing or infinite"),
    ],
)
def test_wrong_arguments_are_reported(values, clusters, statistic, said):
    with pytest.raises(UsageError, match=said) as fault:
        bca(values, clusters, statistic)
    assert fault.value.hint


def test_no_resamples_are_refused():
    with pytest.raises(UsageError, match="resamples is 0"):
        bca(LATENCIES, range(20), "mean", resamples=0)
