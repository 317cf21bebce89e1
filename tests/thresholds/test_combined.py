"""Several thresholds as one."""

from __future__ import annotations

import numpy as np
import pytest

from cdtool.base.errors import UsageError
from cdtool.thresholds.combined import Combined
from cdtool.thresholds.limit import Limit
from cdtool.thresholds.trend import Trend
from tests.thresholds.strokes import STILL, TIME, N, noise_runs, signal, stroke


@pytest.fixture(scope="module")
def members():
    pairs = noise_runs(12)
    return Limit().fit(pairs), Trend().fit(pairs)


def outside(threshold, values):
    statistic, band = threshold.evaluate(STILL, signal(values))
    return ((statistic.values > band.upper) | (statistic.values < band.lower)) & statistic.valid


@pytest.mark.parametrize(("activation", "joined"), [("any", np.logical_or), ("all", np.logical_and)])
def test_it_alarms_where_any_or_all_of_its_members_do(members, activation, joined):
    combined = Combined(activation=activation).fit(noise_runs(12))
    values = 100.0 + np.random.default_rng(5).normal(size=N) + 30.0 * np.sin(40.0 * TIME) * (TIME > 2.0)
    ours = outside(combined, values)
    theirs = joined(*(outside(member, values) for member in members))
    assert theirs[100:].any() and not theirs[100:].all()
    np.testing.assert_array_equal(ours[100:], theirs[100:])


def test_any_judges_where_one_member_can_and_all_only_where_each_can():
    pairs = noise_runs(12)
    values = signal(np.full(N, 100.0))
    start_up = 60
    assert Combined(activation="any").fit(pairs).evaluate(STILL, values)[0].valid[:start_up].all()
    assert not Combined(activation="all").fit(pairs).evaluate(STILL, values)[0].valid[:start_up].any()


def test_with_a_member_of_a_class_it_belongs_to_that_class():
    rule = Combined(members=("limit", "cusum"))
    assert rule.by_class and not Combined().by_class and Combined(sides="one").by_class
    assert rule.fit(noise_runs(12)).motion.direction == 1
    assert Combined().fit(noise_runs(12)).motion is None
    statistic, _ = rule.fit(noise_runs(12)).evaluate(stroke(), signal(np.full(N, 100.0)))
    assert statistic.unit == "1"


def test_members_that_are_not_known_or_too_few_are_refused():
    with pytest.raises(UsageError, match="did you mean trend"):
        Combined(members=("limit", "trent"))
    with pytest.raises(UsageError, match="two or more"):
        Combined(members=("limit",))
    with pytest.raises(UsageError, match="activation is 'some'"):
        Combined(activation="some")
