"""A benchmark in several processes: everything that goes to a worker and back, and the same bytes for any number."""

from pathlib import Path

import pytest

import cdtool
from cdtool.execution.workers import Workers
from cdtool.results.files.results_file import to_json
from cdtool.results.traces.file import encode_traces

FILE = """machine = "machine.toml"
threshold = "{threshold}"

[signature]
force = true
[learn]
logs = ["free/*.csv"]
[holdout]
logs = ["holdout/*.csv"]
[impacts.stiff]
logs = ["stiff/*.csv", "damaged/*.csv"]
[onset]
above_n = 20.0
back_to_n = 8.0
"""


@pytest.fixture(scope="module")
def gate(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("gate")
    cdtool.simulate_gate(folder, {"free": 5, "holdout": 3, "stiff": 4}, seed=16)
    damaged = folder / "damaged"
    damaged.mkdir()
    (damaged / "1.csv").write_text("t,i_motor\nnot,a\nlog,0\n", encoding="utf-8")
    text = (folder / "stiff" / "01.csv").read_text(encoding="utf-8").splitlines()
    (damaged / "2.csv").write_text("\n".join(text[:2000] + text[2400:]) + "\n", encoding="utf-8")
    return folder


def test_many_logs_in_pieces_give_the_same_bytes_and_progress(gate, tmp_path):
    """Of 60 logs, pieces have up to 3 in two processes."""
    for name in ("free", "holdout", "machine.toml"):
        (tmp_path / name).symlink_to(gate / name)
    (tmp_path / "damaged").symlink_to(gate / "damaged")
    (tmp_path / "stiff").mkdir()
    for log in sorted((gate / "stiff").glob("*.csv")):
        head, first, rest = log.read_text(encoding="utf-8").split("\n", 2)
        for copy in range(15):
            text = f"{head}\n{first[:-1]}{copy}\n{rest}"
            (tmp_path / "stiff" / f"{log.stem}_{copy}.csv").write_text(text, encoding="utf-8")
    file = tmp_path / "benchmark.toml"
    file.write_text(FILE.format(threshold="signature"), encoding="utf-8")
    made = set()
    for jobs in (1, 2):
        shown = []
        done = cdtool.benchmark(
            file,
            detectors=["momentum"],
            workers=Workers(jobs, progress=lambda number, total, shown=shown: shown.append((number, total))),
        )
        made.add(to_json(done.results).encode() + encode_traces(done.traces))
        assert shown[-65:] == [(number, 65) for number in range(1, 66)]
        assert shown[:-65] == [(number, 5) for number in range(1, 6)]
    assert len(made) == 1


@pytest.fixture(scope="module")
def free_runs(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("budget")
    cdtool.simulate_gate(folder, {"free": 12, "holdout": 1, "stiff": 1}, seed=16)
    (folder / "budget.toml").write_text(
        FILE.format(threshold="signature").replace(', "damaged/*.csv"', ""), encoding="utf-8"
    )
    return folder / "budget.toml"


def test_detectors_that_learn_for_a_budget_in_two_processes_give_the_same_results(free_runs):
    names = ["momentum", "pure_torque", "pure_inertia", "velocity"]
    made = [cdtool.benchmark(free_runs, detectors=names, false_alarm_budget="1/4op", jobs=jobs) for jobs in (1, 2)]
    one, two = (to_json(done.results) for done in made)
    assert one == two and len(made[0].results.calibration) > 1
