"""The markers of the tests: derived from what a test uses, and slow from a list of existing tests."""

from __future__ import annotations

import ast
from types import ModuleType

import pytest

from tests.markers import ROOT, markers_of, slow_tests
from tests.project import marker_samples
from tests.project.slow_tests import corrected, durations

REPORT = """<testsuites><testsuite name="pytest">
<testcase classname="tests.a.test_b" name="test_quick" time="0.1"/>
<testcase classname="tests.a.test_b" name="test_cases[1]" time="0.3"/>
<testcase classname="tests.a.test_b" name="test_cases[[2]]" time="0.4"/>
<testcase classname="tests.a.test_b" name="test_between" time="0.4"/>
<testcase classname="tests.a.test_b" name="test_absent" time="0.0"><skipped message="no data"/></testcase>
</testsuite></testsuites>"""


@pytest.mark.parametrize(
    ("function", "markers"),
    [
        ("starts_a_program", {"external"}),
        ("uses_a_fixture_that_starts_one", {"external"}),
        ("drives_a_browser", {"browser"}),
        ("starts_nothing", set()),
    ],
)
def test_a_marker_follows_from_what_a_test_and_its_fixtures_use(function, markers):
    assert markers_of("tests.project.marker_samples", function) == markers


def uses_another_module() -> object:
    return marker_samples.starts_a_program()


def names_a_module_that_it_does_not_use(script: ModuleType) -> object:
    return script.subprocess


def test_what_a_test_uses_of_another_module_of_the_tests_counts_too():
    assert markers_of(__name__, "uses_another_module") == {"external"}
    assert markers_of(__name__, "names_a_module_that_it_does_not_use") == frozenset()
    # Pytest's own fixtures are not analysed.
    assert markers_of("tests.project.marker_samples", "tmp_path") == frozenset()
    assert marker_samples.starts_nothing(ROOT) == ROOT


def test_every_test_that_is_listed_as_slow_exists():
    listed = slow_tests()
    assert listed == sorted(set(listed))
    files = {name.partition("::")[0] for name in listed}
    functions = {
        f"{file}::{node.name}"
        for file in files
        for node in ast.parse((ROOT / file).read_text(encoding="utf-8")).body
        if isinstance(node, ast.FunctionDef)
    }
    assert set(listed) <= functions, "tests/slow_tests.txt: correct the names of tests that were renamed"


def test_the_list_adds_tests_above_the_bound_and_drops_those_below_half(tmp_path):
    report = tmp_path / "times.xml"
    report.write_text(REPORT, encoding="utf-8")
    took = durations(report)
    names = {name.rpartition("::")[2]: name for name in took}
    assert took[names["test_cases"]] == pytest.approx(0.7) and took[names["test_absent"]] is None
    assert set(took) == {f"tests/a/test_b.py::{name}" for name in names}
    listed = [names["test_quick"], names["test_between"], names["test_absent"], "tests/a/test_b.py::test_gone"]
    stay = [names["test_absent"], names["test_between"]]
    assert corrected(listed, took, bound=0.5) == sorted([*stay, names["test_cases"]])
    assert corrected([], took, bound=0.5) == [names["test_cases"]]
