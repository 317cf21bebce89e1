"""Commands whose files are at URLs: the results are those of local files."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

import cdtool as api
from cdtool.base.remote.remote_path import location
from tests.command import FEW, cdtool

GATE = Path(__file__).parents[3] / "sample_logs" / "gate"
MACHINE = GATE / "machine.toml"


@pytest.fixture
def gate(memory):
    """The sample logs of the gate at a URL."""
    for path in GATE.rglob("*"):
        if path.is_file():
            memory.pipe_file(f"/gate/{path.relative_to(GATE).as_posix()}", path.read_bytes())
    return "memory://gate"


def test_a_benchmark_has_the_bytes_of_a_local_one(gate, memory, tmp_path):
    here = cdtool("benchmark", GATE / "benchmark.toml", "-o", tmp_path / "results.json", "-o", tmp_path / "report.html")
    there = cdtool(
        "benchmark", f"{gate}/benchmark.toml", "-o", "memory://out/results.json", "-o", "memory://out/report.html"
    )
    assert (there.status, there.out.replace("memory://out", str(tmp_path))) == (here.status, here.out)
    for name in ("results.json", "report.html", "results.traces.json.gz"):
        assert memory.cat(f"/out/{name}") == (tmp_path / name).read_bytes(), name
    assert "read from URLs: " in there.err and "URL" not in here.err


def test_a_signature_is_learned_used_and_updated(gate, memory, tmp_path):
    free = [f"{gate}/free/{path.name}" for path in sorted((GATE / "free").iterdir())]
    learned = cdtool(
        "learn-signature", *free, "-m", f"{gate}/machine.toml", "-d", "feekf", FEW, "-o", "memory://g.json"
    )
    assert learned.status == 0, learned.err
    here, there = [
        cdtool("detect", log, "-m", MACHINE, "-s", "memory://g.json", "--json")
        for log in (GATE / "stiff/03.csv", f"{gate}/stiff/03.csv")
    ]
    assert here.status == there.status and there.out == here.out.replace(str(GATE), gate)
    before = memory.cat("/g.json")
    more = sorted((GATE / "holdout").glob("*.csv"))[0]
    updated = cdtool(
        "signature", "update", "memory://g.json", f"{gate}/holdout/{more.name}", "-m", f"{gate}/machine.toml", "--json"
    )
    assert updated.status == 0, updated.err
    assert (memory.cat("/g.json") != before) == bool(json.loads(updated.out)["added"])
    assert cdtool("signature", "show", "memory://g.json").status == 0
    text = learned.out.encode()
    assert b"memory://g.json" in text


def test_the_other_commands_read_and_write_urls(gate, memory, tmp_path):
    assert cdtool("benchmark", f"{gate}/benchmark.toml", "-o", "memory://out/results.json").status == 0
    assert cdtool("report", "memory://out/results.json", "-o", "memory://out/report.md").status == 0
    assert (
        cdtool("compare", "memory://out/results.json", "memory://out/results.json", "-o", "memory://out/c.md").status
        == 0
    )
    assert cdtool("plan", "--std-ms", "memory://out/results.json", "--difference-ms", "5").status in (0, 2)
    assert cdtool("info", f"{gate}/stiff/01.mcap", "-m", f"{gate}/machine.toml").status == 0
    assert cdtool("init", f"{gate}/stiff/03.csv", "-o", "memory://out/machine.toml").status in (0, 3)
    assert cdtool("convert", f"{gate}/stiff/01.mcap", "memory://out/clean.mcap", "--recover", "all").status == 0
    done = cdtool(
        "explain", f"{gate}/stiff/03.csv", "-b", f"{gate}/benchmark.toml", "-d", "feekf", "--plot", "memory://out/e.png"
    )
    assert done.status == 0, done.err
    assert cdtool("simulate", "gate", "-o", "memory://simulated", "--set", "stiff=1").status == 0
    written = set(memory.find("/out"))
    assert {f"/out/{name}" for name in ("report.md", "c.md", "machine.toml", "clean.mcap", "e.png")} <= written
    assert memory.exists("/simulated/benchmark.toml")


def test_runs_of_a_log_are_named_by_its_url(memory, tmp_path):
    rows = [
        f"{t / 100},{run},{(t % 500) / 100 * (run + 1)},1.5"
        for run in range(3)
        for t in range(run * 500, run * 500 + 500)
    ]
    memory.pipe_file("/logs/cycles #2.csv", "\n".join(["t,cycle,x,i", *rows]).encode())
    machine = MACHINE.read_text(encoding="utf-8").partition("[channels]")[0]
    machine += '[channels]\ntime = { column = "t", unit = "s" }\nposition = { column = "x", unit = "m" }\n'
    machine += 'torque = { column = "i", unit = "A", scale = 0.56 }\n'
    memory.pipe_file("/logs/machine.toml", machine.encode())
    done = cdtool(
        "detect",
        "memory://logs/cycles #2.csv#1",
        "-m",
        "memory://logs/machine.toml",
        "-d",
        "pt",
        "--set=threshold.limits=1000000",
        "--set=operations=column:cycle",
        "--json",
    )
    assert '"memory://logs/cycles #2.csv#1"' in done.out, done.err


def test_a_store_at_a_url_is_used_again(gate, memory, tmp_path):
    runs = [
        cdtool("benchmark", f"{gate}/benchmark.toml", "--store", "memory://store", "-o", f"memory://out/{i}.json")
        for i in range(2)
    ]
    assert [run.status for run in runs] == [0, 0], runs[1].err
    assert memory.cat("/out/0.json") == memory.cat("/out/1.json")
    assert cdtool("benchmark", f"{gate}/benchmark.toml", "-o", "memory://out/2.json").status == 0
    assert memory.cat("/out/0.json") == memory.cat("/out/2.json")
    assert "as stored" in runs[0].out and "store: 0 recordings computed" in runs[1].out


def test_a_rosbag2_folder_at_a_url_is_one_log(memory, tmp_path):
    folder = tmp_path / "bag"
    folder.mkdir()
    shutil.copy(GATE / "stiff" / "01.mcap", folder / "bag_0.mcap")
    (folder / "metadata.yaml").write_text("rosbag2_bagfile_information:\n  relative_file_paths:\n    - bag_0.mcap\n")
    for path in folder.iterdir():
        memory.pipe_file(f"/bag/{path.name}", path.read_bytes())
    here, there = api.read(folder, MACHINE), api.read("memory://bag", MACHINE)
    assert list(here.channels) == list(there.channels) and here.digest == there.digest
    assert there.source == "memory://bag" and there.name == here.name


def test_a_path_at_a_url_is_one_log_in_python(gate):
    log = location(f"{gate}/stiff/03.csv")
    one, several = [
        api.detect(logs, MACHINE, detector="pt", settings={"threshold.limits": 50.0}) for logs in (log, [log])
    ]
    assert several[0].alarms.equals(one.alarms)
