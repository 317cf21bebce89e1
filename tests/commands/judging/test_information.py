"""`cdtool info` without a machine file: clock, gaps, missing values."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import cdtool
from cdtool.commands.init.drafting import init
from cdtool.commands.judging.information import info
from cdtool.formats.mcap.write import Stream, write_mcap
from tests.base.findings.facts import fact_of
from tests.command import cdtool as command
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


KINDS = ("placeholder_inertia", "placeholder_ratio", "placeholder_scale", "unchecked_lines")


@pytest.fixture
def log(tmp_path):
    """A motor at up to 1432 rpm, 150 rad/s, with its current."""
    time = np.arange(2000) / 500.0
    speed = 150.0 * np.sin(2.0 * time)
    current = 0.4 * np.cos(2.0 * time) + np.sign(speed)
    path = tmp_path / "log.csv"
    rows = np.column_stack((time, speed * 60.0 / (2.0 * np.pi), current))
    np.savetxt(path, rows, delimiter=",", header="t [s],n [rpm],i [A]", comments="")
    return path


def machine_file(folder, kind="linear_axis", ratio=1.0, mass=0.0, scale=1.0, coordinates="motor"):
    path = folder / "machine.toml"
    load = "load_mass" if kind == "linear_axis" else "load_inertia"
    path.write_text(
        f'[machine]\ntype = "{kind}"\ncoordinates = "{coordinates}"\ntransmission_ratio = {ratio}\n{load} = {mass}\n'
        '[channels]\ntime = { column = "t", unit = "s" }\nspeed = { column = "n", unit = "rpm" }\n'
        f'torque = {{ column = "i", unit = "A", scale = {scale} }}\n'
    )
    return path


def placeholders(log, machine):
    return {item.kind: fact_of(item) for item in info(log, machine=machine).findings if item.kind in KINDS}


def test_a_draft_has_warnings_with_the_speed_that_a_placeholder_causes(log, tmp_path):
    init(log, tmp_path / "machine.toml")
    found = placeholders(log, tmp_path / "machine.toml")
    assert set(found) == set(KINDS)
    assert found["placeholder_ratio"].numbers["speed"] == pytest.approx(150.0, rel=1e-3)
    assert found["placeholder_scale"] == ("placeholder_scale", {"raw": "A", "unit": "N m", "per": "A"})
    assert found["placeholder_inertia"].numbers["key"] == "load_mass"
    assert (
        "transmission_ratio" in found["unchecked_lines"].numbers["keys"]
        and found["unchecked_lines"].numbers["count"] >= 4
    )


def test_each_placeholder_is_found_alone(log, tmp_path):
    complete = {"ratio": 0.01, "mass": 20.0, "scale": 0.05}
    for key, value, kind in (("ratio", 1.0, "placeholder_ratio"), ("mass", 0.0, "placeholder_inertia"),
                             ("scale", 1.0, "placeholder_scale")):  # fmt: skip
        assert set(placeholders(log, machine_file(tmp_path, **{**complete, key: value}))) == {kind}


def table(path, stamps):
    path.write_text("time,torque\n" + "".join(f"{stamp},{np.sin(i):.4f}\n" for i, stamp in enumerate(stamps)))
    return path


@pytest.mark.parametrize(
    ("stamps", "told"),
    [
        ([5] * 400, "time: named as a clock, but all of its 400 stamps are the same: the clock stands still"),
        ([i // 100 for i in range(4000)], "time: named as a clock, but 99 % of its stamps repeat: a coarse clock"),
        ([0.01 * (i // 2) for i in range(400)], "time: named as a clock, but 50.1 % of its stamps repeat"),
        (np.random.default_rng(1).permutation(400).tolist(), "time: named as a clock, but it runs backward at"),
    ],
    ids=["constant", "coarse", "half", "shuffled"],
)
def test_an_unusable_clock_is_reported(tmp_path, stamps, told):
    done = command("info", table(tmp_path / "log.csv", stamps))
    assert f"warning: {told}" in done.out and "no warnings" not in done.out
    assert "no column looks like a clock: rates, gaps and times are unknown" in done.out


def test_topics_whose_stamps_repeat_are_reported(tmp_path):
    path, time = tmp_path / "log.mcap", np.repeat(np.arange(10.0), 30)
    write_mcap(path, [Stream("/drive", "sensor_msgs/msg/JointState", time, {"velocity[0]": time})], start_ns=10**9)
    assert any(item.kind == "coarse_stamps" for item in info(path).findings)


def test_a_valid_clock_causes_no_finding(tmp_path):
    shown = info(table(tmp_path / "log.csv", [f"{0.01 * i:.2f}" for i in range(400)]))
    assert {item.severity for item in shown.findings} == {"note"}


def test_losses_come_first(tmp_path):
    path = tmp_path / "log.csv"
    lines = ["t,a", *(f"{0.01 * i:.2f},{i % 7}.0" for i in range(500))]
    lines[300] = "2.99,#?"
    lines[400] = "0.5,1.0"
    path.write_text("\n".join(lines) + "\n")
    words = [item.severity for item in info(path).findings]
    assert words[0] == "loss" and words == sorted(words, key=("loss", "warning", "note").index)
    shown = [
        line.split(":")[0] for line in command("info", path).out.splitlines() if line[:4] in ("loss", "warn", "note")
    ]
    assert shown == words


def test_a_log_gives_the_same_findings_whatever_the_hashes_of_texts_are():
    gate = Path(__file__).parents[3] / "sample_logs" / "gate"
    command = [sys.executable, "-m", "cdtool", "info", gate / "free" / "09.csv", "-m", gate / "machine.toml"]
    said = {
        subprocess.run(command, env={**os.environ, "PYTHONHASHSEED": seed}, capture_output=True, check=True).stdout
        for seed in "123"
    }
    assert len(said) == 1 and b"latency against the position not assessable in 6 events" in said.pop()
