"""The search of rules and gains, on measurements that are known: what is chosen, and by which recordings."""

from __future__ import annotations

import math

import numpy as np
import pytest

from cdtool.commands.tune.search.candidate import Candidate, Measured
from cdtool.commands.tune.search.grid import rules_to_try
from cdtool.commands.tune.search.objective import Goal, Objective
from cdtool.commands.tune.search.search import search
from cdtool.commands.tune.search.tuned import sensitivities_of
from cdtool.detectors.momentum import Momentum
from cdtool.thresholds.cusum import Cusum
from cdtool.thresholds.glr import Glr
from cdtool.thresholds.limit import Limit
from tests.commands.tune.search.recordings import measured, tuning_recordings

RECORDINGS = tuning_recordings()
DEFAULT = Candidate.of(Momentum(), Limit())
GRID = [Candidate(DEFAULT.gains, rule) for rule in (Glr(order=4), Glr(order=12), Cusum())]


def run(latency_of, recordings=RECORDINGS):
    asked: list[Candidate] = []

    def measure(candidates):
        asked.extend(candidates)
        return [latency_of(item) for item in candidates]

    objective = Objective(Goal.LATENCY, recordings)
    return search(DEFAULT, GRID, ("bandwidth",), objective, measure), asked


def by_rule(values, bandwidth=10.0):
    """Return latencies by rule, least at a bandwidth."""

    def latency_of(candidate):
        rule = candidate.rule
        name = f"{rule.name}{rule.order}" if rule.name == "glr" else rule.name
        stiff, soft = values[name]
        factor = 1.0 + 0.09 * abs(math.log2(dict(candidate.gains)["bandwidth"] / bandwidth))
        return measured(RECORDINGS, factor * np.repeat([stiff, soft], 10))

    return latency_of


VALUES = {"limit": (0.03, 0.07), "glr4": (0.02, 0.06), "glr12": (0.012, 0.055), "cusum": (0.011, 0.2)}


def test_the_best_acceptable_rule_is_chosen_and_its_gain_tuned():
    found, _ = run(by_rule(VALUES, bandwidth=20.0))
    assert found.best.candidate.rule == Glr(order=12)
    assert dict(found.best.candidate.gains)["bandwidth"] == 20.0
    # cusum would be faster for stiff contacts, but makes soft ones much worse than by default.
    assert [item.best.candidate for item in found.subsets] == [found.best.candidate] * 6


def test_nothing_is_measured_twice():
    _, asked = run(by_rule(VALUES, bandwidth=20.0))
    assert len({item.key for item in asked}) == len(asked)


def test_a_fold_that_likes_another_rule_does_not_choose_for_itself():
    """In fold 0, limit is the fastest by far; without fold 0 it is not, and with it, it is."""

    def latency_of(candidate):
        values = np.full(20, 0.03)
        if candidate.rule.name == "limit":
            values = np.where(RECORDINGS.fold_of == 0, 1e-4, 0.035)
        return measured(RECORDINGS, values)

    found, _ = run(latency_of)
    assert found.best.candidate.rule.name == "limit"
    assert found.subsets[1].best.candidate.rule.name != "limit"


def test_a_candidate_that_cannot_be_used_is_left_out():
    def latency_of(candidate):
        if candidate.rule.name == "glr":
            return Measured.unusable("too few samples")
        return by_rule(VALUES)(candidate)

    found, _ = run(latency_of)
    assert found.best.candidate.rule.name == "limit"


def test_the_sensitivity_shows_the_flat_part_and_the_edge():
    found, _ = run(by_rule(VALUES, bandwidth=20.0))
    by_name = {item.name: item for item in sensitivities_of(found, found.best, [9], ("bandwidth",))}
    bandwidth = by_name["bandwidth"]
    assert bandwidth.chosen == 20.0 and bandwidth.flat_from < 20.0 < bandwidth.flat_to < 40.0
    assert not bandwidth.is_at_edge and not by_name["debounce"].is_at_edge
    far, _ = run(by_rule(VALUES, bandwidth=1e6))
    by_name = {item.name: item for item in sensitivities_of(far, far.best, [9], ("bandwidth",))}
    assert by_name["bandwidth"].is_at_edge


def test_rules_are_tried_with_their_settings_where_their_channels_exist():
    rules = rules_to_try([Cusum(), Glr(order=7), Limit()], ["torque", "speed", "position"])
    assert len([rule for rule in rules if rule.name == "cusum"]) == 8  # the default is one of the grid
    assert [rule.order for rule in rules if rule.name == "glr"] == [7, 4, 12]
    assert rules_to_try([Cusum(), Limit()], ["torque"]) == [Limit()]


FIVE = tuning_recordings(contacts=5)


def latencies(stiff: float, soft: float) -> np.ndarray:
    return np.repeat([stiff, soft], 5)


def test_the_score_is_the_mean_of_the_logarithms_of_the_groups():
    objective = Objective(Goal.LATENCY, FIVE)
    costs = objective.costs(measured(FIVE, latencies(0.01, 0.09)), 0, 0)
    assert costs == pytest.approx([0.01, 0.09])
    assert math.exp(objective.score(costs)) == pytest.approx(0.03)


def test_no_group_may_get_much_worse_than_by_default():
    objective = Objective(Goal.LATENCY, FIVE)
    default = np.array([0.03, 0.07])
    assert objective.is_acceptable(np.array([0.01, 0.0769]), default)
    assert not objective.is_acceptable(np.array([0.01, 0.0771]), default)
    assert Objective(Goal.LATENCY, FIVE, worse_at_most=1.0).is_acceptable(np.array([0.01, 0.139]), default)
    assert objective.is_acceptable(np.array([0.5, 0.5]), np.array([np.nan, np.nan]))


def test_the_95th_percentile_and_the_force_are_other_goals():
    values = np.concatenate((np.linspace(0.01, 0.05, 5), np.full(5, 0.1)))
    made = measured(FIVE, values)
    assert Objective(Goal.P95, FIVE).costs(made, 0, 0) == pytest.approx([0.048, 0.1])
    assert Objective(Goal.FORCE, FIVE).costs(made, 0, 0) == pytest.approx([30.0, 100.0])
