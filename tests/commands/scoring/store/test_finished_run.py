"""The results of a run are found again as a whole when nothing has changed, and only then."""

import math
import os
import shutil
from dataclasses import replace
from pathlib import Path

import pytest

import cdtool
from cdtool.commands.scoring.store.finished_run import FinishedRun, TraceKey
from cdtool.commands.scoring.store.stored_outcomes import StoredOutcomes
from cdtool.execution.store.finished import finished, mark_used, read_finished, write_finished
from cdtool.execution.store.use import StoreUse
from cdtool.results.evaluated import evaluate
from cdtool.results.files.results_file import to_json
from cdtool.results.results import Results
from cdtool.results.traces.file import encode_traces
from tests.bits import every_value
from tests.results.full_results import FULL
from tests.synthetic.many_results import many_results

FILE = """machine = "machine.toml"
detectors = ["momentum"]
[learn]
logs = ["free/*.csv"]
[holdout]
logs = ["holdout/*.csv"]
[impacts.stiff]
logs = ["stiff/*.csv"]
[onset]
above_n = 20.0
back_to_n = 8.0
[limits]
"momentum.stiff.max_ms" = { max = 500.0 }
"""


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Path:
    """A benchmark with a store that has one finished run."""
    folder = tmp_path_factory.mktemp("gate")
    cdtool.simulate_gate(folder, {"free": 10, "holdout": 1, "stiff": 2}, seed=18)
    (folder / "b.toml").write_text(FILE, encoding="utf-8")
    return folder


@pytest.fixture
def gate(made, tmp_path) -> Path:
    folder = tmp_path / "gate"
    shutil.copytree(made, folder)
    return folder


def run(folder: Path, store: Path | None = None, **settings) -> tuple[bytes, int | None]:
    """Return results and traces as bytes, and the number of recordings that were computed."""
    done = cdtool.benchmark(folder / "b.toml", store=store and StoreUse(store, **settings))
    computed = done.stored.computed if done.stored else None
    return to_json(done.results).encode() + encode_traces(done.traces), computed


@pytest.fixture
def unread(monkeypatch):
    """The outcomes of the single logs must not be read."""
    monkeypatch.setattr(StoredOutcomes, "known", lambda *_: pytest.fail("the outcomes of a log were read"))


@pytest.mark.parametrize("results", [FULL, many_results(1500, 3)], ids=["every kind of rows", "many"])
def test_results_survive_as_texts(results):
    known = replace(results, provenance={**results.provenance, "gains": dict.fromkeys(results.detectors), "units": {}})
    evaluated = evaluate(known)
    whole = FinishedRun(evaluated, (TraceKey("ab", "evenly sampled"),), 3)
    again = FinishedRun.of_texts(whole.to_texts(), known.provenance)
    assert again is not None and (again.traces, again.failed) == (whole.traces, 3)
    assert every_value(again.evaluated) == every_value(evaluated)
    assert to_json(again.evaluated.results) == to_json(evaluated.results)


def test_a_second_run_reads_no_outcome_of_a_log(gate, tmp_path, request):
    first = run(gate, tmp_path / "s")
    request.getfixturevalue("unread")
    calls: list[tuple[int, int]] = []
    done = cdtool.benchmark(
        gate / "b.toml", store=StoreUse(tmp_path / "s"), progress=lambda *numbers: calls.append(numbers)
    )
    assert calls == [(3, 3)] and done.stored is not None and (done.stored.computed, done.stored.reused) == (0, 3)
    assert run(gate, tmp_path / "s", trust_times=True) == (first[0], 0)
    assert first[0] == run(gate)[0]


def test_another_limit_is_another_run_from_the_same_outcomes(gate, tmp_path):
    run(gate, tmp_path / "s")
    (gate / "b.toml").write_text(FILE.replace("500.0", "1.0"), encoding="utf-8")
    found = run(gate, tmp_path / "s")
    assert found == (run(gate)[0], 0)
    assert b"violated" in found[0]


@pytest.mark.parametrize("cut", [0.1, 0.5, 0.98])
def test_a_damaged_file_is_as_if_it_were_missing(gate, tmp_path, cut):
    expected, _ = run(gate, tmp_path / "s")
    (file,) = (tmp_path / "s" / "finished").iterdir()
    content = bytearray(file.read_bytes())
    content[int(cut * len(content))] ^= 0xFF
    file.write_bytes(content)
    assert run(gate, tmp_path / "s") == (expected, 0)


def test_of_a_file_with_other_texts_nothing_is_used(gate, tmp_path):
    expected, _ = run(gate, tmp_path / "s")
    (file,) = (tmp_path / "s" / "finished").iterdir()
    for texts in ([("head", "{}")], [("contacts", "[[1]]")], [("contacts", "[")]):
        write_finished(tmp_path / "s", file.stem, texts)
        assert run(gate, tmp_path / "s") == (expected, 0)


def test_without_one_of_the_traces_it_is_not_used(gate, tmp_path, monkeypatch):
    expected, _ = run(gate, tmp_path / "s")
    of_texts = FinishedRun.of_texts

    def with_another_key(*arguments):
        found = of_texts(*arguments)
        assert found is not None and found.traces
        return replace(found, traces=(replace(found.traces[0], key="0" * 64), *found.traces[1:]))

    monkeypatch.setattr(FinishedRun, "of_texts", with_another_key)
    assert run(gate, tmp_path / "s") == (expected, 0)


def test_logs_that_could_not_be_read_are_read_again_if_that_is_asked_for(gate, tmp_path):
    (gate / "stiff" / "00.csv").write_text("t,i_motor\nnot,a\nlog,0\n", encoding="utf-8")
    expected, _ = run(gate, tmp_path / "s")
    assert run(gate, tmp_path / "s") == (expected, 0)
    assert run(gate, tmp_path / "s", retry_failed=True) == (expected, 1)


def test_a_run_with_a_failure_that_would_not_occur_again_is_not_stored(gate, tmp_path, monkeypatch):
    from cdtool.commands.scoring import pieces

    log, state, numbers = gate / "stiff" / "01.csv", pieces.state_of, iter(range(1000))
    with monkeypatch.context() as patched:
        patched.setattr(pieces, "state_of", lambda files: ((next(numbers), 0),) if files == [log] else state(files))
        assert b"changed while it was read" in run(gate, tmp_path / "s")[0]
    assert not (tmp_path / "s" / "finished").exists()
    assert run(gate, tmp_path / "s") == (run(gate)[0], 1)


def test_the_newest_files_are_kept(tmp_path):
    for number in range(7):
        write_finished(tmp_path, f"{number:064x}", [("head", str(number))])
    assert len(list((tmp_path / "finished").iterdir())) == 4
    assert list(read_finished(tmp_path, f"{6:064x}")) == [("head", "6")]
    assert list(read_finished(tmp_path, f"{0:064x}")) == []


def test_numbers_that_json_does_not_have_are_exact():
    row = replace(FULL.contacts[0], latency_ms=None, peak_force_n=math.nan, limit=-math.inf)
    known = Results({"gains": {"momentum": 0}, "units": {}}, ("momentum",), ("stiff",), (row,), (), ())
    whole = FinishedRun(evaluate(known), (), 0)
    again = FinishedRun.of_texts(whole.to_texts(), known.provenance)
    assert again is not None
    assert every_value(again.evaluated.results.contacts) == every_value(whole.evaluated.results.contacts)


def test_a_file_that_is_used_is_not_the_oldest(tmp_path):
    for number in range(3):
        write_finished(tmp_path, f"{number:064x}", [("head", str(number))])
        os.utime(tmp_path / "finished" / f"{number:064x}.parquet", (number, number))
    mark_used(tmp_path, f"{0:064x}")
    mark_used(tmp_path, f"{9:064x}")
    assert [path.stem for path in finished(tmp_path)] == [f"{number:064x}" for number in (0, 2, 1)]


def test_a_run_whose_results_cannot_be_kept_has_them_nevertheless(gate, tmp_path):
    expected, _ = run(gate)
    (tmp_path / "s").mkdir()
    with StoreUse(tmp_path / "s").opened():
        (tmp_path / "s" / "finished").write_text("in the way", encoding="utf-8")
    assert run(gate, tmp_path / "s") == (expected, 3)
    assert run(gate, tmp_path / "s") == (expected, 0)


def test_the_collection_of_garbage_leaves_as_many_as_runs(gate, tmp_path):
    from cdtool.execution.store.upkeep import collect_garbage

    for most in ("500.0", "1.0", "2.0"):
        (gate / "b.toml").write_text(FILE.replace("500.0", most), encoding="utf-8")
        run(gate, tmp_path / "s")
    assert len(list((tmp_path / "s" / "finished").iterdir())) == 3
    collect_garbage(tmp_path / "s", keep_runs=1)
    assert len(list((tmp_path / "s" / "finished").iterdir())) == 1
    assert run(gate, tmp_path / "s")[1] == 0
