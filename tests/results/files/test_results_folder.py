"""results.parquet: all rows, with what belongs to them, and back; nothing else is read or replaced."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import pyarrow.parquet as pq
import pytest

import cdtool
from cdtool.base.errors import RecordingError, UsageError
from cdtool.report.outputs import check_outputs, write_outputs
from cdtool.report.writers.base import Report
from cdtool.results.evaluated import evaluate
from cdtool.results.files.reading import load_report
from cdtool.results.files.results_file import read_results, to_json
from cdtool.results.results import Results, tables
from cdtool.results.traces.file import encode_traces
from tests.report.html.html_case import case
from tests.results.full_results import FULL
from tests.synthetic.many_results import many_results


def written(results: Results, folder: Path) -> Path:
    target = folder / "results.parquet"
    write_outputs(Report(evaluate(results)), [target])
    return target


@pytest.mark.parametrize("made", [lambda: FULL, lambda: many_results(40), lambda: case()[0].results])
def test_the_same_results_are_read_back(made, tmp_path):
    results = made()
    assert to_json(read_results(written(results, tmp_path))) == to_json(evaluate(results).results)


def test_it_has_a_table_of_every_kind_of_rows_also_of_none(tmp_path):
    target = written(replace(FULL, sweep=(), skipped=()), tmp_path)
    assert {item.name for item in target.iterdir() if item.is_dir()} == set(tables())
    assert pq.read_table(target / "sweep" / "sweep.parquet").num_rows == 0
    names = set(pq.read_schema(target / "skipped" / "skipped.parquet").names)
    assert names == {"row", "recording", "reason"}


def test_each_group_and_detector_has_a_file_with_the_columns_of_its_recordings(tmp_path):
    results = many_results(30)
    results = replace(results, recordings=tuple(replace(item, campaign="monday") for item in results.recordings))
    target = written(results, tmp_path)
    files = {path.name for path in (target / "contacts").iterdir()}
    assert files == {f"{i:04d}-{group}.{name}.parquet" for i, (group, name) in enumerate(
        [(group, name) for group in ("stiff", "soft") for name in results.detectors])}  # fmt: skip
    rows = pq.read_table(target / "contacts" / "0000-stiff.momentum.parquet").to_pylist()
    of = {item.recording: item for item in results.recordings}
    for row in rows:
        assert row["began"].replace(tzinfo=UTC) == datetime.fromtimestamp(of[row["recording"]].began_s, tz=UTC)
        assert (row["machine"], row["campaign"], row["point"]) == ("door", "monday", None)
        assert results.contacts[row["row"]].latency_ms == row["latency_ms"]


def test_report_and_compare_read_the_folder_and_its_traces(tmp_path):
    evaluated, traces = case()
    target = tmp_path / "results.parquet"
    write_outputs(Report(evaluated, traces), [target])
    loaded, read, note = load_report(target)
    assert not note and encode_traces(read) == encode_traces(traces)
    assert loaded.summaries == evaluate(evaluated.results).summaries
    assert cdtool.compare(target, target).verdict == "no change shown"
    head = target / "provenance.json"
    head.write_text(head.read_text(encoding="utf-8").replace("9.8.7", "9.8.8"), encoding="utf-8")
    with pytest.raises(RecordingError, match="belongs to other results"):
        load_report(target)


def test_what_was_written_before_is_replaced_as_a_whole(tmp_path):
    written(many_results(30), tmp_path)
    target = written(FULL, tmp_path)
    assert [path.name for path in (target / "contacts").iterdir() if "soft" in path.name] == []
    assert read_results(target).detectors == FULL.detectors


@pytest.mark.parametrize("name", ["notes.txt", "contacts/notes.txt", "more/a.parquet"])
def test_a_folder_with_anything_else_is_not_replaced(name, tmp_path):
    target = written(FULL, tmp_path)
    (target / name).parent.mkdir(exist_ok=True)
    (target / name).write_text("mine", encoding="utf-8")
    for force in (False, True):
        with pytest.raises(UsageError, match="contains no results"):
            check_outputs([target], force=force)
    assert (target / name).read_text(encoding="utf-8") == "mine"


def test_another_folder_of_parquet_files_is_not_replaced(tmp_path):
    target = tmp_path / "results.parquet"
    (target / "contacts").mkdir(parents=True)
    with pytest.raises(UsageError, match="contains no results"):
        check_outputs([target])
    (target / "contacts").rmdir()
    check_outputs([target])


def break_table(target: Path) -> None:
    next((target / "contacts").iterdir()).write_bytes(b"PAR1 cut")


def break_version(target: Path) -> None:
    head = json.loads((target / "provenance.json").read_text(encoding="utf-8"))
    (target / "provenance.json").write_text(json.dumps({**head, "schema_version": 99}), encoding="utf-8")


def remove_table(target: Path) -> None:
    for path in (target / "exposure").iterdir():
        path.unlink()


def break_word(target: Path) -> None:
    head = (target / "provenance.json").read_text(encoding="utf-8")
    (target / "provenance.json").write_text(head[:-40], encoding="utf-8")


@pytest.mark.parametrize("damage", [break_table, break_version, remove_table, break_word])
def test_a_damaged_folder_is_refused_in_one_line(damage, tmp_path):
    target = written(FULL, tmp_path)
    damage(target)
    with pytest.raises(RecordingError, match=r"damaged, or not a results\.parquet") as refused:
        read_results(target)
    assert "\n" not in str(refused.value)


def test_a_folder_of_another_kind_is_refused(tmp_path):
    with pytest.raises(RecordingError, match=r"not a results\.parquet"):
        read_results(tmp_path)


def test_without_pyarrow_one_line_says_what_to_install(tmp_path, monkeypatch):
    for name in ("pyarrow", "pyarrow.parquet"):
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(UsageError, match="Parquet needs pyarrow") as refused:
        check_outputs([tmp_path / "results.parquet"])
    assert "pip install '.[store]'" in str(refused.value.hint)
