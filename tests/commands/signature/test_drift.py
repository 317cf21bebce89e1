"""The audit of a season: drift, local growth, steps, and the runs left."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cdtool.alarms.pipeline import judge_alone
from cdtool.base.errors import SignatureError
from cdtool.commands.signature.coverage import check_coverage
from cdtool.commands.signature.drift import audit_drift
from cdtool.commands.signature.upkeep import advice
from cdtool.commands.signature.words import verdicts
from cdtool.detectors.detection import Status
from cdtool.results.curves.sweep import critical_factor
from cdtool.thresholds.signature import Signature
from tests.commands.signature.seasons import ACTIVATION, learned, season

FREE = season(20, seed=100)
FITTED = learned(FREE)


def audited(change=None, count: int = 40, seed: int = 1, **settings: object):
    signature = learned(FREE, **settings) if settings else FITTED
    return audit_drift(signature, season(count, change, seed), ACTIVATION)


def near(travel: np.ndarray, place: float) -> np.ndarray:
    """Return 1 within 3 cm of a position, measured 1 cm after the start of the motion."""
    return (np.abs(travel - place - 0.01) < 0.03).astype(float)


def test_a_steady_season_shows_nothing():
    found = audited()
    (joint,) = found.joints
    assert not found.drifts and not found.alarms
    (line,) = verdicts(joint)
    assert line.startswith("no drift shown at a level of 1 %: ") and " spreads per run (" in line
    assert advice(None, found) == "keep the signature"


def test_a_drift_of_the_whole_stroke_is_reported_with_its_slope():
    (joint,) = audited(lambda number, _: 0.04 * number).joints
    assert joint.local is None
    slope = joint.overall.course.trend.slope
    spread = float(np.nanmedian(FITTED.by_travel.band(True)[1]))
    assert slope.low < 0.04 / spread < slope.high
    (line,) = verdicts(joint)
    assert line.startswith("drifts by +0.0") and line.endswith("): relearn")


def test_a_local_growth_is_reported_with_its_location_and_not_as_a_whole_drift():
    found = audited(lambda number, travel: 0.1 * number * near(travel, 0.40))
    (joint,) = found.joints
    assert joint.overall is None and joint.local.outward
    assert joint.local.place == pytest.approx(0.40, abs=0.021)
    assert any(line.startswith(("grows at 0.4", "grows at 0.3")) for line in verdicts(joint))
    assert verdicts(joint)[-1].endswith("inspect the machine there before relearning")
    assert advice(None, found).startswith("inspect the machine at 0.")
    assert joint.runs[-1].local_at == pytest.approx(0.40, abs=0.041)
    assert joint.runs[-1].local > 3.0 > abs(joint.runs[-1].overall)


def test_a_step_is_reported_with_its_run():
    (joint,) = audited(lambda number, _: 1.5 * (number >= 25)).joints
    assert joint.overall.course.kind == "step" and joint.overall.course.step.run == 25
    (line,) = [line for line in verdicts(joint) if "step" in line]
    assert line.startswith("step of +1.") and "at run 26 (run25): if something was changed then" in line
    (place,) = audited(lambda number, travel: 3.0 * (number >= 25) * near(travel, 0.3)).joints
    (line,) = [line for line in verdicts(place) if "step" in line]
    assert "at run 26 (run25) at 0." in line and "before relearning" in line


def test_one_sided_a_drift_away_from_the_limit_is_named():
    (joint,) = audited(lambda number, _: -0.05 * number).joints
    assert not joint.overall.outward
    assert "drifts away from the limit by -0.0" in verdicts(joint)[0] and "detected later" in verdicts(joint)[0]
    (place,) = audited(lambda number, travel: -0.1 * number * near(travel, 0.4)).joints
    assert place.local is None


def test_each_run_has_its_critical_factor_and_its_alarm():
    late = season(12, lambda number, travel: 9.0 * (number == 7) * near(travel, 0.4), 3)
    found = audit_drift(FITTED, late, ACTIVATION)
    (joint,) = found.joints
    for run, (operation, signal) in zip(joint.runs, late, strict=True):
        detection = judge_alone(operation, "", signal, (FITTED,), ACTIVATION)
        assert run.critical_factor == pytest.approx(critical_factor(detection, ACTIVATION))
        assert run.margin_used == pytest.approx(run.critical_factor / 5.5)
        assert run.alarm == (detection.verdict.outcome == "alarm")
    assert found.alarms == (7,) and joint.runs[7].local_at == pytest.approx(0.4, abs=0.03)
    assert verdicts(joint)[0] == "an alarm in 1 of 12 runs, first in run 8 (run7)"
    assert advice(None, found) == "analyse the alarms with cdtool explain: no drift is shown"


def test_joints_are_audited_separately():
    def doubled(pairs, offset):
        made = []
        for number, (operation, signal) in enumerate(pairs):
            rng = np.random.default_rng(1000 + number)
            second = 50.0 + rng.normal(size=len(signal.time)) + offset * number
            values = np.column_stack((signal.values[:, 0], second))
            status = np.zeros(values.shape, dtype=np.uint8)
            made.append((operation, replace(signal, values=values, status=status, joints=("a", "b"))))
        return made

    signature = learned(doubled(FREE, 0.0))
    first, second = audit_drift(signature, doubled(season(40, None, 5), 0.05), ACTIVATION).joints
    assert (first.joint, second.joint) == ("a", "b")
    assert not first.shown and second.overall.outward
    assert second.runs[-1].critical_factor > 1.5 * first.runs[-1].critical_factor


def test_few_runs_show_nothing_and_an_unassessable_run_is_named():
    late = season(9, lambda number, _: 0.5 * number)
    late[4][1].status[:] = Status.NOT_APPLICABLE
    found = audit_drift(FITTED, late, ACTIVATION)
    assert found.names == tuple(f"run{i}" for i in range(9) if i != 4)
    ((name, reason),) = found.not_assessable
    assert name == "run4" and "not applicable" in reason
    assert "8 runs: too few to show a drift; at least 10 are required" in verdicts(found.joints[0])
    with pytest.raises(SignatureError, match=r"no run to compare with the signature.*not applicable"):
        audit_drift(FITTED, [late[4]], ACTIVATION)


def test_too_few_runs_are_reported_unless_it_must_be_relearned():
    wanting = check_coverage(season(12, together=2.5), Signature(sides="one", safety_factor=3.0), ACTIVATION)
    assert not wanting.enough
    assert "safety factor" in advice(wanting, None)
    assert advice(wanting, audited(lambda number, _: 0.05 * number)) == "relearn from the latest runs"
    assert advice(check_coverage(FREE, Signature(sides="one"), ACTIVATION), None) == "keep the signature"


def test_two_sided_a_drift_to_the_middle_is_named():
    found = audited(lambda number, _: 2.0 - 0.045 * number, sides="two")
    (joint,) = found.joints
    assert not joint.overall.outward
    assert verdicts(joint)[-1].startswith("drifts back towards the middle of the band by -0.0")
    assert advice(None, found) == "keep the signature"
