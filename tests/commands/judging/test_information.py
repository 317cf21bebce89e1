"""`cdtool info` without a machine file: clock, gaps, missing values."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import cdtool
from tests.base.findings.facts import fact_of
from tests.data_folder import UR10E_LOGS, data, needs_data


def write(path: Path, header: str, columns: list[np.ndarray]) -> Path:
    np.savetxt(path, np.column_stack(columns), delimiter=",", header=header, comments="", fmt="%.9g")
    return path


@pytest.mark.parametrize(
    ("header", "factor", "unit"),
    [("t,v", 1.0, "s"), ("Time,v", 1e3, "ms"), ("stamp,v", 1e6, "us"), ("time [ms],v", 1e3, "ms"), ("a,v", 1e9, "ns")],
)
def test_the_clock_is_guessed_by_name_and_steps_and_the_guess_is_shown(tmp_path, header, factor, unit):
    time = np.arange(2000) * 1e-3
    info = cdtool.info(write(tmp_path / "a.csv", header, [time * factor, np.sin(time)]))
    assert [channel.rate_hz for channel in info.channels] == pytest.approx([1000.0] * 2)
    assert info.channels[1].duration_s == pytest.approx(1.999)
    (clock,) = [item for item in info.findings if item.kind == "assumed_clock"]
    assert clock.numbers["unit"] == unit and clock.channel == header.partition(",")[0]


def test_gaps_backward_time_and_missing_values_are_reported_together(tmp_path):
    time = np.arange(2000) * 1e-3
    time[1000:] += 0.4
    time[500] = 0.1
    values = np.sin(time)
    values[[7, 8]] = np.nan
    info = cdtool.info(write(tmp_path / "a.csv", "t,v", [time, values]))
    told = [(item.channel, fact_of(item)) for item in info.findings]
    gaps = ("sample_gaps", {"count": 1, "first": ({"time": pytest.approx(0.999), "length": pytest.approx(0.401)},)})
    assert (
        "time",
        ("backward_stamps", {"count": 1, "rows": 2000, "first": (502,), "row_name": "line", "restart": None}),
    ) in told
    assert ("t", gaps) in told and ("v", ("missing_values", {"count": 2, "values": 2000})) in told


def test_without_a_clock_no_rate_is_shown(tmp_path):
    rng = np.random.default_rng(1)
    info = cdtool.info(write(tmp_path / "a.csv", "a,b", [rng.normal(size=50), rng.normal(size=50)]))
    assert [channel.rate_hz for channel in info.channels] == [None, None]


@needs_data("ur3e/L0L1.csv")
def test_the_real_clock_of_a_wide_robot_log_is_found():
    info = cdtool.info(data("ur3e/L0L1.csv"))
    assert info.channels[0].rate_hz == pytest.approx(25.0, rel=0.05)


def test_swapped_columns_of_joints_are_reported(tmp_path):
    time = np.arange(4000) * 1e-3
    positions = [np.sin(time), 0.7 * np.sin(2.3 * time + 1.0), np.full(len(time), 0.3)]
    speeds = [np.gradient(item, 1e-3) for item in positions]
    log = write(tmp_path / "a.csv", "t,v1,v2,v3,q1,q2,q3", [time, *speeds, *positions])
    text = """
[machine]
type = "rotary_axis"
joints = ["a", "b", "c"]
coordinates = "load"
[channels]
time = { column = "t", unit = "s" }
speed = { columns = ["v1", "v2", "v3"], unit = "rad/s" }
position = { columns = ["ORDER", "q3"], unit = "rad" }
"""
    told = {}
    for order in ("q1,q2", "q2,q1"):
        machine = tmp_path / "machine.toml"
        machine.write_text(text.replace("ORDER", order.replace(",", '", "')))
        findings = cdtool.info(log, machine=machine).findings
        told[order] = [(item.numbers["joint"], item.numbers["between"]) for item in findings if item.severity == "loss"]
    assert told == {"q1,q2": [], "q2,q1": [("a", "b"), ("b", "a")]}


def test_the_right_columns_of_a_real_robot_are_not_suspected(tmp_path):
    machine = tmp_path / "machine.toml"
    columns = "[channels]\ntime = { column = 0, unit = 's' }\nposition = { columns = [POSE], unit = 'rad' }\n"
    columns += "speed = { columns = [7, 8, 9, 10, 11, 12], unit = 'rad/s' }\n"
    names = "[machine]\ntype = 'rotary_axis'\ncoordinates = 'load'\njoints = ['a', 'b', 'c', 'd', 'e', 'f']\n"
    told = {}
    for order in ("1, 2, 3, 4, 5, 6", "2, 1, 3, 4, 5, 6"):
        machine.write_text(names + columns.replace("POSE", order))
        info = cdtool.info(UR10E_LOGS / "no_torque.csv.gz", machine=machine)
        told[order] = sum(item.severity == "loss" for item in info.findings)
    assert told == {"1, 2, 3, 4, 5, 6": 0, "2, 1, 3, 4, 5, 6": 2}


def test_a_torque_without_values_causes_no_traceback(tmp_path):
    from tests.command import cdtool as command
    from tests.command import keys

    made = command("simulate", "gate", *keys(free=1, holdout=0, stiff=0, soft=0), "-o", tmp_path / "gate")
    assert made.status == 0
    path = tmp_path / "gate" / "free" / "01.csv"
    header, *rows = path.read_text(encoding="utf-8").splitlines()
    at = header.split(",").index("i_motor")
    blind = [",".join("" if i == at else cell for i, cell in enumerate(row.split(","))) for row in rows]
    path.write_text("\n".join([header, *blind]) + "\n", encoding="utf-8")
    done = command("info", path, "-m", tmp_path / "gate" / "machine.toml")
    assert "Traceback" not in done.err and done.status in (0, 3)
