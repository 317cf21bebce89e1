"""Alarms with known causes on two simulated machines; benchmarks/explain_causes.py uses five and 100 alarms."""

from __future__ import annotations

from types import ModuleType

import pytest

from tests.project.pages import benchmark_script


@pytest.fixture(scope="module")
def script() -> ModuleType:
    module = benchmark_script("explain_causes")
    two = (module.benches()[1], module.benches()[2])
    module.benches = lambda: two
    return module


def test_causes_and_first_movers_of_a_dozen_alarms_are_right(script):
    told = script.score(70, 12)
    assert {item.case.cause for item in told} == set(script.CAUSES)
    causes, first = script.right(told)
    assert causes >= 11 and first >= 11, [(item.case.cause, item.cause, item.first) for item in told]


def test_a_score_below_the_bar_exits_with_1(script, capsys):
    (case,) = script.score(70, 1)
    wrong = script.Told(script.replace(case.case, cause="lost samples"), case.explanation)
    assert not script.report(70, [wrong])
    assert "right: 0 of 1 causes" in capsys.readouterr().out
