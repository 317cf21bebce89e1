"""The recordings that contribute to a violated limit."""

from __future__ import annotations

import pytest

from cdtool.results.evaluated import evaluate
from cdtool.results.limits import LimitRule
from cdtool.results.recording_outcomes import (
    FALSE_ALARMS,
    FORCES_AT_ALARM,
    MEANS,
    MISSES,
    QUANTILES,
    RecordingOutcome,
    recording_outcomes,
)
from cdtool.results.results import (
    ContactResult,
    ExposureResult,
    FalseAlarmResult,
    ForceResult,
    RecordingResult,
    Results,
)
from cdtool.results.summary import FIGURES


def contact(name: str, latency: float | None, outcome: str = "detected", force: float | None = None) -> ContactResult:
    alarm = None if latency is None else 5.0 + 1e-3 * latency
    watched = {"reason": "standing still" if outcome == "not_assessable" else None, "watched_ms": 1000.0}
    return ContactResult(name, "stiff", "gm", "gate", 5.0, 0.001, alarm, latency, outcome, force, 600.0, **watched)


RESULTS = Results(
    provenance={},
    detectors=("gm", "pt"),
    groups=("stiff", "holdout"),
    contacts=(
        contact("quick", 20.0, force=100.0),
        contact("steady", 21.0, force=160.0),
        contact("slow", 60.0, force=300.0),
        contact("late", None, "missed"),
        contact("blind", None, "not_assessable"),
    ),
    false_alarms=(FalseAlarmResult("cut", "holdout", "gm", "gate", 1.0, operation=2),),
    exposure=(ExposureResult("stiff", "gm", 6, 6, 0.01), ExposureResult("holdout", "gm", 2, 4, 0.5)),
    recordings=(
        *(
            RecordingResult(name, "stiff", "", 7.0, 1, 1)
            for name in ("quick", "steady", "slow", "late", "blind", "lost")
        ),
        *(RecordingResult(name, "holdout", "", 7.0, 2, 0) for name in ("cut", "calm")),
    ),
    forces=(ForceResult("slow", "stiff", 1, "gap", "fail", 600.0, ()),),
)


def outcomes(rule: LimitRule | None = None) -> dict[tuple[str, str], RecordingOutcome]:
    results = evaluate(RESULTS, [rule]).results if rule else RESULTS
    return {(item.detector, item.recording): item for item in recording_outcomes(results)}


def failing(figure: str, largest: float) -> set[str]:
    group = "holdout" if figure in FALSE_ALARMS else "stiff"
    rule = LimitRule(f"gm.{group}.{figure}", "gm", group, figure, largest=largest)
    assert evaluate(RESULTS, [rule]).results.limits[0].outcome == "violated"
    return {name for (_, name), item in outcomes(rule).items() if item.breaks}


@pytest.mark.parametrize("figure", sorted(name for name in QUANTILES if not name.endswith("_upper")))
def test_a_limit_on_a_quantile_is_violated_by_latencies_above_it_and_by_misses(figure):
    assert failing(figure, 30.0) == {"slow", "late"}


@pytest.mark.parametrize("figure", sorted(FALSE_ALARMS))
def test_a_limit_on_false_alarms_is_violated_by_the_log_that_has_one(figure):
    assert failing(figure, 0.0) == {"cut"}


@pytest.mark.parametrize("figure", sorted(FORCES_AT_ALARM))
def test_a_limit_on_the_force_at_the_alarm_is_violated_by_forces_above_it(figure):
    assert failing(figure, 150.0) == {"steady", "slow"}


def test_other_limits_are_violated_by_what_they_count():
    assert failing("peak_force_n", 500.0) == {"quick", "steady", "slow", "late", "blind"}
    assert failing("force_failed", 0.0) == {"slow"}
    assert failing("not_assessable", 0.0) == {"blind"}
    rule = LimitRule("gm.stiff.detected", "gm", "stiff", "detected", least=4)
    assert {name for (_, name), item in outcomes(rule).items() if item.breaks} == {"late", "blind"}


def test_every_quantity_is_attributed_to_recordings_or_listed_as_not():
    counted = MEANS | QUANTILES | MISSES | FALSE_ALARMS | FORCES_AT_ALARM
    counted |= {"peak_force_n", "force_failed", "not_assessable", "detected", "clipped", "in_progress"}
    assert set(FIGURES) - counted == {"std_ms", "contacts", "operations", "hours"}
    assert counted <= set(FIGURES)
    for figure in ("std_ms", "contacts", "operations"):
        assert failing(figure, 0.001) == set()


def test_a_detector_without_results_differs_from_one_without_alarms():
    found = outcomes()
    assert found["gm", "blind"].is_not_assessable and not found["gm", "late"].is_not_assessable
    assert found["gm", "lost"].is_not_assessable and not found["gm", "lost"].judged
    assert not found["gm", "calm"].is_not_assessable
    assert found["pt", "calm"].is_not_assessable, "it did not run in the hold-out"


@pytest.mark.parametrize("figure", sorted(name for name in MEANS | QUANTILES if name.endswith("_upper")))
def test_a_limit_on_an_interval_of_few_contacts_is_violated_by_no_recording(figure):
    rule = LimitRule(f"gm.stiff.{figure}", "gm", "stiff", figure, largest=30.0)
    assert evaluate(RESULTS, [rule]).results.limits[0].outcome == "not_assessable"
    assert not any(item.breaks for item in outcomes(rule).values())
