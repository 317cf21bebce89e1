"""The queries of docs/many-recordings.md run with DuckDB, on results of the sample logs and of a fleet of doors."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import pytest

from cdtool.commands.score.score_triggers import score
from cdtool.report.outputs import write_outputs
from cdtool.report.writers.base import Report
from cdtool.results.evaluated import evaluate
from cdtool.results.results import Results
from tests.synthetic.many_results import many_results

duckdb = pytest.importorskip("duckdb", reason="duckdb is absent: the documented queries were not run")

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "many-recordings.md").read_text(encoding="utf-8")
QUERIES = re.findall(r"```sql\n(.*?)```", PAGE, re.DOTALL)
SLOWER, BY_GROUP, MISSED_BY_ALL, FALSE_ALARMS, STEPS = range(5)


def asked(results: Results, number: int, folder: Path, monkeypatch: pytest.MonkeyPatch) -> list[dict[str, object]]:
    """Return the rows of a documented query over results."""
    monkeypatch.chdir(folder)
    write_outputs(Report(evaluate(results)), [Path("results.parquet")])
    with duckdb.connect() as connection:
        found = connection.execute(QUERIES[number])
        names = [column[0] for column in found.description]
        return [dict(zip(names, row, strict=True)) for row in found.fetchall()]


@pytest.mark.parametrize("number", range(5))
def test_it_runs_on_results_of_the_sample_logs(number, tmp_path, monkeypatch):
    done = score(ROOT / "docs" / "examples" / "triggers.csv", ROOT / "sample_logs" / "gate" / "benchmark.toml")
    rows = asked(done.evaluated.results, number, tmp_path, monkeypatch)
    if number == BY_GROUP:
        shown = {(row["group"], row["detector"]): row["missed"] for row in rows}
        assert shown == {(item.group, item.detector): item.missed for item in done.evaluated.summaries if item.contacts}


def test_the_door_that_got_slower_is_the_first(tmp_path, monkeypatch):
    results = many_results(900)
    last_month = max(item.recording.split("/")[2][:7] for item in results.recordings)

    def slowed(item):
        is_slow = "/door-07/" in item.recording and last_month in item.recording and item.latency_ms is not None
        return replace(item, latency_ms=item.latency_ms + 500.0) if is_slow else item

    results = replace(results, contacts=tuple(map(slowed, results.contacts)))
    rows = asked(results, SLOWER, tmp_path, monkeypatch)
    assert {row["door"] for row in rows[:2]} == {"door-07"} and rows[0]["slower_by_ms"] > 300.0
    assert {f"{row['month']:%Y-%m}" for row in rows} == {last_month}


def test_a_contact_that_every_detector_missed_is_found(tmp_path, monkeypatch):
    results = many_results(3000)
    missed = [item.recording for item in results.contacts if item.outcome == "missed"]
    by_all = {name for name in missed if missed.count(name) == 2}
    rows = asked(results, MISSED_BY_ALL, tmp_path, monkeypatch)
    assert by_all and {row["recording"] for row in rows} == by_all


def test_the_step_that_is_exceeded_most_is_the_first(tmp_path, monkeypatch):
    results = many_results(900)
    failed = [step for item in results.forces for step in item.steps if step.verdict == "fail"]
    rows = asked(results, STEPS, tmp_path, monkeypatch)
    assert rows[0]["exceeded_by_n"] == max(step.peak_n - step.at_most_n for step in failed)
