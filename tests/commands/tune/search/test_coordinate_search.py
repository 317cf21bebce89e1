"""The search of gains, on costs whose optimum is known."""

from __future__ import annotations

import math

import pytest

from cdtool.commands.tune.search.candidate import Candidate
from cdtool.commands.tune.search.coordinate_search import EVALUATIONS, CoordinateSearch, movable_gains
from cdtool.detectors.friction_ekf import FrictionEkf
from cdtool.detectors.inertial_momentum import InertialMomentum
from cdtool.detectors.momentum import Momentum
from cdtool.thresholds.limit import Limit

START = Candidate.of(InertialMomentum(), Limit())
NAMES = ("bandwidth", "crossover")


def run(cost, start=START, names=NAMES):
    search = CoordinateSearch(start, cost(start), names)
    asked = []
    while wanted := search.ask():
        asked += wanted
        search.tell({item.key: cost(item) for item in wanted})
    return search, asked


def bowl(**optimum):
    def cost(candidate):
        gains = dict(candidate.gains)
        return sum(math.log2(gains[name] / value) ** 2 for name, value in optimum.items())

    return cost


@pytest.mark.parametrize("optimum", [{"bandwidth": 40.0, "crossover": 2.5}, {"bandwidth": 3.0, "crossover": 30.0}])
def test_it_comes_close_to_the_optimum_with_few_evaluations(optimum):
    search, asked = run(bowl(**optimum))
    for name, value in optimum.items():
        assert abs(math.log2(dict(search.best.gains)[name] / value)) <= 0.5
    assert len(asked) <= EVALUATIONS and len({item.key for item in asked}) == len(asked)


def test_gains_per_joint_move_together():
    start = Candidate.of(Momentum(bandwidth=(80.0, 60.0)), Limit())
    assert dict(start.with_gain("bandwidth", 2.0).gains)["bandwidth"] == (160.0, 120.0)
    search, _ = run(lambda item: abs(math.log(dict(item.gains)["bandwidth"][0] / 320.0)), start, ("bandwidth",))
    assert dict(search.best.gains)["bandwidth"] == (320.0, 240.0)


def test_what_belongs_to_sensors_or_decides_where_the_method_applies_is_not_searched():
    detector = FrictionEkf()
    names = movable_gains(detector, Candidate.of(detector, Limit()))
    assert names == ("sigma_acceleration", "friction_drift")
