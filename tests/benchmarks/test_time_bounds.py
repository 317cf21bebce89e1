"""benchmarks/time_bounds.py: the times recorded by tests, and their report."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests import noted_times

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


@pytest.fixture
def script(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    import time_bounds

    return time_bounds


def test_a_time_is_noted_where_a_file_is_named_and_nowhere_else(tmp_path, monkeypatch):
    file = tmp_path / "times.jsonl"
    monkeypatch.delenv(noted_times.FILE, raising=False)
    noted_times.note(1.0, 2.0)
    monkeypatch.setenv(noted_times.FILE, str(file))
    with pytest.raises(ValueError, match="a fault"), noted_times.noted(5.0):
        raise ValueError("a fault")
    (line,) = map(json.loads, file.read_text(encoding="utf-8").splitlines())
    assert line["bound"] == 5.0 and line["seconds"] >= 0.0
    assert line["test"].endswith("::test_a_time_is_noted_where_a_file_is_named_and_nowhere_else")


def test_the_time_nearest_to_its_bound_counts_and_the_worst_is_first(script):
    noted = [("a", 1.0, 5.0), ("b", 4.0, 3.0), ("a", 2.0, 5.0), ("a", 1.9, 4.0)]
    told = script.longest({"test": test, "seconds": seconds, "bound": bound} for test, seconds, bound in noted)
    assert told == [("b", 4.0, 3.0), ("a", 1.9, 4.0)]


def test_every_file_that_notes_times_is_run(script):
    files = script.files_that_note()
    assert "tests/commands/console/test_hostile_input.py" in files
    assert all((BENCHMARKS.parent / name).is_file() for name in files)


@pytest.mark.parametrize(("seconds", "status"), [(4.0, 0), (6.0, 1)])
def test_a_violated_bound_exits_with_1(script, monkeypatch, capsys, seconds, status):
    class Done:
        returncode = 0

    def run(command, *, env, **_):
        Path(env[noted_times.FILE]).write_text(json.dumps({"test": "a", "seconds": seconds, "bound": 5.0}) + "\n")
        return Done()

    monkeypatch.setattr(script.subprocess, "run", run)
    monkeypatch.setattr(script.sys, "argv", ["time_bounds.py"])
    assert script.main() == status
    assert ("FAIL" in capsys.readouterr().out) == bool(status)
