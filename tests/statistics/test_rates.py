"""Exact intervals of rare events, compared with R 4.2.2: poisson.test and binom.test, one-sided with "less"."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdtool.statistics.interval import Interval
from cdtool.statistics.rates import (
    binomial_at_most,
    binomial_share,
    poisson_at_most,
    poisson_difference_p,
    poisson_rate,
)

LEVELS = st.sampled_from([0.8, 0.9, 0.95, 0.99])


def bounds(interval: Interval) -> tuple[float, float, float]:
    return interval.value, interval.low, interval.high


# poisson.test(x, 10)$conf.int and poisson.test(x, 10, alternative = "less")$conf.int[2]
@pytest.mark.parametrize(
    ("count", "low", "high", "at_most"),
    [
        (0, 0.0, 0.368887945411394, 0.299573227355399),
        (1, 0.00253178079842899, 0.55716433909388985, 0.47438645183905770),
        (3, 0.0618672122895602, 0.8767273069742323, 0.7753656527932725),
        (10, 0.479538869613243, 1.839035604201778, 1.696221923572190),
    ],
)
def test_a_rate_in_ten_hours_is_rs(count, low, high, at_most):
    assert bounds(poisson_rate(count, 10.0)) == pytest.approx((count / 10.0, low, high), rel=1e-12)
    assert poisson_at_most(count, 10.0) == pytest.approx(at_most, rel=1e-12)


# binom.test(x, 30)$conf.int and binom.test(x, 30, alternative = "less")$conf.int[2]
@pytest.mark.parametrize(
    ("count", "low", "high", "at_most"),
    [
        (0, 0.0, 0.1157033082220278, 0.0950338528553041),
        (1, 0.000843570926630479, 0.172169455633412682, 0.148596068659113123),
        (3, 0.0211171370297226, 0.2652884504742081, 0.2385978572932509),
        (29, 0.827830544366587, 0.999156429073370, 0.998291684355534),
        (30, 0.884296691777972, 1.0, 1.0),
    ],
)
def test_a_share_of_thirty_is_rs(count, low, high, at_most):
    assert bounds(binomial_share(count, 30)) == pytest.approx((count / 30, low, high), rel=1e-9)
    assert binomial_at_most(count, 30) == pytest.approx(at_most, rel=1e-9)


def test_another_level_is_rs():
    # binom.test(3, 30, conf.level = 0.9)$conf.int
    assert bounds(binomial_share(3, 30, 0.9))[1:] == pytest.approx((0.0278155497397497, 0.2385978572932509), rel=1e-9)


def test_without_observation_the_interval_is_unbounded():
    for interval, high in (
        (poisson_rate(0, 0.0), math.inf),
        (poisson_rate(2, 0.0), math.inf),
        (binomial_share(0, 0), 1.0),
    ):
        assert not interval.known
        assert (interval.low, interval.high) == (0.0, high)
    assert poisson_at_most(0, 0.0) == math.inf
    assert binomial_at_most(0, 0) == 1.0
    assert math.isnan(poisson_difference_p(0, 0.0, 3, 2.0))


@given(st.integers(0, 200), st.floats(1e-3, 1e6), LEVELS)
def test_a_rates_interval_holds_the_rate_and_scales_with_the_unit_of_time(count, hours, level):
    interval = poisson_rate(count, hours, level)
    assert interval.low <= interval.value < interval.high
    assert interval.value < poisson_at_most(count, hours, level) < interval.high
    assert bounds(poisson_rate(count, 1024.0 * hours, level)) == tuple(figure / 1024.0 for figure in bounds(interval))
    assert poisson_rate(count + 1, hours, level).low > interval.low


@given(st.integers(0, 100), st.integers(0, 100), LEVELS)
def test_a_shares_interval_holds_the_share_and_mirrors_that_of_the_others(count, others, level):
    n = count + others
    interval, mirrored = binomial_share(count, n, level), binomial_share(others, n, level)
    assert (interval.low, interval.high) == pytest.approx((1.0 - mirrored.high, 1.0 - mirrored.low), abs=1e-9)
    if n:
        assert interval.low <= interval.value <= interval.high
        assert interval.value <= binomial_at_most(count, n, level) <= interval.high


def test_two_rates_are_compared_as_in_r():
    # poisson.test(c(11, 14), c(800, 3011))$p.value (the example of R's help), poisson.test(c(2, 9), c(10, 12))$p.value
    assert poisson_difference_p(11, 800.0, 14, 3011.0) == pytest.approx(0.0108928502758369, rel=1e-9)
    assert poisson_difference_p(2, 10.0, 9, 12.0) == pytest.approx(0.0774795351471603, rel=1e-9)
    assert poisson_difference_p(9, 12.0, 2, 10.0) == pytest.approx(0.0774795351471603, rel=1e-9)
    assert poisson_difference_p(0, 10.0, 0, 12.0) == 1.0
