"""Reports of very many recordings: the worst and the failed cases are listed, and how many there are."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from xml.etree import ElementTree

import pytest

from cdtool.report import cases, many
from cdtool.report.cases import suites_of
from cdtool.report.html.page import to_html
from cdtool.report.html.plots import CLASSES, MOST_STEPS, plot_data
from cdtool.report.many import is_many
from cdtool.report.writers.base import Report
from cdtool.report.writers.junit import to_junit
from cdtool.results.evaluated import evaluate
from tests.report.html.html_case import case
from tests.report.many import COUNT, LIMITS, report_of_many
from tests.synthetic.many_results import many_results


@pytest.fixture(scope="module", autouse=True)
def lowered() -> Iterator[None]:
    """Fewer recordings than in practice are many, so that the tests are quick."""
    with pytest.MonkeyPatch.context() as patch:
        for name, value in LIMITS.items():
            patch.setattr(many, name, value)
        for name, value in (("MOST_CASES", 250), ("MOST_OF_KIND", 40)):
            patch.setattr(cases, name, value)
        yield


@pytest.fixture(scope="module")
def report() -> Report:
    return report_of_many()


@pytest.fixture(scope="module")
def rows(report) -> list[dict[str, str]]:
    """The listed cases."""
    table = report.model.tables["cases"]
    headings = [column.heading for column in table.columns]
    return [{name: cell.text for name, cell in zip(headings, row, strict=True)} for row in table.rows]


def listed(rows: list[dict[str, str]], outcome: str) -> list[dict[str, str]]:
    return [row for row in rows if row["outcome"] == outcome]


def test_few_recordings_are_all_listed():
    assert not is_many(case()[0].results) and not is_many(many_results(LIMITS["MOST_RECORDINGS"]))
    assert is_many(many_results(LIMITS["MOST_RECORDINGS"] + 1))
    tables = Report(*case()).model.tables
    assert "recordings" in tables and "forces" in tables and "cases" not in tables
    assert all(not table.more for table in tables.values())


def test_of_many_the_failed_cases_are_listed_by_detector_and_group(report, rows):
    results = report.evaluated.results
    assert "recordings" not in report.model.tables and "forces" not in report.model.tables
    assert 400 < len(rows) < 3000
    missed = Counter((item.group, item.detector) for item in results.contacts if item.outcome == "missed")
    shown = Counter((row["group"], row["detector"]) for row in listed(rows, "missed"))
    assert shown == {pair: min(count, 100) for pair, count in missed.items()}
    assert len(listed(rows, "force limits exceeded")) == sum(item.verdict == "fail" for item in results.forces) > 10
    assert {row["recording"] for row in listed(rows, "false alarm")} == {
        item.recording for item in results.false_alarms
    }


def test_the_slowest_of_each_detector_and_group_are_listed_slowest_first(report, rows):
    latencies = [
        item.latency_ms
        for item in report.evaluated.results.contacts
        if (item.group, item.detector) == ("soft", "momentum") and item.latency_ms is not None
    ]
    slowest = [
        row for row in listed(rows, "among the slowest") if (row["group"], row["detector"]) == ("soft", "momentum")
    ]
    assert len(slowest) == 100
    assert [float(row["latency [ms]"]) for row in slowest] == pytest.approx(sorted(latencies)[:-101:-1], rel=0.01)


def test_the_page_is_small_and_has_histograms_instead_of_marks(report):
    text = to_html(report)
    assert len(text.encode()) < 4e6 and 'data-table="cases-table"' in text
    data = plot_data(report)
    assert data["recordings"] == []
    for panel in data["latency"]:
        assert len(panel["edges"]) == CLASSES + 1 and panel["edges"] == sorted(panel["edges"])
        for row in panel["rows"]:
            name = report.evaluated.results.detectors[row["detector"]]
            (item,) = [
                item for item in report.evaluated.summaries if (item.detector, item.group) == (name, panel["group"])
            ]
            assert sum(row["numbers"]) == item.detected > 200
    for panel in data["survival"]:
        assert all(len(row["times"]) <= MOST_STEPS for row in panel["rows"])


def test_a_suite_of_many_recordings_lists_what_failed_and_counts_the_others():
    report = report_of_many(limit=True)
    (suite,) = [suite for suite in suites_of(report.evaluated) if suite.name == "momentum.stiff"]
    missed = [
        item.recording
        for item in report.evaluated.results.contacts
        if (item.group, item.detector, item.outcome) == ("stiff", "momentum", "missed")
    ]
    assert [item.name for item in suite.cases if item.kind == "failure"] == missed
    (passed,) = [item for item in suite.cases if not item.kind]
    others = len([item for item in suite.cases if item.kind])
    assert passed.name == f"{COUNT // 3 - others} that passed"
    root = ElementTree.fromstring(to_junit(report))
    assert int(root.attrib["failures"]) == len(list(root.iter("failure"))) > 0


def test_more_failures_than_are_listed_are_one_failure(report):
    results = report.evaluated.results
    missed = tuple(replace(row, outcome="missed", latency_ms=None) for row in results.contacts)
    made = evaluate(replace(results, contacts=missed))
    (suite,) = [suite for suite in suites_of(made) if suite.name == "momentum.stiff"]
    assert {item.kind for item in suite.cases} == {"failure"} and len(suite.cases) == cases.MOST_OF_KIND + 1
    assert suite.cases[-1].name == f"{COUNT // 3 - cases.MOST_OF_KIND} more that fail"
