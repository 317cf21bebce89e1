"""Sample sizes, compared with R 4.2.2: power.t.test(delta, sd, power, type, strict = TRUE)$n, rounded up."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdtool.statistics.sample_size import (
    detectable_difference,
    exposure_for_rate,
    impacts_for_difference,
    impacts_for_missed_share,
    impacts_for_unpaired,
)


# n of type = "paired" and of type = "two.sample"
@pytest.mark.parametrize(
    ("difference", "std", "power", "paired", "two_sample"),
    [
        (5, 10, 0.8, 33.3671291039066, 63.7656101707822),
        (3, 20, 0.8, 350.763819773718, 698.638151051334),
        (10, 10, 0.8, 9.93785029051807, 16.71472821134714),
        (1, 10, 0.9, 1052.66454721809, 2102.44471010901),
        (20, 8, 0.8, 3.53345988934644, 3.76181265838698),
    ],
)
def test_impacts_for_a_difference_are_rs(difference, std, power, paired, two_sample):
    assert impacts_for_difference(difference, std, power) == math.ceil(paired)
    assert impacts_for_unpaired(difference, std, power) == math.ceil(two_sample)


def test_a_tiny_difference_needs_the_millions_that_r_finds():
    # power.t.test(delta = 0.01, sd = 10, power = 0.8, type = "paired", strict = TRUE)$n is 7848862.4
    assert impacts_for_difference(0.01, 10.0) == 7848863


def test_the_detectable_difference_is_rs():
    # power.t.test(n, sd = 10, power, sig.level, type = "paired", strict = TRUE, tol = 1e-12)$delta
    assert detectable_difference(30, 10.0) == pytest.approx(5.29235615112784, rel=1e-8)
    assert detectable_difference(30, 10.0, 0.9, 0.99) == pytest.approx(7.47740344239268, rel=1e-8)
    assert detectable_difference(5, 10.0) == pytest.approx(16.8199696595358, rel=1e-8)


@settings(deadline=None, max_examples=30)
@given(st.integers(2, 2000), st.floats(0.1, 100.0), st.sampled_from([0.5, 0.8, 0.95]))
def test_the_detectable_difference_needs_just_those_impacts(n, std, power):
    difference = detectable_difference(n, std, power)
    assert impacts_for_difference(difference * (1.0 + 1e-9), std, power) <= n
    assert n == 2 or impacts_for_difference(difference * (1.0 - 1e-6), std, power) >= n


@pytest.mark.parametrize(("share", "allowed", "n"), [(0.05, 0, 59), (0.01, 0, 299), (0.1, 0, 29), (0.05, 1, 93)])
def test_impacts_for_a_missed_share_are_the_tables_of_acceptance_tests(share, allowed, n):
    # The least n with pbinom(allowed, n, share) <= 0.05; 59, 93 and 299 are the known ones of 95/95 and 95/99 tests.
    assert impacts_for_missed_share(share, allowed) == n


def test_the_exposure_for_a_rate_is_three_over_it_without_a_false_alarm():
    assert exposure_for_rate(0.1) == pytest.approx(-math.log(0.05) / 0.1, rel=1e-12)
    # qchisq(0.95, 6) / 2 is 6.295793622
    assert exposure_for_rate(0.1, 2) == pytest.approx(62.95793622, rel=1e-9)
