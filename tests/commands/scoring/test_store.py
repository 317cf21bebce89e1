"""A benchmark with a store: the same bytes as without it, and nothing computed twice."""

import hashlib
import os
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

import cdtool
from cdtool.base.errors import OutputError, RecordingError
from cdtool.commands.scoring import benchmark, pieces
from cdtool.commands.scoring.benchmark_file import read_benchmark_file
from cdtool.commands.scoring.learned import Teaching
from cdtool.commands.scoring.store.determinants import Determinants
from cdtool.execution.store.sources import read_sources
from cdtool.execution.store.store import Store
from cdtool.execution.workers import Workers
from cdtool.results.files.results_file import to_json
from cdtool.results.traces.file import encode_traces
from cdtool.thresholds import THRESHOLDS

FILE = """machine = "machine.toml"
detectors = ["momentum", "friction_ekf"]
threshold = "{threshold}"
{operations}
[signature]
force = true
[learn]
logs = ["free/*.csv"{learn}]
{until}
[holdout]
logs = ["holdout/*.csv"]
[impacts.stiff]
logs = ["stiff/*.csv"]
[onset]
above_n = 20.0
back_to_n = 8.0
"""


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("gate")
    cdtool.simulate_gate(folder, {"free": 4, "holdout": 2, "stiff": 4}, seed=18)
    return folder


@pytest.fixture
def gate(made, tmp_path) -> Path:
    folder = tmp_path / "gate"
    shutil.copytree(made, folder)
    write(folder)
    return folder


@pytest.fixture(scope="module")
def first_store(made, tmp_path_factory) -> Path:
    """The store of a first run, of a folder like `gate`."""
    folder = tmp_path_factory.mktemp("first")
    shutil.copytree(made, folder / "gate")
    write(folder / "gate")
    assert run(folder / "gate", folder / "s")[1] == 6
    return folder / "s"


@pytest.fixture
def filled(first_store, tmp_path) -> Path:
    """A store that contains a first run; its files have other paths, so their content is compared."""
    return shutil.copytree(first_store, tmp_path / "s")


def write(folder: Path, threshold: str = "signature", learn: str = "", until: str = "", operations: str = "") -> Path:
    text = FILE.format(threshold=threshold, learn=learn, until=until, operations=operations)
    (folder / "b.toml").write_text(text, encoding="utf-8")
    return folder / "b.toml"


def bytes_of(done: cdtool.BenchmarkResult) -> bytes:
    return to_json(done.results).encode() + encode_traces(done.traces)


def run(folder: Path, store: Path | None, jobs: int = 1) -> tuple[bytes, int | None]:
    """Return results and traces as bytes, and the number of recordings that were computed."""
    use = None if store is None else Store(store)
    done = cdtool.benchmark(folder / "b.toml", store=use, jobs=jobs)
    return bytes_of(done), done.stored.computed if done.stored else None


WITHOUT_STORE: dict[bytes, bytes] = {}
"""Results without a store, by the content of the folder: many tests need those of equal folders."""


def alone(folder: Path) -> bytes:
    digest = hashlib.sha256()
    for file in sorted(folder.rglob("*.*")):
        content = file.read_bytes()
        digest.update(f"{file.relative_to(folder)} {len(content)}\n".encode() + content)
    if digest.digest() not in WITHOUT_STORE:
        WITHOUT_STORE[digest.digest()] = run(folder, None)[0]
    return WITHOUT_STORE[digest.digest()]


@pytest.fixture
def ran(monkeypatch) -> list[str]:
    """The recordings that were scored, by name."""
    found: list[str] = []
    call = pieces.PieceScoring.__call__

    def noted(self, piece):
        found.append(piece.path.name)
        return call(self, piece)

    monkeypatch.setattr(pieces.PieceScoring, "__call__", noted)
    return found


@pytest.mark.parametrize("threshold", THRESHOLDS.names())
def test_a_second_run_computes_nothing_and_writes_the_same_bytes(gate, threshold, tmp_path):
    write(gate, threshold)
    expected = alone(gate)
    assert run(gate, tmp_path / "s") == (expected, 6)
    assert run(gate, tmp_path / "s") == (expected, 0)
    assert run(gate, tmp_path / "s", jobs=2) == (expected, 0)


def test_of_one_recording_more_only_that_is_computed(gate, tmp_path, ran):
    new = gate / "stiff" / "04.csv"
    kept = new.read_bytes()
    new.unlink()
    run(gate, tmp_path / "s")
    new.write_bytes(kept)
    ran.clear()
    found = run(gate, tmp_path / "s")
    assert "04.csv" in ran
    assert found == (alone(gate), 1)


def test_with_another_gain_or_detector_all_is_computed_again(gate, filled):
    with (gate / "machine.toml").open("a", encoding="utf-8") as file:
        file.write("\n[detectors.momentum]\nbandwidth = 17.0\n")
    assert run(gate, filled) == (alone(gate), 6)
    text = (gate / "b.toml").read_text(encoding="utf-8")
    (gate / "b.toml").write_text(text.replace('"friction_ekf"]', '"friction_ekf", "pure_torque"]'), encoding="utf-8")
    assert run(gate, filled) == (alone(gate), 6)
    assert run(gate, filled) == (alone(gate), 0)


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("above_n = 20.0", "above_n = 30.0"),
        ("[onset]", "[activation]\nhysteresis = 0.2\n[onset]"),
        ("stiff/", "./stiff/"),
    ],
)
def test_another_setting_computes_all_again_another_spelling_of_a_path_nothing(gate, filled, before, after):
    text = (gate / "b.toml").read_text(encoding="utf-8")
    (gate / "b.toml").write_text(text.replace(before, after), encoding="utf-8")
    assert run(gate, filled) == (alone(gate), 0 if "/" in before else 6)


def test_another_impact_free_run_computes_all_again(gate, filled):
    text = (gate / "free" / "01.csv").read_text(encoding="utf-8")
    (gate / "free" / "11.csv").write_text(text.replace("-0.0083", "-0.0084", 1), encoding="utf-8")
    assert run(gate, filled) == (alone(gate), 6)


def test_content_is_compared_not_times(gate, tmp_path):
    run(gate, tmp_path / "s")
    log = gate / "stiff" / "01.csv"
    state, text = log.stat(), log.read_bytes()
    log.write_bytes(text[:-2] + (b"1" if text[-2:-1] != b"1" else b"2") + text[-1:])
    os.utime(log, ns=(state.st_atime_ns, state.st_mtime_ns))
    assert run(gate, tmp_path / "s")[1] == 1
    for log in gate.rglob("*.csv"):
        os.utime(log, ns=(1, 1))
    assert run(gate, tmp_path / "s")[1] == 0


def test_an_error_of_the_system_is_not_stored(gate, tmp_path, monkeypatch):
    def fail(path: Path, *_: object) -> None:
        raise RecordingError(f"{path}: cannot be read: the disk is gone") from OSError(5, "Input/output error")

    expected = alone(gate)
    with monkeypatch.context() as patched:
        patched.setattr("cdtool.commands.judging.runs.read_recording", fail)
        with pytest.raises(RecordingError, match="the disk is gone"):
            run(gate, tmp_path / "s")
    assert run(gate, tmp_path / "s") == (expected, 6)


@pytest.mark.parametrize("with_store", [False, True])
def test_a_log_that_changes_while_it_is_read_is_left_out_with_that_reason(gate, tmp_path, monkeypatch, with_store):
    log = gate / "stiff" / "03.csv"
    before = log.read_bytes()
    score = benchmark.score_runs

    def changing(setup, group, path, *others):
        found = score(setup, group, path, *others)
        if path == log:
            log.write_bytes(before + b"\n")
        return found

    monkeypatch.setattr(benchmark, "score_runs", changing)
    use = Store(tmp_path / "s") if with_store else None
    done = cdtool.benchmark(gate / "b.toml", store=use)
    assert [(item.recording, item.reason) for item in done.results.skipped] == [
        ("stiff/03.csv", "changed while it was read")
    ]
    monkeypatch.undo()
    log.write_bytes(before)
    assert run(gate, tmp_path / "s") == (alone(gate), 1 if with_store else 6)


def test_logs_that_are_learned_from_and_scored_depend_on_all_others(gate, tmp_path):
    write(gate, learn=', "stiff/*.csv"', until='until = "onset"')
    expected = alone(gate)
    assert run(gate, tmp_path / "s") == (expected, 6)
    assert run(gate, tmp_path / "s") == (expected, 0)
    with (gate / "machine.toml").open("a", encoding="utf-8") as file:
        file.write("\n[detectors.momentum]\nbandwidth = 17.0\n")
    assert run(gate, tmp_path / "s") == (alone(gate), 6)
    shutil.copy(gate / "free" / "01.csv", gate / "free" / "other.csv")
    text = (gate / "free" / "other.csv").read_text(encoding="utf-8")
    (gate / "free" / "other.csv").write_text(text.replace("-0.0083", "-0.0084", 1), encoding="utf-8")
    assert run(gate, tmp_path / "s") == (alone(gate), 6)


def logs_in(store: Path) -> list[Path]:
    return [path for path in (store / "logs").rglob("*") if path.is_file()]


def test_a_damaged_or_missing_file_is_computed_again(gate, tmp_path):
    expected, _ = run(gate, tmp_path / "s")
    first, second, *_ = logs_in(tmp_path / "s")
    content = bytearray(first.read_bytes())
    content[len(content) // 3] ^= 0xFF
    first.write_bytes(content)
    second.write_bytes(second.read_bytes()[:-1])
    assert run(gate, tmp_path / "s") == (expected, 2)
    for path in logs_in(tmp_path / "s"):
        path.unlink()
    assert run(gate, tmp_path / "s") == (expected, 6)


def test_a_store_that_cannot_be_written_is_one_line(gate, filled):
    shutil.rmtree(filled / "logs")
    (filled / "logs").touch()
    with pytest.raises(OutputError, match="cannot be written"):
        run(gate, filled)


def killed_run(gate):
    """Kill a benchmark with a store after four of its logs."""
    code = (
        "import os; from pathlib import Path; import cdtool; from cdtool.execution.store.store import Store\n"
        "from cdtool.execution.workers import Workers\n"
        "def progress(done, total):\n"
        "    if (done, total) == (4, 6): os.kill(os.getpid(), 9)\n"
        "cdtool.benchmark('b.toml', store=Store(Path('../s')), workers=Workers(progress=progress))"
    )
    environment = {**os.environ, "PYTHONPATH": str(Path(cdtool.__file__).parents[1])}
    done = subprocess.run([sys.executable, "-c", code], check=False, cwd=gate, env=environment)
    assert done.returncode == -9


def test_a_killed_run_continues_where_it_stopped(gate, tmp_path):
    killed_run(gate)
    assert run(gate, tmp_path / "s") == (alone(gate), 2)


def test_a_folder_that_is_not_a_store_is_refused(gate):
    with pytest.raises(cdtool.base.errors.ConfigurationError, match="neither a store nor an empty folder"):
        run(gate, gate)
    assert not (gate / "logs").exists()


def test_a_detector_refused_in_a_group_is_not_found_under_the_key_of_one_that_is_not(gate):
    setup = read_benchmark_file(write(gate))
    teaching = Teaching(setup, Workers())
    groups = {name: replace(item, refused={"momentum": "no stiffness"}) for name, item in setup.impacts.items()}
    one, other = (Determinants(each, teaching.learned, {}, {}) for each in (setup, replace(setup, impacts=groups)))
    group, item = next(iter(setup.impacts.items()))
    assert one.key(group, item.logs[0], ()) != other.key(group, item.logs[0], ())


def test_a_renamed_part_of_a_log_is_another_log(tmp_path):
    for name in ("a.mcap", "b.mcap"):
        (tmp_path / name).write_bytes(b"x")
    before = read_sources(sorted(tmp_path.iterdir()))
    (tmp_path / "a.mcap").rename(tmp_path / "c.mcap")
    after = read_sources(sorted(tmp_path.iterdir()))
    assert before is not None and after is not None
    assert {item.digest for item in before} == {item.digest for item in after}
    assert [item.content for item in before] != [item.content for item in after]
