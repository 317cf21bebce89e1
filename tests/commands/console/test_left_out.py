"""A left-out log is counted once for any number of detectors, with its reason."""

from __future__ import annotations

import json

from cdtool.commands.scoring.scoring import left_out_by
from cdtool.results.results import Skipped
from tests.command import cdtool
from tests.commands.console.damaged_copies import damaged


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


def test_too_few_runs_say_why_the_first_was_left_out_in_full(gate_folder, tmp_path):
    hit = (gate_folder / "stiff" / "01.csv").read_bytes()
    logs = [tmp_path / ("a long name of a folder, " * 8) / f"{number}.csv" for number in range(3)]
    logs[0].parent.mkdir()
    for number, log in enumerate(logs):
        log.write_bytes(hit + b"\n" * number)
    given = (*logs, gate_folder / "free" / "01.csv", "-m", gate_folder / "machine.toml", "-d", "pi")
    left_out, error = cdtool("learn-signature", *given, "-o", tmp_path / "pi.json").err.splitlines()[-2:]
    assert left_out.startswith("left out: ") and "0.csv: the load cell shows a contact of " in left_out
    assert left_out.endswith("raise onset.above_n)") and len(left_out) <= 300
    assert "left out before: 3 runs (add runs; to learn from fewer, but at least 2: " in error


def test_a_reason_of_some_detectors_names_them():
    both = Skipped("b.csv", "another class")
    assert left_out_by({"pure_inertia": [Skipped("a.csv", "no acceleration"), both], "momentum": [both]}) == [
        Skipped("a.csv", "pure_inertia: no acceleration"),
        Skipped("b.csv", "another class"),
    ]
