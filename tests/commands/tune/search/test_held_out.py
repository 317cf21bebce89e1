"""The correction of a limit that was set on the runs that also chose."""

from __future__ import annotations

import numpy as np
import pytest

from cdtool.commands.tune.search.held_out import MULTIPLIERS, HeldOut, correction, pooled
from cdtool.results.curves.false_alarm_budget import Budget

BUDGET = Budget.parse("1/10op")


def fold(ratios, contacts=(), latency=0.01) -> HeldOut:
    """A fold whose latency grows with the limit."""
    values = latency * np.tile(MULTIPLIERS[:, np.newaxis], len(contacts))
    known = np.ones(len(contacts), dtype=bool)
    return HeldOut(np.array(contacts, dtype=int), values, 1e3 * values, known, np.array(ratios), 10.0 * len(ratios))


def test_a_limit_that_too_many_runs_exceed_is_raised_to_the_budget():
    folds = [fold([0.5] * 9 + [1.5]), fold([0.5] * 8 + [1.2])]  # 19 runs: one may be above it
    multiple = MULTIPLIERS[correction(BUDGET, folds)]
    assert 1.2 < multiple <= 1.2 * 1.03 + 1e-9
    assert correction(Budget.parse("1/19op"), folds) == np.searchsorted(MULTIPLIERS, 1.5)


def test_the_correction_ends_at_the_largest_multiple():
    assert correction(BUDGET, [fold([50.0] * 10)]) == len(MULTIPLIERS) - 1
    assert correction(BUDGET, [fold([])]) == 0


def test_each_fold_is_corrected_by_the_others():
    calm, restless = fold([0.5] * 10, contacts=[0, 1]), fold([1.5] * 10, contacts=[2])
    made = pooled(BUDGET, [calm, restless], 3, corrects=True)
    assert made is not None and made.alarming == 10 and made.free == 20
    assert made.latency[2] == pytest.approx(0.01) and (made.latency[:2] > 0.015).all()
    plain = pooled(BUDGET, [calm, restless], 3, corrects=False)
    assert plain is not None and plain.multiplier == 1.0 and plain.latency == pytest.approx([0.01] * 3)


def test_a_fold_that_cannot_be_assessed_leaves_nothing():
    assert pooled(BUDGET, [fold([0.5] * 10), HeldOut.unusable("too few runs")], 2, corrects=True) is None
    assert pooled(BUDGET, [], 0, corrects=True) is None


def test_the_rate_after_the_choice_of_the_luckiest_limit_meets_the_budget():
    """Of 40 candidates the one with the lowest limit is chosen: its rate is too high, and is not once corrected."""
    rng = np.random.default_rng(5)
    budget, runs, candidates = Budget.parse("1/20op"), 60, 40
    plain, corrected = [], []
    for _ in range(150):
        critical = rng.gumbel(size=(candidates, runs))
        folds = np.arange(runs) % 5

        def limits(inside, critical=critical):
            kept = np.sort(critical[:, inside], axis=1)[:, ::-1]
            return kept[:, max(budget.allowed(float(inside.sum())), 0)] + 5.0  # above 0, so that ratios mean something

        held = []
        for number in range(5):
            own = limits(folds != number)
            chosen = int(np.argmin(own))
            held.append(fold((critical[chosen, folds == number] + 5.0) / own[chosen]))
        every = limits(np.ones(runs, dtype=bool))
        limit = every.min()
        multiple = MULTIPLIERS[correction(budget, held)]
        plain.append(-np.expm1(-np.exp(-(limit - 5.0))))
        corrected.append(-np.expm1(-np.exp(-(multiple * limit - 5.0))))
    assert np.mean(plain) > 0.075 and np.mean(corrected) < 0.06
