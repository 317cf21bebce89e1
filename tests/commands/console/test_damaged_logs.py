"""A partly lost log is used and reported as damaged; a left-out log is counted once, with its reason."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from tests.command import cdtool
from tests.commands.console.changed_logs import damaged


@pytest.fixture
def cut(gate_folder: Path, tmp_path: Path):
    """cut(seconds): the first seconds of an impact log, with an incomplete last line."""
    lines = (gate_folder / "stiff" / "01.csv").read_text(encoding="utf-8").splitlines()

    def make(seconds: float, name: str = "cut.csv") -> Path:
        kept = [line for line in lines[1:] if float(line.split(",")[0]) <= 1e3 * seconds]
        text = "\n".join([lines[0], *kept])
        (tmp_path / name).write_text(text[: text.rindex(",")], encoding="utf-8")
        return tmp_path / name

    return make


def test_left_out_and_damaged_logs_are_counted_separately(cut, gate_folder, tmp_path):
    (tmp_path / "empty.csv").touch()
    machine = ("-m", gate_folder / "machine.toml", "-d", "gm", "--set=threshold.limits=400")
    done = cdtool("detect", tmp_path / "empty.csv", cut(1e9), cut(1e9, "too.csv"), *machine)
    assert done.status == 3 and done.err.endswith("done, but 1 item was left out and 2 logs are damaged\n")


def test_an_alarm_after_the_load_cell_s_last_sample_has_a_reason_for_no_latency(gate_folder, tmp_path):
    machine = ("-m", gate_folder / "machine.toml", "-d", "gm", "--set=threshold.limits=400")
    whole = cdtool("detect", gate_folder / "stiff" / "01.csv", *machine)
    (row,) = [line for line in whole.out.splitlines() if " alarm " in line]
    ends = 1e3 * (float(row.split()[2]) - 0.5)  # the log is in ms
    lines = (gate_folder / "stiff" / "01.csv").read_text(encoding="utf-8").splitlines()
    place = lines[0].split(",").index("load_cell")
    cells = [line.split(",") for line in lines[1:]]
    for row_cells in cells:
        row_cells[place] = row_cells[place] if float(row_cells[0]) <= ends else ""
    (tmp_path / "short.csv").write_text("\n".join([lines[0], *map(",".join, cells)]) + "\n", encoding="utf-8")
    done = cdtool("detect", tmp_path / "short.csv", *machine)
    (row,) = [line.rstrip() for line in done.out.splitlines() if " alarm " in line]
    last = max(1e-3 * float(item[0]) for item in cells if item[place])
    assert row.endswith(f"-  load cell ends at {last:.3f} s")
    setup = benchmark_of(tmp_path, gate_folder, "short.csv")
    (line,) = [line for line in cdtool("benchmark", setup).err.splitlines() if "short.csv" in line]
    assert f"the load cell ends at {last:.3f} s, the log at " in line and "holdout" not in line


def test_a_benchmark_does_not_advise_to_move_a_cut_impact_log_to_the_hold_out(cut, gate_folder, tmp_path):
    cut(3.0)
    done = cdtool("benchmark", benchmark_of(tmp_path, gate_folder, "cut.csv"))
    assert done.status == 3
    (line,) = [line for line in done.err.splitlines() if "cut.csv" in line]
    assert line.startswith("left out: cut.csv: no contact found") and "part of the log is lost" in line
    assert "copy the log again" in line and "holdout" not in line


def test_a_loss_in_the_runs_learned_from_is_reported_even_if_no_log_can_be_used(gate_folder, tmp_path):
    (tmp_path / "empty.csv").touch()
    (tmp_path / "too.csv").touch()
    setup = benchmark_of(tmp_path, gate_folder, "empty.csv")
    run = tmp_path / "free" / "02.csv"
    text = run.read_text(encoding="utf-8")
    run.write_text(text[: text.rindex(",")], encoding="utf-8")
    done = cdtool("detect", tmp_path / "empty.csv", tmp_path / "too.csv", "--benchmark", setup)
    assert done.status == 2 and not done.out, done.err
    (line,) = [line for line in done.err.splitlines() if line.startswith("loss: ")]
    assert line.startswith("loss: free/02.csv: the last line")
    assert sum(line.startswith("error: ") and "is empty" in line for line in done.err.splitlines()) == 2


def benchmark_of(tmp_path: Path, gate_folder: Path, log: str) -> Path:
    """A benchmark of that log and an intact one, learned from 3 impact-free logs."""
    for name in ("free/01.csv", "free/02.csv", "free/03.csv", "stiff/02.csv", "machine.toml"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        shutil.copyfile(gate_folder / name, tmp_path / name)
    (tmp_path / "benchmark.toml").write_text(
        'machine = "machine.toml"\ndetectors = ["gm"]\n[signature]\nforce = true\n[learn]\nlogs = ["free/*.csv"]\n'
        f'[impacts.stiff]\nlogs = ["{log}", "stiff/*.csv"]\n',
        encoding="utf-8",
    )
    return tmp_path / "benchmark.toml"


def test_a_benchmark_names_each_run_that_is_left_out_once(gate_folder, tmp_path):
    free = gate_folder / "free"
    (tmp_path / "twin.csv").write_bytes((free / "01.csv").read_bytes())
    speeds = [line.split(",")[2] for line in (free / "02.csv").read_text(encoding="utf-8").splitlines()[1:]]
    cells = {("n_motor", row): f"{1.4 * float(speed):.3f}" for row, speed in enumerate(speeds)}
    fast = damaged(free / "02.csv", tmp_path / "fast.csv", cells)
    text = (
        (gate_folder / "benchmark.toml")
        .read_text(encoding="utf-8")
        .replace("machine.toml", f"{gate_folder}/machine.toml")
    )
    for group in ("free", "holdout", "stiff", "soft"):
        text = text.replace(f'["{group}/*.csv"]', f'["{gate_folder}/{group}/*.csv"]')
    logs = f'["{free}/*.csv", "{tmp_path}/twin.csv", "{fast}"]'
    text = text.replace(f'["{free}/*.csv"]', logs)
    (tmp_path / "benchmark.toml").write_text(text, encoding="utf-8")
    target = tmp_path / "results.json"
    done = cdtool("benchmark", tmp_path / "benchmark.toml", "--detectors", "pi,gm,pt", "-o", target)
    assert done.status == 3 and done.err.endswith("done, but 2 items were left out\n")
    reasons = [(item["recording"], item["reason"]) for item in json.loads(target.read_text())["skipped"]]
    assert [name for name, _ in reasons] == ["twin.csv", "fast.csv"]
    assert "has the same content as" in reasons[0][1] and "runs forward at" in reasons[1][1]


def test_a_file_named_twice_is_not_reported_as_a_copy(gate_folder, tmp_path):
    free = sorted((gate_folder / "free").glob("*.csv"))
    again = free[0].parent / ".." / "free" / free[0].name
    machine = ("-m", gate_folder / "machine.toml")
    signature = tmp_path / "pi.json"
    done = cdtool("learn-signature", *free, free[0], again, *machine, "-d", "pi", "-o", signature)
    assert done.status == 3 and "same content" not in done.err
    assert f"left out: {free[0].as_posix()}: given more than once, used once" in done.err
    new = gate_folder / "holdout" / "01.csv"
    done = cdtool("signature", "update", signature, new, new, *machine)
    assert "1 run added" in done.out and "already in the signature" not in done.err
    assert "given more than once, used once" in done.err
    done = cdtool("signature", "update", signature, new, *machine)
    assert "this run is already in the signature" in done.err


def test_too_few_runs_count_those_left_out_before(gate_folder, tmp_path):
    source = (gate_folder / "free" / "01.csv").read_bytes()
    copies = [tmp_path / f"copy_{number}.csv" for number in range(10)]
    for copy in copies:
        copy.write_bytes(source)
    machine = ("-m", gate_folder / "machine.toml")
    done = cdtool("learn-signature", *copies, *machine, "-d", "pi", "-o", tmp_path / "pi.json")
    assert done.status == 2 and "1 impact-free run of one class" in done.err
    assert "left out before: 9 runs (add runs; " in done.err and "used once" in done.err
