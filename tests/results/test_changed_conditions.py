"""Changed conditions: compared with the unchanged machine, and counted nowhere else."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from cdtool.base.errors import ConfigurationError
from cdtool.base.settings import Place
from cdtool.report.model import report_model
from cdtool.results.changed_conditions import condition_rows
from cdtool.results.evaluated import evaluate
from cdtool.results.files.results_file import read_results, to_json
from cdtool.results.limits import Bounds, limit_rules
from cdtool.results.results import (
    ConditionResult,
    ContactResult,
    ExposureResult,
    FalseAlarmResult,
    Results,
)
from tests.bits import every_value
from tests.synthetic.builds import MISSED, contact

NAMES = ("momentum", "pure_torque")
WINTER = (
    ConditionResult("winter/holdout", "winter", "holdout", True),
    ConditionResult("winter/stiff", "winter", "stiff", False),
    ConditionResult("worn/holdout", "worn", "holdout", True),
)


def contacts(group: str, detector: str, outcomes: list[float | str]) -> list[ContactResult]:
    return [contact(f"{group}/{n}.csv", group, detector, item, 5.0, 100.0) for n, item in enumerate(outcomes)]


def alarms(group: str, detector: str, *operations: int) -> list[FalseAlarmResult]:
    return [FalseAlarmResult(f"{group}/{number}.csv", group, detector, "gate", 1.0) for number in operations]


UNCHANGED = Results(
    {},
    NAMES,
    ("stiff", "holdout"),
    (
        *contacts("stiff", "momentum", [10.0 + number for number in range(12)]),
        *contacts("stiff", "pure_torque", [30.0, 31.0, MISSED]),
    ),
    tuple(alarms("holdout", "pure_torque", 3)),
    tuple(
        ExposureResult(group, name, 12, 12, 0.1, not_judged={"at standstill": 0.25})
        for group in ("stiff", "holdout")
        for name in NAMES
    ),
)
BOTH = replace(
    UNCHANGED,
    contacts=(
        *UNCHANGED.contacts,
        *contacts("winter/stiff", "momentum", [20.0 + number for number in range(12)]),
        *contacts("winter/stiff", "pure_torque", [MISSED, MISSED]),
    ),
    false_alarms=(*UNCHANGED.false_alarms, *alarms("winter/holdout", "momentum", 0, 0, 1, 2)),
    exposure=(
        *UNCHANGED.exposure,
        *(ExposureResult("winter/holdout", name, 8, 8, 0.1, 2, {"at standstill": 0.5}) for name in NAMES),
        *(ExposureResult("winter/stiff", name, 12, 12, 0.1) for name in NAMES),
        ExposureResult("worn/holdout", "momentum", 4, 4, 0.0, 4, {"outside the learned speed": 1.0}),
    ),
    conditions=WINTER,
)


def test_conditions_change_nothing_in_the_results_of_the_unchanged_machine():
    alone, both = evaluate(UNCHANGED), evaluate(BOTH)
    assert every_value(both.summaries) == every_value(alone.summaries)
    assert every_value(both.comparisons) == every_value(alone.comparisons)
    assert both.results.conclusion == alone.results.conclusion
    one, other = report_model(alone), report_model(both)
    assert (other.counts, other.headline) == (one.counts, one.headline)
    assert all(other.tables[name] == one.tables[name] for name in ("best", "results", "all_results"))


def test_a_row_has_each_result_with_that_of_the_unchanged_machine():
    momentum, torque, worn, unscored = condition_rows(evaluate(BOTH))
    assert (momentum.detector, momentum.condition) == ("momentum", "winter")
    # Two of the eight operations were nowhere assessable; an operation with two alarms is one that alarms.
    assert momentum.changed.alarming == (3, 6) and momentum.unchanged.alarming == (0, 12)
    assert torque.changed.alarming == (0, 6) and torque.unchanged.alarming == (1, 12)
    assert momentum.changed.alarming_share.value == 0.5
    changed, before, statistic = momentum.latency("stiff")
    assert statistic == "mean" and before is not None
    assert (changed.value, before.value) == (pytest.approx(25.5), pytest.approx(15.5))
    assert torque.latency("stiff")[2] == "median"
    assert torque.changed.missed == (2, 2) and torque.unchanged.missed == (1, 3)
    # 8 operations of the hold-out with a half and 12 of the impacts with nothing.
    assert momentum.changed.not_assessable_share == pytest.approx(0.2)
    assert momentum.unchanged.not_assessable_share == pytest.approx(0.25)
    assert worn.changed.alarming == (0, 0) and worn.changed.not_assessable_share == 1.0
    assert math.isnan(worn.changed.alarming_share.value) and not worn.changed.struck
    assert math.isnan(unscored.changed.not_assessable_share)


def limits(text: str, largest: float):
    groups = (*BOTH.groups, *(item.group for item in WINTER))
    place = Place("b.toml", "limits.")
    found = limit_rules({text: Bounds(max=largest)}, place, [(name, name) for name in NAMES], groups)
    place.finish()
    return found


def test_a_limit_is_about_a_condition_only_if_it_names_it():
    every = evaluate(BOTH, limits("momentum.false_alarms", 0)).results
    assert [(item.group, item.outcome) for item in every.limits] == [("stiff", "met"), ("holdout", "met")]
    winter = evaluate(BOTH, limits("momentum.winter/holdout.false_alarms", 2)).results
    assert [(item.group, item.value, item.outcome) for item in winter.limits] == [("winter/holdout", 4.0, "violated")]
    assert winter.conclusion.outcome == "violated" and winter.conclusion.exit_status == 1
    with pytest.raises(ConfigurationError, match=r"unknown group 'winter/hold'.*"):
        limits("momentum.winter/hold.false_alarms", 2)


def test_results_files_carry_them_and_those_without_are_read(tmp_path):
    file = tmp_path / "results.json"
    file.write_text(to_json(BOTH), encoding="utf-8")
    assert read_results(file) == BOTH
    text = to_json(UNCHANGED)
    older = text.replace(' "conditions": [],\n', "")
    assert older != text
    file.write_text(older, encoding="utf-8")
    assert read_results(file) == UNCHANGED
