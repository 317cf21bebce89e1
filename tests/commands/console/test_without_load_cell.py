"""The load cell may be fitted for impact tests only: impact-free logs without it are accepted with a note."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import cdtool as api
from cdtool.formats.mcap.write import Stream, write_mcap
from tests.base.findings.facts import fact_of
from tests.command import FEW, cdtool

CELL = "load_cell"


def without_cell(source: Path, target: Path) -> Path:
    rows = [line.split(",") for line in source.read_text(encoding="utf-8").splitlines()]
    place = rows[0].index(CELL)
    lines = [",".join(cell for i, cell in enumerate(row) if i != place) for row in rows]
    target.parent.mkdir(exist_ok=True, parents=True)
    target.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return target


@pytest.fixture(scope="module")
def bare(gate_folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """3 logs to learn from, a hold-out and an impact, all without a load-cell column."""
    folder = tmp_path_factory.mktemp("bare")
    for name in ("free/01.csv", "free/02.csv", "free/03.csv", "holdout/01.csv", "stiff/01.csv"):
        without_cell(gate_folder / name, folder / name)
    return folder


def benchmark_of(folder: Path, gate_folder: Path, *impacts: Path) -> Path:
    file = folder / "benchmark.toml"
    file.write_text(
        f'machine = "{gate_folder / "machine.toml"}"\ndetectors = ["gm"]\n[signature]\nforce = true\n'
        f'[learn]\nlogs = ["free/*.csv"]\n[holdout]\nlogs = ["holdout/*.csv"]\n'
        f"[impacts.stiff]\nlogs = {[str(path) for path in impacts]}\n",
        encoding="utf-8",
    )
    return file


def test_a_signature_is_learned_with_a_note_that_contacts_cannot_be_checked(bare, gate_folder, tmp_path):
    logs = sorted((bare / "free").glob("*.csv"))
    done = cdtool(
        "learn-signature", *logs, "-m", gate_folder / "machine.toml", "-d", "gm", FEW, "-o", tmp_path / "s.json"
    )
    assert done.status == 0, done.err
    told = [line for line in done.err.splitlines() if CELL in line]
    assert len(told) == 1 and "3 logs" in told[0] and f"no column '{CELL}': assumed to be free of impacts" in told[0]
    checked = cdtool("signature", "check", tmp_path / "s.json", *logs, "-m", gate_folder / "machine.toml")
    assert checked.status == 0 and "3 logs" in checked.err


def test_a_benchmark_learns_from_them_and_counts_false_alarms_in_them(bare, gate_folder):
    found = api.benchmark(benchmark_of(bare, gate_folder, gate_folder / "stiff" / "01.csv"))
    assert not found.results.skipped
    assert {(item.group, item.operations) for item in found.results.exposure} == {("stiff", 1), ("holdout", 1)}
    assert sum("assumed to be free of impacts" in item.reason for item in found.results.findings) == 2
    assert found.results.contacts[0].outcome == "detected"


def test_an_impact_log_without_it_is_left_out_with_the_column_that_is_missing(bare, gate_folder):
    file = benchmark_of(bare, gate_folder, gate_folder / "stiff" / "01.csv", bare / "stiff" / "01.csv")
    (item,) = api.benchmark(file).results.skipped
    assert (
        item.recording == "stiff/01.csv"
        and f"no ground truth: force: is not in this log: no column '{CELL}'" in item.reason
    )


def test_detect_shows_the_alarm_and_says_why_it_has_no_latency(bare, gate_folder):
    limit = ("-d", "gm", "--set=threshold.limits=400")
    done = cdtool("detect", bare / "stiff" / "01.csv", "-m", gate_folder / "machine.toml", *limit)
    assert done.status == 0, done.err
    (row,) = [line for line in done.out.splitlines() if " alarm " in line]
    assert row.rstrip().endswith("-  force is not in this log")
    assert f"note: {bare / 'stiff' / '01.csv'}: force: is not in this log: no column '{CELL}'" in done.err


def test_a_misspelt_column_is_reported_with_the_nearest(gate_folder, tmp_path):
    text = (gate_folder / "machine.toml").read_text(encoding="utf-8")
    (tmp_path / "machine.toml").write_text(text.replace(f'"{CELL}"', '"loadcell"'), encoding="utf-8")
    found = api.info(gate_folder / "stiff" / "01.csv", machine=tmp_path / "machine.toml")
    (note,) = [item for item in found.findings if item.channel == "force"]
    assert note.severity == "note" and fact_of(note) == (
        "absent_truth",
        {"what": "column", "name": "loadcell", "similar": CELL},
    )


MACHINE = """
[machine]
type = "linear_axis"
name = "door"
load_mass = 50.0
coordinates = "load"
[channels.mcap]
torque = { topic = "/joint_states", field = "effort[0]" }
speed = { topic = "/joint_states", field = "velocity[0]" }
force = { topic = "/load_cell", field = "wrench.force.z" }
event = { topic = "/contact", field = "data" }
"""


def door(folder: Path, name: str, start: float, *streams: Stream) -> None:
    time = start + np.arange(2000) * 1e-3
    noise = np.random.default_rng(1).normal(0.0, 1.0, 2000)
    states = {"effort[0]": 10.0 + noise, "velocity[0]": np.full(2000, 0.2), "position[0]": 0.2 * time}
    write_mcap(
        folder / name,
        [Stream("/joint_states", "sensor_msgs/msg/JointState", time, states, ("door",)), *streams],
        start_ns=1_700_000_000 * 10**9,
    )


def test_a_topic_that_is_not_in_an_mcap_log_is_noted(tmp_path):
    (tmp_path / "machine.toml").write_text(MACHINE, encoding="utf-8")
    door(tmp_path, "free.mcap", 0.0)
    recording = api.read(tmp_path / "free.mcap", tmp_path / "machine.toml")
    assert sorted(recording.channels) == ["position", "speed", "torque"]  # the position is integrated from the speed
    told = [str(item) for item in recording.findings if item.channel in ("force", "event")]
    assert told == [
        "force: is not in this log: no topic '/load_cell wrench.force.z'",
        "event: is not in this log: no topic '/contact data'",
    ]


def test_events_in_one_part_of_a_log_in_parts_are_kept(tmp_path):
    (tmp_path / "machine.toml").write_text(MACHINE, encoding="utf-8")
    (tmp_path / "log").mkdir()
    event = Stream("/contact", "std_msgs/msg/Float64", np.array([2.5]), {"data": np.array([1.0])})
    door(tmp_path / "log", "log_0.mcap", 0.0)
    door(tmp_path / "log", "log_1.mcap", 2.0, event)
    recording = api.read(tmp_path / "log", tmp_path / "machine.toml")
    assert recording["event"].time.tolist() == [pytest.approx(2.5)]
    assert len(recording["torque"]) == 4000
