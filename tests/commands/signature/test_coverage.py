"""Coverage: runs checked against all others, the probability of the next alarm, and sections without a limit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cdtool.alarms.pipeline import judge_alone
from cdtool.base.errors import SignatureError, UsageError
from cdtool.commands.signature.coverage import check_coverage
from cdtool.detectors.detection import Status
from cdtool.results.curves.sweep import critical_factor
from cdtool.statistics.prediction import prediction_of
from cdtool.thresholds.signature import Signature
from tests.commands.signature.seasons import ACTIVATION, learned, season

RULE = Signature(sides="one")
RUNS = season(14)


@pytest.mark.parametrize("alignment", ["time", "position", "time_then_position"])
def test_removing_a_run_equals_learning_from_the_others(alignment):
    rule = replace(RULE, alignment=alignment)
    bare = [(item.recording, found) for item, found in RUNS]
    whole = rule.fit(bare)
    for index in (0, 7, 13):
        without, refitted = whole.without_run(*bare[index]), rule.fit(bare[:index] + bare[index + 1 :])
        for one, other in ((without.by_time, refitted.by_time), (without.by_travel, refitted.by_travel)):
            np.testing.assert_allclose(one.count, other.count)
            np.testing.assert_allclose(one.mean, other.mean, atol=1e-9)
            np.testing.assert_allclose(one.squares, other.squares, atol=1e-7)


def test_each_run_has_the_critical_factor_that_a_signature_of_the_others_gives_it():
    found = check_coverage(RUNS, RULE, ACTIVATION)
    assert [run.name for run in found.runs] == [item.name for item, _ in RUNS]
    for index in (2, 9):
        fitted = learned(RUNS[:index] + RUNS[index + 1 :])
        expected = critical_factor(judge_alone(*_judged(index, fitted)), ACTIVATION)
        assert found.runs[index].critical_factor == pytest.approx(expected, rel=1e-9)
    prediction = prediction_of([run.critical_factor for run in found.runs])
    assert found.chance == prediction.chance_above(5.5)
    assert prediction.chance_above(found.factor_needed) == pytest.approx(1e-3, rel=0.01)


def _judged(index: int, fitted):
    operation, signal = RUNS[index]
    return operation, "", signal, (fitted,), ACTIVATION


def test_a_run_unlike_the_others_alarms_when_it_is_left_out_though_not_when_it_was_learned():
    odd = season(14, lambda number, travel: 4.0 * (number == 5) * (np.abs(travel - 0.4) < 0.03))
    whole = learned(odd, safety_factor=3.0)
    assert judge_alone(odd[5][0], "", odd[5][1], (whole,), ACTIVATION).verdict.outcome == "no alarm"
    found = check_coverage(odd, replace(RULE, safety_factor=3.0), ACTIVATION)
    assert [run.name for run in found.runs if run.alarm] == ["run5"]
    assert found.alarms == 1 and not found.enough


def test_a_section_without_a_limit_is_reported_with_location_and_share_of_runs():
    blind = season(14)
    for _, signal in blind[:5]:
        signal.status[2400:2600] = Status.GAP
    gap, *others = check_coverage(blind, RULE, ACTIVATION).gaps
    travel = blind[0][0].recording["position"].values[:, 0]
    assert gap.axis == "travel" and gap.share == pytest.approx(9 / 14)
    # The first sample after it counts for the last two grid points before it.
    assert gap.start == pytest.approx(travel[2400] - travel[402], abs=0.003)
    assert gap.end == pytest.approx(travel[2600] - travel[402] - 2 * 0.002, abs=0.003)
    assert "valid in at most 64 % of the runs; 80 % are required" in gap.described
    assert not others


def test_too_few_runs_and_an_invalid_target_are_refused():
    with pytest.raises(SignatureError, match="2 runs to check against the others"):
        check_coverage(RUNS[:2], replace(RULE, force=True), ACTIVATION)
    with pytest.raises(SignatureError, match="9 impact-free runs"):
        check_coverage(RUNS[:9], RULE, ACTIVATION)
    for target in (0.0, 1.0, float("nan")):
        with pytest.raises(UsageError, match="target is"):
            check_coverage(RUNS, RULE, ACTIVATION, target)
