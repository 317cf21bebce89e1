"""What is minimised, and the share by which a group may get worse."""

from __future__ import annotations

import math

import numpy as np
import pytest

from cdtool.commands.tune.search.objective import Goal, Objective
from tests.commands.tune.search.recordings import measured, tuning_recordings

RECORDINGS = tuning_recordings(contacts=5)


def latencies(stiff: float, soft: float) -> np.ndarray:
    return np.repeat([stiff, soft], 5)


def test_the_score_is_the_mean_of_the_logarithms_of_the_groups():
    objective = Objective(Goal.LATENCY, RECORDINGS)
    costs = objective.costs(measured(RECORDINGS, latencies(0.01, 0.09)), 0, 0)
    assert costs == pytest.approx([0.01, 0.09])
    assert math.exp(objective.score(costs)) == pytest.approx(0.03)


def test_no_group_may_get_much_worse_than_by_default():
    objective = Objective(Goal.LATENCY, RECORDINGS)
    default = np.array([0.03, 0.07])
    assert objective.is_acceptable(np.array([0.01, 0.0769]), default)
    assert not objective.is_acceptable(np.array([0.01, 0.0771]), default)
    assert Objective(Goal.LATENCY, RECORDINGS, worse_at_most=1.0).is_acceptable(np.array([0.01, 0.139]), default)
    assert objective.is_acceptable(np.array([0.5, 0.5]), np.array([np.nan, np.nan]))


def test_the_95th_percentile_and_the_force_are_other_goals():
    values = np.concatenate((np.linspace(0.01, 0.05, 5), np.full(5, 0.1)))
    made = measured(RECORDINGS, values)
    assert Objective(Goal.P95, RECORDINGS).costs(made, 0, 0) == pytest.approx([0.048, 0.1])
    assert Objective(Goal.FORCE, RECORDINGS).costs(made, 0, 0) == pytest.approx([30.0, 100.0])
