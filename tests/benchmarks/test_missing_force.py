"""Missing load-cell samples on a dozen random contacts; benchmarks/missing_force.py uses 200."""

from __future__ import annotations

import sys
from types import ModuleType

import pytest

from tests.project.pages import benchmark_script


@pytest.fixture(scope="module")
def script() -> ModuleType:
    return benchmark_script("missing_force")


def test_no_hole_causes_an_unmarked_wrong_onset_or_an_unmeasured_pass(script):
    counts, wrong = script.score(31, 12, 12)
    assert wrong == []
    assert sum(count.marked for count in counts.values()) > 10
    assert counts["single samples"].passes > 5 and counts["single samples"].marked == 0


def test_wrong_answers_are_reported(script, monkeypatch, capsys):
    monkeypatch.setattr(script, "is_wrong", lambda found, _: found.hole > 0.0)
    monkeypatch.setattr(sys, "argv", ["missing_force.py", "--seeds", "31", "--contacts", "3", "--faults", "6"])
    assert script.main() == 1
    assert "onset" in capsys.readouterr().out
