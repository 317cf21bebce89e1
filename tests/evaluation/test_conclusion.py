"""The conclusion of a benchmark, identical in every report and the exit status."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import pytest

from cdtool.evaluation.evaluated import Evaluated, evaluate
from cdtool.evaluation.limits import LimitRule
from cdtool.evaluation.results import (
    SCHEMA_VERSION,
    ConclusionResult,
    ContactResult,
    ExposureResult,
    LimitResult,
    PointResult,
    RecordingFinding,
    Skipped,
)
from cdtool.evaluation.results_file import migrated, read_results, to_json
from cdtool.report.html.page import to_html
from cdtool.report.markdown.report import to_markdown
from cdtool.report.writers.base import Report
from cdtool.report.writers.junit import to_junit
from tests.command import cdtool
from tests.evaluation.judged_results import GATE, results
from tests.synthetic.builds import MISSED, NOT_ASSESSABLE, build_results

MET = LimitRule("*.false_alarms", "*", "*", "false_alarms", largest=0)


def averaged(verdict: str, name: str = "A") -> PointResult:
    return PointResult(name, "stiff", GATE, 3, verdict, (), "mean of 3 tests", None if verdict == "pass" else "why not")


def reports(evaluated: Evaluated) -> tuple[str, str, ElementTree.Element, dict]:
    report = Report(evaluated)
    junit = ElementTree.fromstring(to_junit(report).encode())
    stored = json.loads(to_json(evaluated.results))["conclusion"]
    return to_html(report), to_markdown(report), junit, stored


CASES = {
    "all good": (results([40.0] * 4, ["pass"] * 4), "met", 0, "met by 4 contacts", "good", 0, 0),
    "four fail": (results([40.0] * 4, ["fail"] * 4), "violated", 1, "violated by 4 of 4 contacts", "bad", 4, 0),
    "one fails": (results([40.0] * 4, ["pass"] * 3 + ["fail"]), "violated", 1, "violated by 1 of 4", "bad", 1, 0),
    "one missed": (
        results([40.0] * 3 + [MISSED], ["pass"] * 4),
        "violated",
        1,
        "1 detection missed under",
        "bad",
        1,
        0,
    ),
    "partly unseen": (
        results([40.0] * 4, ["pass"] * 3 + ["not_assessable"]),
        "not_assessable",
        4,
        "not assessable for 1 of 4 contacts",
        "unknown",
        0,
        1,
    ),
    "all unseen": (
        results([40.0] * 4, ["not_assessable"] * 4),
        "not_assessable",
        3,
        "not assessable for 4 of 4 contacts",
        "unknown",
        0,
        4,
    ),
    "fail before unseen": (
        results([40.0] * 2, ["not_assessable", "fail"]),
        "violated",
        1,
        "violated by 1 of 2 contacts",
        "bad",
        1,
        1,
    ),
    "no force at all": (
        replace(results([40.0] * 2, ["pass"] * 2), forces=()),
        "not_assessable",
        3,
        "not assessable for 2 of 2 contacts",
        "unknown",
        0,
        2,
    ),
    "a blind detector": (
        results([NOT_ASSESSABLE] * 3, ["pass"] * 3),
        "not_assessable",
        3,
        "nothing could be assessed",
        "unknown",
        0,
        3,
    ),
    "a point decides": (
        results([40.0] * 3, ["pass", "pass", "fail"], "A", [averaged("pass")]),
        "met",
        0,
        "met by 1 test point",
        "good",
        0,
        0,
    ),
    "a point fails": (
        results([40.0] * 3, ["pass", "pass", "fail"], "A", [averaged("fail")]),
        "violated",
        1,
        "violated by 1 of 1 test point",
        "bad",
        1,
        0,
    ),
    "too few tests": (
        results([40.0] * 3, ["pass"] * 3, "A", [averaged("not_assessable"), averaged("pass", "B")]),
        "not_assessable",
        4,
        "not assessable for 1 of 2 test points",
        "unknown",
        0,
        1,
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_force_misses_and_unassessable_contacts_count_the_same_everywhere(name, tmp_path: Path):
    made, outcome, status, words, tone, failures, errors = CASES[name]
    evaluated = evaluate(made, [MET])
    conclusion = evaluated.results.conclusion
    assert (conclusion.outcome, conclusion.exit_status) == (outcome, status)
    assert words in conclusion.headline and "all 1 limits" not in conclusion.headline
    html, markdown, junit, stored = reports(evaluated)
    head = conclusion.headline
    assert f'<p class="verdict {tone}"><strong>{head[:1].upper()}{head[1:]}</strong>' in html
    assert markdown.startswith(f"# Collision detection: {head}\n")
    assert stored["outcome"] == outcome and stored["exit_status"] == status and stored["headline"] == head
    assert (int(junit.attrib["failures"]), int(junit.attrib["errors"])) == (failures, errors)
    file = tmp_path / "results.json"
    file.write_text(to_json(evaluated.results), encoding="utf-8")
    done = cdtool("report", file)
    assert done.status == status
    assert " ".join(done.out.split()).startswith(head)
    for reason in conclusion.reasons:
        assert " ".join(reason.split()) in " ".join(done.out.split())


def test_limits_met_are_not_a_pass_while_contacts_fail_at_3600_n():
    evaluated = evaluate(results([40.0] * 4, ["fail"] * 4), [MET])
    assert [item.outcome for item in evaluated.results.limits] == ["met"]
    head = evaluated.results.conclusion.headline
    assert head == "force profile violated by 4 of 4 contacts; the limit is met"
    (reason,) = evaluated.results.conclusion.reasons
    assert reason.startswith(
        f"force, stiff, {GATE}: violated by 4 of 4 contacts; first stiff/00.csv, contact 1: dynamic"
    )


@pytest.mark.parametrize(("allowed", "status"), [(1, 0), (0, 1)])
def test_a_limit_on_misses_decides_about_them_where_there_is_one(allowed, status):
    made = results([40.0] * 3 + [MISSED], ["pass"] * 4)
    evaluated = evaluate(made, [LimitRule("*.missed", "*", "*", "missed", largest=allowed)])
    assert evaluated.results.conclusion.exit_status == status
    assert evaluated.results.conclusion.missed_without_limit == 0


def test_without_profile_and_limit_a_miss_is_named_without_a_violation():
    for limits, outcome in (((), "not_asked"), ((MET,), "met")):
        evaluated = evaluate(results([40.0] * 3 + [MISSED]), limits)
        conclusion = evaluated.results.conclusion
        assert (conclusion.outcome, conclusion.exit_status) == (outcome, 0)
        assert "1 detection missed without a limit" in conclusion.headline
        assert 'class="verdict unknown"' in to_html(Report(evaluated))
        assert 'failures="0"' in to_junit(Report(evaluated))


def test_a_limit_without_measurements_is_not_met():
    made = results([NOT_ASSESSABLE] * 3)
    evaluated = evaluate(made, [LimitRule("*.p95_ms", "*", "*", "p95_ms", largest=50.0)])
    assert [item.outcome for item in evaluated.results.limits] == ["not_assessable"]
    conclusion = evaluated.results.conclusion
    assert conclusion.exit_status == 1 and conclusion.headline.startswith("1 of 1 limit not met (1 not assessable)")
    assert conclusion.facts == ("limit_violated", "nothing_assessable")


def test_a_detector_without_an_assessable_impact_free_operation_has_assessed_nothing():
    made = replace(
        build_results({}, holdout=["momentum"]),
        exposure=(ExposureResult("holdout", "momentum", 4, 4, 0.0, 4, {"standing still": 1.0}),),
    )
    conclusion = evaluate(made).results.conclusion
    assert conclusion.exit_status == 3 and conclusion.headline.startswith("nothing could be assessed")
    assert conclusion.reasons == ("momentum, holdout: none of 4 operations could be assessed: standing still 100 %",)


def test_reasons_for_unassessable_contacts_are_named():
    made = results([NOT_ASSESSABLE] * 3)
    made = replace(made, contacts=tuple(replace(item, reason="the axis stands still") for item in made.contacts))
    assert evaluate(made).results.conclusion.reasons == (
        "momentum, stiff: none of 3 contacts could be assessed: the axis stands still",
    )


def test_what_was_left_out_is_3_and_a_violation_comes_first():
    left_out = (Skipped("a.csv", "empty file"),)
    assert evaluate(replace(results([40.0] * 2), skipped=left_out)).results.conclusion.exit_status == 3
    both = evaluate(replace(results([40.0] * 2, ["fail"] * 2), skipped=left_out)).results.conclusion
    assert both.exit_status == 1 and both.facts == ("force_violated", "left_out")


def test_a_recording_of_which_a_part_is_lost_is_3_and_was_not_left_out():
    findings = (RecordingFinding("a.csv", "its end is cut off", "loss"), RecordingFinding("b.csv", "a gap"))
    conclusion = evaluate(replace(results([40.0] * 2), findings=findings)).results.conclusion
    assert conclusion.exit_status == 3 and conclusion.facts == ("lost",)
    assert evaluate(replace(results([40.0] * 2), findings=findings[1:])).results.conclusion.exit_status == 0


def test_files_of_version_2_are_read_with_their_words_changed(tmp_path):
    made = evaluate(results([40.0] * 2, ["not_assessable", "pass"], "A", [averaged("not_assessable")]), [MET]).results
    limits = (LimitResult("a", "momentum", "stiff", "missed", 1.0, None, 0.0, "violated", "1 is more"), *made.limits)
    made = replace(made, limits=limits, conclusion=ConclusionResult())
    old = json.loads(to_json(made).replace(': "not_assessable"', ': "not assessable"').replace('"met"', '"kept"'))
    old["limits"][0]["outcome"] = "broken"
    del old["conclusion"]
    old["schema_version"] = 2
    path = tmp_path / "old.json"
    path.write_text(json.dumps(old), encoding="utf-8")
    read = read_results(path)
    assert replace(read, provenance=made.provenance) == made and read.schema_version == SCHEMA_VERSION
    assert migrated(old)["limits"][0]["outcome"] == "violated"
    assert cdtool("report", path).status == 1
    old["schema_version"] = 1
    path.write_text(json.dumps(old), encoding="utf-8")
    done = cdtool("report", path)
    assert done.status == 2 and done.err.count("\n") == 1
    assert f"this version of cdtool reads 2, 3 and {SCHEMA_VERSION}" in done.err


def test_contacts_keep_their_spelling_in_the_data():
    made: ContactResult = results([NOT_ASSESSABLE]).contacts[0]
    assert made.outcome == "not_assessable"
