"""Comparisons of detectors and builds, checked with R 4.2.2 (calls next to the numbers) and Fisher's own result."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from cdtool.statistics.paired import fisher_p, holm, mcnemar_p, paired_difference, unpaired_difference
from cdtool.statistics.spread import mean_interval
from tests.bits import every_value

# Darwin's maize: height of the crossed minus that of the self-fertilised plant of a pair, eighths of an inch
# (Fisher, The Design of Experiments, 1935): 863 of the 32768 sign patterns give a sum as large; two-sided twice that.
DARWIN = [49, -67, 8, 16, 6, 23, 28, 41, 14, 29, 56, 24, 75, 60, -48]
DARWIN_P = 1726 / 32768
# R's data set `sleep` (Student 1908): hours gained with the second drug minus those with the first.
SLEEP = [1.2, 2.4, 1.3, 1.3, 0.0, 1.0, 1.8, 0.8, 4.6, 1.4]
UNTIED = [1.1, -2.3, 3.9, 5.2, 0.4, 6.1, 2.7, -0.8]
# Recordings of several contacts: sums 8, 3, 6, 4, -1, 18.
RECORDINGS = [[3, 5], [-2, 4, 1], [6], [2, 2], [-1], [7, 3, 8]]
FIRST, SECOND = [19, 22, 25, 26, 28, 29, 34], [20, 33, 36, 40, 41]


def flat(recordings: list[list[int]]) -> tuple[list[int], list[int]]:
    return [v for r in recordings for v in r], [number for number, r in enumerate(recordings) for _ in r]


def test_darwins_maize_gives_fishers_p_within_the_error_of_its_resamples():
    p = paired_difference(DARWIN, range(15)).p
    error = math.sqrt(DARWIN_P / 2 * (1 - DARWIN_P / 2) / 9999)
    assert p == pytest.approx(DARWIN_P, abs=2 * 4 * error)
    assert (p / 2 * 10_000) == pytest.approx(round(p / 2 * 10_000), abs=1e-9)
    assert p != paired_difference(DARWIN, range(15), seed=1).p


def test_ten_sleepers_are_tested_exactly():
    # signs <- as.matrix(expand.grid(rep(list(c(-1, 1)), 10))); sum(abs(signs %*% d) >= sum(d)) is 4 of 1024
    found = paired_difference(SLEEP, range(10))
    assert found.p == 4 / 1024
    assert (found.mean.value, found.n, found.clusters) == (pytest.approx(1.58), 10, 10)


def test_thirteen_recordings_are_still_enumerated():
    differences = np.array(DARWIN[:13])
    signs = np.array(list(itertools.product((-1, 1), repeat=13)))
    assert paired_difference(differences, range(13)).p == np.mean(np.abs(signs @ differences) >= differences.sum())


def test_signed_ranks_are_rs():
    # wilcox.test(DARWIN)$p.value, wilcox.test(UNTIED)$p.value
    assert paired_difference(DARWIN, range(15)).wilcoxon_p == pytest.approx(0.041259765625, rel=1e-12)
    assert paired_difference(UNTIED, range(8)).wilcoxon_p == pytest.approx(0.109375, rel=1e-12)


@settings(deadline=None, max_examples=60)
@given(st.lists(st.integers(-4, 4), min_size=2, max_size=9))
def test_signed_ranks_with_ties_and_zeros_are_those_of_scipy(values):
    expected = float(stats.wilcoxon(values).pvalue) if any(values) else 1.0
    assert paired_difference(values, range(len(values))).wilcoxon_p == pytest.approx(expected, rel=1e-12)


def test_the_contacts_of_a_recording_change_sign_together():
    # 2 of the 2^6 sign patterns of the sums reach 38 (themselves, and with -1 inverted); both sides: 4 of 64.
    values, recording = flat(RECORDINGS)
    found = paired_difference(values, recording)
    assert found.p == 4 / 64
    assert every_value(found.mean) == every_value(mean_interval(values, recording))
    assert (found.n, found.clusters) == (12, 6)
    assert paired_difference(values, range(12)).p < found.p


def test_no_difference_at_all_is_no_evidence():
    found = paired_difference([0.0] * 10, range(10))
    assert (found.mean.value, found.mean.low, found.mean.high, found.p, found.wilcoxon_p) == (0.0, 0.0, 0.0, 1.0, 1.0)
    found = unpaired_difference([5.0] * 10, [5.0] * 10, range(10), range(10))
    assert (found.mean.value, found.mean.low, found.mean.high, found.p, found.wilcoxon_p) == (0.0, 0.0, 0.0, 1.0, 1.0)


@pytest.mark.parametrize("number", [0, 1])
def test_one_recording_or_none_is_no_evidence(number):
    values = [3.0] * number
    for found in (
        paired_difference(values, range(number)),
        unpaired_difference(values, SECOND, range(number), range(5)),
        unpaired_difference(FIRST, values, range(7), range(number)),
    ):
        assert math.isnan(found.p) and math.isnan(found.wilcoxon_p) and math.isnan(found.mean.low)
        assert found.mean.known == bool(number)


def test_unpaired_sets_are_exchanged_in_every_way():
    # combn(12, 7): 32 of the 792 divisions have a difference of the means at or below -7.857.
    found = unpaired_difference(FIRST, SECOND, range(7), range(5))
    assert found.mean.value == pytest.approx(-7.85714285714286)
    assert found.p == pytest.approx(2 * 32 / 792, rel=1e-12)
    # wilcox.test(FIRST, SECOND)$p.value
    assert found.wilcoxon_p == pytest.approx(0.106060606060606, rel=1e-12)
    assert (found.n, found.clusters) == (12, 12)


def test_the_interval_of_an_unpaired_difference_is_welchs():
    a = [31.2, 27.9, 44.0, 35.1, 29.3, 61.7, 33.8, 38.2, 26.4, 52.5, 30.9, 34.6, 41.3, 28.7, 36.0, 47.8, 32.1, 29.9]
    a += [39.4, 70.2]
    b = [28.1, 25.2, 40.3, 33.3, 27.5, 45.1, 30.2, 36.6, 24.8, 39.9]
    mean = unpaired_difference(a, b, range(20), range(10)).mean
    welch = stats.ttest_ind(a, b, equal_var=False).confidence_interval()
    assert (mean.value, mean.low, mean.high) == pytest.approx((5.45, welch.low, welch.high), rel=1e-12)


def test_misses_are_compared_exactly_as_in_r():
    # binom.test(x, n)$p.value for 2 of 10, 0 of 6, 5 of 12
    found = [mcnemar_p(2, 8), mcnemar_p(0, 6), mcnemar_p(5, 7), mcnemar_p(0, 0)]
    assert found == pytest.approx([0.109375, 0.03125, 0.7744140625, 1.0], rel=1e-12)
    # fisher.test(matrix(c(1, 9, 11, 3), 2))$p.value, the same of (3, 1, 1, 3) (Fisher's tea) and (0, 30, 6, 24)
    found = [fisher_p(1, 12, 9, 12), fisher_p(3, 4, 1, 4), fisher_p(0, 6, 30, 54)]
    assert found == pytest.approx([0.00275945618522009, 0.485714285714286, 0.0237207039169573], rel=1e-9)
    assert math.isnan(fisher_p(0, 0, 3, 10))


def test_holms_correction_is_rs_and_leaves_out_what_is_unknown():
    # p.adjust(c(0.01, 0.04, 0.03, 0.005, 0.2), "holm"), p.adjust(c(0.01, NA, 0.04, 0.03), "holm")
    assert holm([0.01, 0.04, 0.03, 0.005, 0.2]) == pytest.approx([0.040, 0.090, 0.090, 0.025, 0.200], rel=1e-12)
    assert holm([0.01, math.nan, 0.04, 0.03]) == pytest.approx([0.03, math.nan, 0.06, 0.06], rel=1e-12, nan_ok=True)
    assert holm([]).shape == (0,)
