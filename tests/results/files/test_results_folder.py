"""results.parquet: all rows, with what belongs to them, and back; nothing else is read or replaced."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

import cdtool
from cdtool.base.errors import RecordingError, UsageError
from cdtool.report.outputs import check_outputs, write_outputs
from cdtool.report.writers.base import Report
from cdtool.results.evaluated import evaluate
from cdtool.results.files.reading import load_report
from cdtool.results.files.results_file import read_results, to_json
from cdtool.results.results import Results
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


@pytest.mark.parametrize("name", ["notes.txt", "contacts/notes.txt", "more/a.parquet"])
def test_a_folder_with_anything_else_is_not_replaced(name, tmp_path):
    target = written(FULL, tmp_path)
    (target / name).parent.mkdir(exist_ok=True)
    (target / name).write_text("mine", encoding="utf-8")
    for force in (False, True):
        with pytest.raises(UsageError, match="contains no results"):
            check_outputs([target], force=force)
    assert (target / name).read_text(encoding="utf-8") == "mine"


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


def test_without_pyarrow_one_line_says_what_to_install(tmp_path, monkeypatch):
    for name in ("pyarrow", "pyarrow.parquet"):
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(UsageError, match="Parquet needs pyarrow") as refused:
        check_outputs([tmp_path / "results.parquet"])
    assert "pip install '.[store]'" in str(refused.value.hint)
