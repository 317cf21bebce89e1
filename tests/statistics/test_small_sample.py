"""Below ten contacts: no interval of a mean, and one of the median only if it has its coverage."""

from __future__ import annotations

import math
from itertools import product

import numpy as np
import pytest
from scipy import stats

from cdtool.statistics.paired import paired_difference, unpaired_difference
from cdtool.statistics.small_sample import median_of, median_rank, p95_of
from cdtool.statistics.spread import mean_interval

MIXTURE_MEDIAN = 38.0 + 4.0 * stats.norm.ppf(0.5 / 0.85)


def mixture(rng: np.random.Generator, n: int) -> np.ndarray:
    """85 % at 38 ms, 15 % slow cases at 120 ms: the median lies among the fast ones."""
    return np.where(rng.random(n) < 0.15, rng.normal(120.0, 8.0, n), rng.normal(38.0, 4.0, n))


def test_ten_recordings_have_one_and_a_hundred_contacts_of_nine_have_none():
    ten = mean_interval(np.arange(10) + 30.0, range(10))
    assert ten.low < ten.value < ten.high and not ten.reason
    nine = mean_interval(np.arange(99) + 30.0, np.arange(99) % 9)
    assert nine.value == 79.0 and math.isnan(nine.low) and "there are 9" in nine.reason


def test_differences_of_few_recordings_have_a_p_and_no_interval():
    paired = paired_difference([3.0, 4.0, 5.0, 6.0, 7.0, 8.0], range(6))
    apart = unpaired_difference([3.0] * 9 + [4.0] * 11, [1.0, 2.0, 3.0, 2.0], range(20), range(4))
    for found, k in ((paired, 6), (apart, 4)):
        assert math.isfinite(found.p) and math.isnan(found.mean.low) and math.isnan(found.mean.high)
        assert f"there are {k}" in found.mean.reason


@pytest.mark.parametrize("n", range(6, 10))
def test_the_ranks_of_the_median_hold_it_in_95_of_100_samples_of_any_distribution(n):
    rank = median_rank(n)
    # All patterns of below and above the median are equally likely: the interval fails if too few are on one side.
    held = [rank <= sum(pattern) <= n - rank for pattern in product((0, 1), repeat=n)]
    assert np.mean(held) >= 0.95
    narrower = [rank + 1 <= sum(pattern) <= n - rank - 1 for pattern in product((0, 1), repeat=n)]
    assert np.mean(narrower) < 0.95


@pytest.mark.parametrize("n", range(1, 6))
def test_below_six_contacts_no_ranks_do_and_there_is_no_interval(n):
    assert median_rank(n) == 0
    found = median_of(np.arange(n) + 30.0, [False] * n, range(n))
    assert found.value == np.median(np.arange(n) + 30.0)
    assert math.isnan(found.low) and math.isnan(found.high)
    assert found.reason == f"an interval of the median needs 6 contacts; there are {n}"


@pytest.mark.parametrize("n", range(4, 10))
def test_the_interval_of_few_contacts_with_slow_cases_has_its_coverage(n):
    rng, held, shown, total = np.random.default_rng(n), 0, 0, 1500
    for _ in range(total):
        values = mixture(rng, n)
        assert math.isnan(mean_interval(values, range(n)).low)
        interval = median_of(values, np.zeros(n, dtype=bool), range(n))
        shown += not math.isnan(interval.low)
        held += interval.low <= MIXTURE_MEDIAN <= interval.high
    assert shown == (total if n >= 6 else 0)
    # 0.95 minus three standard errors of 1500 tests.
    assert not shown or held / shown >= 0.933


def test_a_missed_contact_is_later_than_all_in_the_upper_bound_and_counts_from_its_watching_in_the_lower():
    latency, missed = [30.0, 34.0, 40.0, 41.0, 50.0, 1000.0], [False] * 5 + [True]
    assert (median_of(latency, missed, range(6)).low, median_of(latency, missed, range(6)).high) == (30.0, math.inf)
    early = median_of([12.0, *latency[:5]], [True] + [False] * 5, range(6))
    assert (early.low, early.high) == (12.0, math.inf)


def test_correlated_contacts_of_few_recordings_have_no_interval():
    found = median_of(np.arange(30) + 20.0, [False] * 30, np.arange(30) % 5)
    assert math.isnan(found.low) and found.value == 34.5
    assert "there are 5, and contacts of one recording are correlated" in found.reason
    assert not math.isnan(median_of(np.arange(30) + 20.0, [False] * 30, np.arange(30) % 10).low)


def test_the_p95_of_few_contacts_is_a_figure_without_interval():
    few, many = (p95_of(np.arange(n) + 20.0, [False] * n, range(n)) for n in (9, 10))
    assert few.value == 28.0 and math.isnan(few.low) and "there are 9" in few.reason
    assert many.low < many.high and not many.reason
    assert math.isnan(p95_of([], [], []).value)
