"""A detection with changed limits gives the same result as matching with these limits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from cdtool.alarms.activation import Activation
from cdtool.base.errors import UsageError
from cdtool.recordings.recording import Contact
from cdtool.results.curves.false_alarm_budget import Budget, set_factor
from cdtool.results.curves.sweep import MULTIPLES, critical_factor, sweep
from cdtool.thresholds.limit import FittedLimit
from cdtool.truth.matching import match
from tests.results.detections import ACTIVATION, detection


@pytest.mark.parametrize(
    "activation",
    [ACTIVATION, Activation(3, 0.2, hysteresis=0.4), Activation(3, latch=True)],
    ids=["plain", "hysteresis", "latch"],
)
@pytest.mark.parametrize("seed", range(6))
def test_each_step_is_what_matching_says_with_those_limits(seed, activation):
    contacts = [Contact(3.0, 3.2, 0.005), Contact(6.0, 6.1, 0.005)]
    factors = 3.0 * MULTIPLES
    swept = sweep(detection(seed, activation=activation), contacts, activation, 1.0, factors)
    assert swept.false_alarms[0] > 0 and swept.false_alarms[-1] == 0
    for i, factor in enumerate(factors):
        moved = detection(seed, float(factor), activation)
        matching = match(moved.verdict, contacts, moved.statistic, 1.0, rearm=activation.wait)
        assert len(matching.false_alarms) == swept.false_alarms[i]
        np.testing.assert_allclose([item.latency for item in matching.matches], swept.latency[i])


@pytest.mark.parametrize("seed", range(6))
def test_above_the_critical_factor_there_is_no_alarm_and_below_it_there_is_one(seed):
    critical = critical_factor(detection(seed), ACTIVATION)
    assert detection(seed, critical * 1.000001).verdict.outcome == "no alarm"
    assert detection(seed, critical * 0.999999).verdict.outcome == "alarm"


@pytest.mark.parametrize(
    ("text", "rate", "per", "shown"),
    [
        ("1/1000op", 1e-3, "operation", "1/1000op"),
        ("0.002/op", 2e-3, "operation", "1/500op"),
        ("1/8h", 0.125, "hour", "1/8h"),
        (" 2 / hour ", 2.0, "hour", "2/h"),
        ("1e-3/operations", 1e-3, "operation", "1/1000op"),
    ],
)
def test_budgets_are_read(text, rate, per, shown):
    budget = Budget.parse(text)
    assert (budget.rate, budget.per, str(budget)) == (pytest.approx(rate), per, shown)


def test_the_factor_is_the_smallest_that_meets_the_budget_per_operation():
    runs = [detection(seed) for seed in range(20)]
    made = set_factor(Budget(0.1, "operation"), "d", runs, ACTIVATION)
    critical = sorted((critical_factor(run, ACTIVATION) for run in runs), reverse=True)
    assert made.factor == pytest.approx(critical[1], rel=1e-8) and made.alarms == 1
    alarming = [detection(seed, made.factor).verdict.outcome == "alarm" for seed in range(20)]
    assert sum(alarming) == 1 and made.operations == 20


def test_the_factor_meets_a_budget_per_hour_and_a_smaller_one_violates_it():
    runs = [detection(seed) for seed in range(20)]
    hours = sum(run.assessed_seconds for run in runs) / 3600.0
    budget = Budget(4.5 / hours, "hour")
    made = set_factor(budget, "d", runs, ACTIVATION)

    def alarms(factor: float) -> int:
        return sum(len(detection(seed, factor).verdict.alarms) for seed in range(20))

    assert alarms(made.factor) == made.alarms <= 3 < alarms(made.factor * 2.0 ** (-1.5 / 32))


def test_limits_without_spread_cannot_be_set():
    stuck = FittedLimit((0.0,), (0.0,), (0.0,), (0.0,), safety_factor=3.0)
    runs = []
    for seed in range(4):
        found = detection(seed)
        assert found.judgement is not None
        runs.append(replace(found, judgement=replace(found.judgement, thresholds=(stuck,))))
    with pytest.raises(UsageError, match="no spread"):
        set_factor(Budget(0.5, "operation"), "d", runs, ACTIVATION)


def test_a_budget_with_a_confidence_is_met_that_often():
    """The rate above the c-th largest of n is distributed as beta(c, n + 1 - c)."""
    budget = Budget.parse("1/20op at 90%")
    for n in (45, 120, 700):
        met = [stats.beta.cdf(0.05, c + 1, n - c) for c in (budget.allowed(float(n)), budget.allowed(float(n)) + 1)]
        assert met[0] >= 0.90 > met[1]
    assert budget.needed == 45.0 and budget.allowed(45.0) == 0 and budget.allowed(44.0) == -1


@pytest.mark.parametrize("text", ["1/100op at 20%", "1/100op at 100%", "1/100op at", "1/100op at x%", "3/op at 95%"])
def test_a_wrong_confidence_is_refused(text):
    with pytest.raises(UsageError, match="false-alarm budget is"):
        Budget.parse(text)
    assert str(Budget.parse("1/100op at 95%")) == "1/100op at 95%"


def test_a_budget_by_hours_with_a_confidence_allows_fewer_alarms():
    budget = Budget.parse("0.1/h at 95%")
    assert budget.needed == pytest.approx(29.957, abs=1e-3)
    assert (budget.allowed(29.9), budget.allowed(30.0), Budget.parse("0.1/h").allowed(30.0)) == (-1, 0, 2)
    assert budget.allowed(200.0) < Budget.parse("0.1/h").allowed(200.0)
