"""JUnit XML: a failure exactly where a limit is not met, readable by every XML 1.0 parser whatever the names."""

from __future__ import annotations

import re
from dataclasses import replace
from xml.etree import ElementTree

import pytest

from cdtool.report.writers.base import Report
from cdtool.report.writers.junit import to_junit
from cdtool.results.evaluated import Evaluated, evaluate
from cdtool.results.limits import LimitRule, not_met
from cdtool.results.results import RecordingFinding, Results, Skipped
from tests.report.hostile import HOSTILE
from tests.report.html.html_case import case as benchmark

# What Jenkins' schema allows; it refuses a file with another attribute.
ALLOWED = {
    "testsuites": {"name", "time", "tests", "failures", "errors"},
    "testsuite": {"name", "time", "tests", "failures", "errors", "skipped"},
    "testcase": {"name", "classname", "time"},
    "failure": {"type", "message"},
    "error": {"type", "message"},
    "skipped": {"type", "message"},
    "system-out": set(),
}
# The characters of XML 1.0.
VALID = re.compile("[\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]*")


def read(evaluated: Evaluated) -> ElementTree.Element:
    """The root, after checking that it is what Jenkins takes and that its counts are right."""
    text = to_junit(Report(evaluated))
    assert VALID.fullmatch(text)
    root = ElementTree.fromstring(text.encode("utf-8"))
    for element in root.iter():
        assert set(element.attrib) <= ALLOWED[element.tag]
        assert element.get("time", "0") == "0"
    for suite in (root, *root):
        assert int(suite.attrib["tests"]) == len(list(suite.iter("testcase")))
        for key, kind in (("failures", "failure"), ("errors", "error"), ("skipped", "skipped")):
            assert suite.tag == "testsuites" or int(suite.attrib[key]) == len(list(suite.iter(kind)))
    assert int(root.attrib["failures"]) == len(list(root.iter("failure")))
    assert int(root.attrib["errors"]) == len(list(root.iter("error")))
    return root


def case(root: ElementTree.Element, suite: str, name: str) -> ElementTree.Element:
    (found,) = [item for item in root.iter("testcase") if (item.get("classname"), item.get("name")) == (suite, name)]
    return found


def rule(figure: str, largest: float, detector: str = "momentum", group: str = "stiff") -> LimitRule:
    return LimitRule(f"{detector}.{group}.{figure}", detector, group, figure, largest=largest)


def test_every_recording_is_a_case_of_every_detector(evaluated):
    root = read(evaluated)
    assert [suite.get("name") for suite in root] == [
        "conclusion",
        "left out",
        "friction_ekf.stiff",
        "momentum.stiff",
        "friction_ekf.soft",
        "momentum.soft",
        "friction_ekf.holdout",
        "momentum.holdout",
    ]
    assert [len(suite) for suite in root] == [1, 1, 4, 4, 30, 30, 40, 40]


def test_what_could_not_be_assessed_is_skipped_with_the_reason(evaluated):
    root = read(evaluated)
    skipped = case(root, "friction_ekf.stiff", "stiff/04.csv").find("skipped")
    assert skipped is not None and skipped.get("message") == "not assessable: standing still"
    silent = case(root, "friction_ekf.holdout", "holdout/01.csv").find("skipped")
    assert silent is not None and silent.get("message") == "not assessable: the detector gave no result"


def test_a_limit_is_a_case_and_what_violates_it_fails_with_it(results):
    root = read(evaluate(results, [rule("missed", 0), rule("mean_ms", 80), rule("false_alarms", 0, group="holdout")]))
    suite = root[1]
    assert (suite.get("name"), suite.get("tests"), suite.get("failures")) == ("limits", "3", "2")
    violated = case(root, "limits", "momentum.stiff.missed (momentum, stiff)").find("failure")
    assert violated is not None
    assert violated.get("message") == "violated: missed is 1; required: at most 0; 1 is more than 0"
    assert violated.text == violated.get("message")
    met = case(root, "limits", "momentum.stiff.mean_ms (momentum, stiff)")
    assert met.find("failure") is None and met.findtext("system-out") == "mean_ms is 65; required: at most 80"
    failing = {
        (item.get("classname"), item.get("name")): failure.get("message")
        for item in root.iter("testcase")
        if item.get("classname") not in ("conclusion", "limits") and (failure := item.find("failure")) is not None
    }
    assert failing == {
        ("momentum.stiff", "stiff/03.csv"): "contact 1 is missed (momentum.stiff.missed: at most 0)",
        (
            "momentum.holdout",
            "holdout/01.csv",
        ): "false alarm at 1.000 s on gate (momentum.holdout.false_alarms: at most 0)",
    }


@pytest.mark.parametrize("largest", [0.0, 0.5, 1.0, 50.0, 1e9])
@pytest.mark.parametrize(
    "figure", ["missed", "p95_ms", "std_ms", "mean_ms_upper", "peak_force_n", "hours", "not_assessable"]
)
def test_there_are_failures_exactly_where_a_limit_is_not_met(results, figure, largest):
    evaluated = evaluate(results, [rule(figure, largest, "*")])
    assert bool(list(read(evaluated).iter("failure"))) == bool(not_met(evaluated.results.limits))


def test_nothing_scored_is_one_error_and_never_an_empty_file():
    root = read(evaluate(Results({}, (), (), (), (), ())))
    assert (root.get("tests"), root.get("errors")) == ("2", "1")
    left_out = read(evaluate(Results({}, ("gm",), ("stiff",), (), (), (), skipped=(Skipped("a.csv", "empty"),))))
    assert (left_out.get("tests"), left_out.get("errors")) == ("3", "2")


def test_what_is_lost_of_a_recording_is_an_error_and_a_warning_is_none(results):
    findings = (RecordingFinding("a.csv", "its end is cut off", "loss"), RecordingFinding("b.csv", "a gap"))
    root = read(evaluate(replace(results, findings=findings)))
    error = case(root, "damaged", "a.csv").find("error")
    assert error is not None and error.get("message") == "damaged, used as far as it goes: its end is cut off"
    assert not [item for item in root.iter("testcase") if item.get("name") == "b.csv"]


@pytest.mark.parametrize("kind", HOSTILE)
def test_hostile_names_are_text_in_a_file_that_parses(kind):
    hostile = HOSTILE[kind]
    root = read(benchmark(lambda name: f"{hostile}{name}")[0])
    suites = {suite.get("name") for suite in root}
    assert {"conclusion", "limits", "force", "left out", "damaged"} < suites and len(suites) == 11
    assert not any(
        re.search("[\x00-\x1f\u202e\u2067]", value) for item in root.iter() for value in item.attrib.values()
    )


def test_no_name_is_an_attachment():
    text = to_junit(Report(benchmark(lambda name: f"[[[ATTACHMENT|/etc/{name}]]")[0]))
    shown = [item.text or "" for item in ElementTree.fromstring(text).iter() if item.tag != "testsuites"]
    assert any("ATTACHMENT" in item for item in shown)
    assert not any("[[" in item for item in shown)
