"""CUSUM and GLR against their definitions, their run length, and gaps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cdtool.detectors.detection import Status
from cdtool.thresholds.cusum import Cusum
from cdtool.thresholds.glr import Glr
from tests.thresholds.strokes import N, noise_runs, signal, stroke

GAP = 0.0215


def noise(seed=0):
    return np.random.default_rng(seed).normal(size=N)


@pytest.mark.parametrize("side", [-1, 0, 1])
def test_cusum_is_pages_recursion(side):
    values = noise() + np.where(np.arange(N) > 3000, -0.8, 0.0)
    statistic = Cusum(drift=0.4).statistic(signal(values), side, GAP).values[:, 0]
    above = below = 0.0
    for k, value in enumerate(values):
        above, below = max(0.0, above + value - 0.4), max(0.0, below - value - 0.4)
        expected = above if side > 0 or (side == 0 and above >= below) else -below
        assert statistic[k] == pytest.approx(expected, abs=1e-9)


def test_the_mean_time_to_a_false_alarm_of_cusum_is_that_of_siegmund():
    rng = np.random.default_rng(3)
    lengths = []
    for _ in range(400):
        values = rng.normal(size=N)
        above = Cusum(drift=0.5).statistic(signal(values), 1, GAP).values[:, 0]
        at = np.flatnonzero(above > 4.0)
        lengths.append(at[0] + 1 if len(at) else N)
    reach = 4.0 + 1.166  # below: four standard errors of 400 exponential lengths
    assert np.mean(lengths) == pytest.approx(
        (np.exp(reach) - reach - 1.0) / 0.5, rel=0.2
    )  # of 400 exponential lengths: four standard errors


@pytest.mark.parametrize("side", [-1, 0, 1])
def test_glr_is_the_largest_scaled_sum_over_its_windows(side):
    values = noise(1)
    windows = (2, 7, 30)
    statistic = Glr(windows=windows).statistic(signal(values), side, GAP).values[:, 0]
    for k in (1, 5, 6, 29, 500, 3999):
        scores = [values[k + 1 - w : k + 1].sum() / np.sqrt(w) for w in windows if w <= k + 1]
        largest = max(scores, key=abs) if side == 0 else side * max(0.0, *(side * score for score in scores))
        assert statistic[k] == pytest.approx(largest, abs=1e-9)


@pytest.mark.parametrize("rule", [Cusum(drift=0.5), Glr()])
def test_a_short_gap_is_bridged_and_a_long_one_restarts_the_sum(rule):
    values = np.full(N, 1.0)
    whole = rule.statistic(signal(values[:-10]), 1, GAP).values[:, 0]
    for missing, kept in ((10, True), (21, False)):
        status = signal(values).status.copy()
        status[2000 : 2000 + missing] = Status.GAP
        statistic = rule.statistic(replace(signal(values), status=status), 1, GAP)
        assert np.isnan(statistic.values[2000 : 2000 + missing]).all() and statistic.valid[2000 + missing :].all()
        after = statistic.values[2000 + missing, 0]
        assert after == pytest.approx(whole[2000] if kept else whole[0])


@pytest.mark.parametrize("rule", [Cusum(), Glr()])
@pytest.mark.parametrize("missing", [25, 50, 100])
def test_a_gap_costs_a_contact_that_builds_up_its_own_length_and_20_ms(rule, missing):
    fitted, onset = rule.fit(noise_runs(12)), 3000
    whole = signal(100.0 + noise(5) + np.where(np.arange(N) < onset, 0.0, 1.6))

    def crossing(found):
        statistic, band = fitted.evaluate(stroke(), found)
        outside = statistic.valid & ((statistic.values > band.upper) | (statistic.values < band.lower))
        return int(np.flatnonzero(outside[onset:, 0])[0])

    usual = crossing(whole)
    assert usual >= 30
    for first in range(onset - missing, onset + usual, 5):
        status = whole.status.copy()
        status[first : first + missing] = Status.GAP
        assert crossing(replace(whole, status=status)) <= usual + missing + 20, first - onset
