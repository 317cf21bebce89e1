"""The conclusion of a benchmark, identical in every report and the exit status."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import pytest
from markupsafe import escape

from cdtool.commands.scoring.benchmark_result import BenchmarkResult
from cdtool.report.html.page import to_html
from cdtool.report.markdown.report import to_markdown
from cdtool.report.writers.base import Report
from cdtool.report.writers.junit import to_junit
from cdtool.results.evaluated import Evaluated, evaluate
from cdtool.results.files.results_file import to_json
from cdtool.results.limits import LimitRule, unchecked
from cdtool.results.results import (
    CalibrationResult,
    ExposureResult,
    PointResult,
    RecordingFinding,
    Skipped,
)
from tests.command import cdtool
from tests.results.judged_results import GATE, results
from tests.synthetic.builds import MISSED, NOT_ASSESSABLE, build_results

MET = LimitRule("*.false_alarms", "*", "*", "false_alarms", largest=0)


def averaged(verdict: str, name: str = "A") -> PointResult:
    return PointResult(name, "stiff", GATE, 3, verdict, (), "mean of 3 tests", None if verdict == "pass" else "why not")


def reports(evaluated: Evaluated) -> tuple[str, str, ElementTree.Element, dict]:
    report = Report(evaluated)
    junit = ElementTree.fromstring(to_junit(report).encode())
    stored = json.loads(to_json(evaluated.results))["conclusion"]
    return to_html(report), to_markdown(report), junit, stored


TONES = {"met": "good", "violated": "bad", "not_assessable": "unknown"}
UNSEEN = "not_assessable"
A_POINT = (["pass", "pass", "fail"], "A")
# Results, outcome, exit status, words of the headline, failures and errors of JUnit without those of the conclusion.
CASES = {
    "all good": (results([40.0] * 4, ["pass"] * 4), "met", 0, "met by 4 contacts", 0, 0),
    "four fail": (results([40.0] * 4, ["fail"] * 4), "violated", 1, "violated by 4 of 4 contacts", 4, 0),
    "one fails": (results([40.0] * 4, ["pass"] * 3 + ["fail"]), "violated", 1, "violated by 1 of 4", 1, 0),
    "one missed": (results([40.0] * 3 + [MISSED], ["pass"] * 4), "violated", 1, "1 detection missed under", 1, 0),
    "partly unseen": (results([40.0] * 4, ["pass"] * 3 + [UNSEEN]), UNSEEN, 4, "for 1 of 4 contacts", 0, 1),
    "all unseen": (results([40.0] * 4, [UNSEEN] * 4), UNSEEN, 3, "not assessable for 4 of 4 contacts", 0, 4),
    "fail before unseen": (results([40.0] * 2, [UNSEEN, "fail"]), "violated", 1, "violated by 1 of 2 contacts", 1, 1),
    "no force at all": (replace(results([40.0] * 2, ["pass"] * 2), forces=()), UNSEEN, 3, "for 2 of 2 contacts", 0, 2),
    "a blind detector": (results([NOT_ASSESSABLE] * 3, ["pass"] * 3), UNSEEN, 3, "nothing could be assessed", 0, 3),
    "a point decides": (results([40.0] * 3, *A_POINT, [averaged("pass")]), "met", 0, "met by 1 test point", 0, 0),
    "a point fails": (results([40.0] * 3, *A_POINT, [averaged("fail")]), "violated", 1, "by 1 of 1 test point", 1, 0),
    "too few tests": (
        results([40.0] * 3, ["pass"] * 3, "A", [averaged(UNSEEN), averaged("pass", "B")]),
        UNSEEN,
        4,
        "not assessable for 1 of 2 test points",
        0,
        1,
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_force_misses_and_unassessable_contacts_count_the_same_everywhere(name, tmp_path: Path):
    made, outcome, status, words, failures, errors = CASES[name]
    tone = TONES[outcome]
    evaluated = evaluate(made, [MET])
    conclusion = evaluated.results.conclusion
    assert conclusion.outcome == outcome
    assert words in conclusion.headline and "all 1 limits" not in conclusion.headline
    junit = assert_same_everywhere(evaluated, tone, status, tmp_path)
    # The conclusion is a case of its own.
    assert (int(junit.attrib["failures"]), int(junit.attrib["errors"])) == (failures + (tone == "bad"), errors)


def assert_same_everywhere(evaluated: Evaluated, tone: str, status: int, folder: Path) -> ElementTree.Element:
    """Check that screen, HTML, Markdown, JUnit, JSON and Python open with one sentence in one colour."""
    conclusion, head = evaluated.results.conclusion, evaluated.results.conclusion.headline
    html, markdown, junit, stored = reports(evaluated)
    assert (conclusion.tone, conclusion.exit_status) == (tone, status)
    shown = str(escape(f"{head[:1].upper()}{head[1:]}"))
    assert f'<div class="verdict {tone}">\n<h1>{shown}</h1>' in html
    assert markdown.startswith(f"# Collision detection: {head}\n")
    assert (stored["tone"], stored["exit_status"], stored["headline"]) == (tone, status, head)
    first = junit.find("testsuite/testcase")
    assert first.get("name") == "conclusion" and first.findtext("system-out").splitlines()[0] == head
    assert [item.tag for item in first][:-1] == {"bad": ["failure"], "unknown": ["skipped"]}.get(tone, [])
    assert (int(junit.attrib["failures"]) > 0) == (status == 1)
    result = BenchmarkResult(evaluated)
    assert result.headline == head and head[:40] in repr(result) and f"<strong>{shown}</strong>" in result._repr_html_()
    file = folder / "results.json"
    file.write_text(to_json(evaluated.results), encoding="utf-8")
    done = cdtool("report", file)
    assert done.status == status and " ".join(done.out.split()).startswith(head)
    for reason in conclusion.reasons:
        assert " ".join(reason.split()) in " ".join(done.out.split())
    return junit


FREE = {"holdout": ["momentum"], "false_alarms": {("momentum", "holdout"): 24}}
LOST_PART = (RecordingFinding("a.csv", "its end is cut off", "loss"),)
SET = (CalibrationResult("momentum", "1/5op", 5.5, 40, 1.0, 7),)
ABSENT = unchecked([LimitRule("gm.missed", "gm", "*", "missed", largest=0)], ["momentum"], "benchmark.toml")
# Results, limits, protocol, colour, exit status, and the whole sentence.
WORST = {
    "a failed protocol before limits that are met": (
        results([40.0] * 4), [MET], ("fail", "test protocol: fail: limits exceeded at 1 of 2 points", "edge: 512 N"),
        "bad", 1, "test protocol: fail: limits exceeded at 1 of 2 points; the limit is met",
    ),
    "an incomplete protocol before limits that are met": (
        results([40.0] * 4), [MET], ("incomplete", "test protocol: incomplete"),
        "unknown", 4, "test protocol: incomplete; the limit is met",
    ),
    "a protocol that passes": (
        results([40.0] * 4), [], ("pass", "test protocol: pass"),
        "good", 0, "test protocol: pass; no limits are set",
    ),
    "false alarms before what is not assessable": (
        replace(results([NOT_ASSESSABLE] * 3, **FREE), detectors=("momentum",)), [], (),
        "unknown", 3,
        "24 false alarms without a limit; nothing could be assessed in 1 of 2 pairs of detector and group; "
        "no limits are set",
    ),
    "a limit decides about false alarms": (
        results([40.0] * 3, **FREE), [LimitRule("*.false_alarms", "*", "*", "false_alarms", largest=30)], (),
        "good", 0, "all 2 limits are met",
    ),
    "false alarms within a budget": (
        replace(results([40.0] * 3, holdout=["momentum"], false_alarms={("momentum", "holdout"): 8}), calibration=SET),
        [], (), "", 0, "no limits are set",
    ),
    "false alarms above a budget": (
        replace(results([40.0] * 3, **FREE), calibration=SET), [], (), "unknown", 0,
        "more false alarms than the budget: 24 of 40 runs alarm where 1/5op allows 8 "
        "(chance below 0.1 %); no limits are set",
    ),
    "limits of a detector that was not run": (
        replace(results([40.0] * 3), findings=tuple(ABSENT)), [], (), "", 0,
        "1 of 1 limits not checked (gm not run)",
    ),
    "limits of a detector that was not run before limits that are met": (
        replace(results([40.0] * 3), findings=tuple(ABSENT)), [MET], (), "", 0,
        "1 of 1 limits not checked (gm not run); the limit is met",
    ),
    "what was lost before limits that are met": (
        replace(results([40.0] * 3), findings=LOST_PART, skipped=(Skipped("b.csv", "empty"),)), [MET], (), "unknown", 3,
        "1 entry left out; data lost in 1 recording; the limit is met",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", WORST)
def test_every_surface_opens_with_the_worst_fact(name, tmp_path: Path):
    made, limits, protocol, tone, status, sentence = WORST[name]
    evaluated = evaluate(made, limits)
    evaluated = evaluated.with_protocol(*protocol) if protocol else evaluated
    assert evaluated.results.conclusion.headline == sentence
    assert_same_everywhere(evaluated, tone, status, tmp_path)


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


def test_what_was_left_out_is_3_and_a_violation_comes_first():
    left_out = (Skipped("a.csv", "empty file"),)
    assert evaluate(replace(results([40.0] * 2), skipped=left_out)).results.conclusion.exit_status == 3
    both = evaluate(replace(results([40.0] * 2, ["fail"] * 2), skipped=left_out)).results.conclusion
    assert both.exit_status == 1 and both.facts == ("force_violated", "left_out")
