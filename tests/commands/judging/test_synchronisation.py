"""The sync audit in `cdtool info`: one log, several logs, and logs without anything to compare."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import cdtool as package
from cdtool.commands.judging.information import Info, common_delays
from tests.base.findings.facts import fact_of
from tests.command import cdtool
from tests.synthetic.shifted_clocks import Clocks, collisions

GATE = Path(__file__).parents[3] / "sample_logs" / "gate"
MACHINE = """
[machine]
type = "linear_axis"
coordinates = "load"
load_mass = 40.0
[channels]
time = { column = "t", unit = "s" }
position = { column = "x", unit = "m" }
speed = { column = "v", unit = "m/s" }
torque = { column = "u", unit = "N" }
force = { column = "f", unit = "N" }
"""


@cache
def survey(name: str) -> Info:
    return package.info(GATE / name, machine=GATE / "machine.toml")


def shifts(info: Info) -> dict[str, tuple]:
    return {item.channel: fact_of(item) for item in info.findings if item.kind == "channel_shift"}


def test_the_filter_of_the_simulated_speed_is_found_as_its_latency():
    """Two low-passes of a / (1 - a) sample periods each, a = exp(-2 pi 60 Hz 1 ms), and half a period: a difference."""
    keep = np.exp(-2.0 * np.pi * 60.0 * 1e-3)
    true = (2.0 * keep / (1.0 - keep) + 0.5) * 1e-3
    found = shifts(survey("stiff/03.csv"))["speed"].numbers
    assert found["low"] <= true <= found["high"] and found["offset"] == pytest.approx(true, abs=1e-4)


def test_several_logs_have_a_common_result_with_stiff_and_soft_contacts_apart():
    logs = [survey(name) for name in ("stiff/01.mcap", "stiff/03.csv", "stiff/04.csv", "soft/03.csv", "soft/04.csv")]
    found = {item.channel: fact_of(item) for item in common_delays(logs)}
    assert found["force"].kind == "channel_shift" and found["force"].numbers["stiff"] is not None
    assert found["speed"].numbers["events"] > max(shifts(log)["speed"].numbers["events"] for log in logs)


def write(folder: Path, name: str, seed: int, offset: float) -> Path:
    recording, _ = collisions(np.random.default_rng(seed), np.array([0.0]), Clocks(offset))
    time = recording["speed"].time
    force = np.interp(time, recording["force"].time, recording["force"].values[:, 0])
    columns = [time, *(recording[name].values[:, 0] for name in ("position", "speed", "torque")), force]
    path = folder / name
    np.savetxt(path, np.column_stack(columns), delimiter=",", header="t,x,v,u,f", comments="", fmt="%.9g")
    return path


def test_info_prints_each_log_and_what_is_common(tmp_path):
    (tmp_path / "machine.toml").write_text(MACHINE)
    logs = [write(tmp_path, f"{seed}.csv", seed, 0.012) for seed in range(5)]
    done = cdtool("info", *logs, "--machine", tmp_path / "machine.toml")
    each, together = done.out.split("All 5 logs, if their clocks are the same:")
    assert done.status == 0 and "load cell late by 12" in together and "from 5 contacts" in together
    assert "load cell late" not in each and each.count("1 contact with a delay, at least 5 are needed") == 5
    values = json.loads(cdtool("info", logs[0], "--machine", tmp_path / "machine.toml", "--json").out)
    (late,) = [item for item in values[0]["latencies"] if item["channel"] == "force" and item["reference"] == "speed"]
    assert late["offset"] is None or late["offset"]["value"] is None
