"""benchmarks/delay_bound.py: Lorden's bound on closed forms, and Page's sum compared with it."""

from __future__ import annotations

import math
import runpy
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdtool.detectors.detection import Signal, Status
from cdtool.thresholds.cusum import Cusum

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"
PERIOD = 1e-3


def loaded() -> dict[str, Any]:
    """The script's names; it imports modules from its own folder."""
    kept = list(sys.path)
    sys.path.insert(0, str(BENCHMARKS))
    try:
        return runpy.run_path(str(BENCHMARKS / "delay_bound.py"))
    finally:
        sys.path[:] = kept


BOUND = loaded()
after_onset, summed_divergence = BOUND["after_onset"], BOUND["summed_divergence"]
samples_to, delay_bound = BOUND["samples_to"], BOUND["delay_bound"]
white_limit, spread_of_sums = BOUND["white_limit"], BOUND["spread_of_sums"]


def innovations(values: np.ndarray, status: int = Status.VALID) -> Signal:
    column = np.asarray(values, dtype=float)[:, np.newaxis]
    states = np.full(column.shape, status, dtype=np.uint8)
    return Signal(PERIOD * np.arange(len(column)), column, states, "1")


@given(st.floats(0.1, 20.0), st.floats(2.0, 1e9))
def test_a_steady_shift_needs_log_gamma_over_half_its_square_in_samples(shift, between_alarms):
    wanted = math.log(between_alarms) / (shift**2 / 2.0)
    steady = np.full(math.ceil(wanted) + 2, shift**2 / 2.0)
    assert samples_to(np.cumsum(steady), math.log(between_alarms)) == pytest.approx(wanted)
    latency = delay_bound(np.cumsum(steady), between_alarms, PERIOD)
    assert latency == pytest.approx(PERIOD * max(wanted - 1.0, 0.0), abs=1e-12)


def test_a_growing_shift_needs_the_samples_in_which_its_squares_add_up():
    # m_k = k: the sum of k^2 / 2 up to n is n (n + 1)(2 n + 1) / 12, that is 70 at n = 7.
    ramp = np.cumsum(np.arange(1.0, 12.0) ** 2 / 2.0)
    assert samples_to(ramp, 70.0) == pytest.approx(7.0)
    assert samples_to(ramp, 45.5 + 0.5 * 24.5) == pytest.approx(6.5)


def test_a_response_that_ends_too_early_has_an_infinite_bound():
    assert delay_bound(np.cumsum(np.full(10, 0.1)), 1e6, PERIOD) == math.inf
    assert delay_bound(np.array([0.0, np.nan, np.nan]), 1e6, PERIOD) == math.inf


def test_the_divergence_of_noise_alone_stays_about_zero():
    responses = np.random.default_rng(3).standard_normal((20, 4000))
    summed = summed_divergence(responses)
    # Each sample's estimate has a standard deviation of sqrt(2) / 2 / 20 and no mean; the square alone would give 100.
    assert abs(summed[-1]) < 4.0 * math.sqrt(4000 / 2) / 20
    assert np.cumsum(0.5 * responses.mean(axis=0) ** 2)[-1] == pytest.approx(100.0, rel=0.2)


def test_the_divergence_of_a_known_response_is_recovered_from_its_noise():
    shape = np.linspace(0.0, 2.0, 300)
    responses = shape + np.random.default_rng(4).standard_normal((50, 300))
    assert summed_divergence(responses)[-1] == pytest.approx(np.sum(shape**2) / 2.0, rel=0.1)


def test_samples_that_few_impacts_have_are_not_summed():
    responses = np.ones((10, 8))
    responses[:6, 5:] = np.nan
    summed = summed_divergence(responses)
    assert summed[:5] == pytest.approx(0.5 * np.arange(1, 6))
    assert np.isnan(summed[5:]).all()


@pytest.mark.parametrize(("side", "sign"), [(1, 1.0), (0, 1.0), (-1, -1.0)])
def test_a_response_begins_at_the_first_sample_from_the_onset_on_and_ends_with_the_log(side, sign):
    signal = innovations(np.arange(10.0))
    assert after_onset(signal, 6.5e-3, 5, side) == pytest.approx(
        [sign * 7, sign * 8, sign * 9, np.nan, np.nan], nan_ok=True
    )
    assert after_onset(signal, 7.0e-3, 2, side) == pytest.approx([sign * 7, sign * 8])


def test_samples_that_are_not_assessable_are_not_a_response():
    assert np.isnan(after_onset(innovations(np.ones(10), Status.GAP), 0.0, 4, 1)).all()


def test_pages_sum_for_the_true_shift_comes_close_to_the_bound_and_not_below_it():
    shift, log_gamma = 1.0, 10.0
    # log(gamma) as limit of the log-likelihood ratio, shift times the sum, keeps gamma samples between alarms (Lorden).
    rule, limit = Cusum(drift=shift / 2.0), log_gamma / shift
    rng = np.random.default_rng(5)
    delays = []
    for _ in range(600):
        sums = rule.statistic(innovations(shift + rng.standard_normal(200)), 1, 1.0).values[:, 0]
        delays.append(1 + int(np.flatnonzero(sums > limit)[0]))
    bound = samples_to(np.cumsum(np.full(200, shift**2 / 2.0)), log_gamma)
    assert bound == pytest.approx(20.0)
    assert 1.0 < np.mean(delays) / bound < 1.15


# Drift, limit, samples between two alarms of unit Gaussian noise: 168 and 465 in the textbooks of process control are
# for two sides; one side alarms half as often.
RUN_LENGTHS = {"4": (0.5, 4.0, 336.0), "5": (0.5, 5.0, 930.0)}


@pytest.mark.parametrize("case", RUN_LENGTHS)
def test_the_limit_for_white_noise_is_that_of_published_run_lengths(case):
    drift, limit, between_alarms = RUN_LENGTHS[case]
    assert white_limit(between_alarms, drift) == pytest.approx(limit, abs=0.05)


def test_white_noise_alarms_about_as_often_as_its_limit_says():
    between_alarms, samples = 500.0, 400_000
    limit = white_limit(between_alarms, 1.0)
    noise = np.random.default_rng(6).standard_normal(samples)
    alarms, total = 0, 0.0
    for value in noise.tolist():
        total = max(0.0, total + value - 1.0)
        if total > limit:
            alarms, total = alarms + 1, 0.0
    assert samples / alarms == pytest.approx(between_alarms, rel=0.15)


def test_sums_of_white_noise_spread_as_its_samples_do_steady_ones_more_and_alternating_ones_not_at_all():
    noise = np.random.default_rng(7).standard_normal(200_000)
    assert spread_of_sums([noise, noise[:5]], 8) == pytest.approx(1.0, abs=0.03)
    assert spread_of_sums([np.ones(100), -np.ones(67)], 16) == pytest.approx(4.0)
    assert spread_of_sums([np.resize([1.0, -1.0], 99)], 8) == 0.0
