"""Findings on clocks that restart, wrap, stand still or do not overlap, and the guess of a clock by `info`."""

from __future__ import annotations

import numpy as np
import pytest

from cdtool.base.findings import Finding
from cdtool.commands.judging.information import info
from cdtool.formats.channels.reading import read_recording
from cdtool.formats.csv.table import DAY_S
from cdtool.formats.mcap.write import Stream, write_mcap
from tests.base.findings.facts import fact_of
from tests.command import cdtool
from tests.formats.channels.test_channel_assembly import channels_and_facts, gate_columns, table


def test_rows_dropped_after_a_restart_of_the_clock_are_a_loss(log, machine):
    columns = gate_columns()
    columns["t"][40:] = 10.0 * np.arange(10)
    losses = [item for item in read_recording(log(table(columns)), machine()).findings if item.severity == "loss"]
    restart = {"count": 10, "rows": 50, "first": (42, 43, 44), "row_name": "line", "restart": {"wrapped_bits": 0}}
    assert losses == [Finding("backward_stamps", "time", restart, "loss")]


def test_a_counters_wrap_is_reported_for_the_counter_in_the_file(log, machine):
    columns = gate_columns()
    columns["t"] = np.mod(65536.0 - 300.0 + 10.0 * np.arange(50), 65536.0)
    facts = [fact for _, fact in channels_and_facts(read_recording(log(table(columns)), machine()))]
    assert [fact.numbers["restart"] for fact in facts if fact.kind == "backward_stamps"] == [{"wrapped_bits": 16}]


def two_topics(path, starts, stamps=40):
    """Write speed and torque whose header clocks start at these times [s]."""
    time = np.arange(stamps) / 100
    names = (("/drive", "velocity[0]"), ("/gripper", "effort[0]"))
    streams = [
        Stream(topic, "sensor_msgs/msg/JointState", time + start, {field: time})
        for (topic, field), start in zip(names, starts, strict=True)
    ]
    write_mcap(path, streams, start_ns=10**9)


OWN_CLOCKS = """
[channels.mcap]
time = { clock = "header" }
speed = { topic = "/drive", field = "velocity[0]" }
torque = { topic = "/gripper", field = "effort[0]" }
"""


@pytest.mark.parametrize(("starts", "distance"), [((0.0, 100.0), 99.61), ((7e8, 0.0), 7e8), ((0.0, 0.3), 0.0)])
def test_channels_whose_times_do_not_overlap_are_reported_with_their_distance(tmp_path, machine, starts, distance):
    path = tmp_path / "run.mcap"
    two_topics(path, starts)
    findings = [item for item in read_recording(path, machine(OWN_CLOCKS)).findings if item.kind == "clocks_apart"]
    later, before = ("torque", "speed") if starts[0] < starts[1] else ("speed", "torque")
    assert [item.channel for item in findings] == [later] * bool(distance)
    assert all(
        fact_of(item) == ("clocks_apart", {"distance": pytest.approx(distance, rel=1e-6), "before": before})
        for item in findings
    )


@pytest.mark.parametrize(("steady", "wanted"), [(True, ["speed, torque"]), (False, [])])
def test_regular_header_stamps_are_named_where_log_times_vary(by_hand, machine, tmp_path, steady, wanted):
    time, late = np.arange(1, 1000) * 10**7, np.random.default_rng(1).integers(0, 9 * 10**6, (2, 999))
    logged, stamps = time + late[0], time if steady else time + late[1]
    speed, torque = np.sin(time / 1e9), 5.0 * np.cos(time / 1e9)
    header = [{"stamp": {"sec": at // 10**9, "nanosec": at % 10**9}} for at in stamps.tolist()]
    contents = [{"header": h, "velocity": v, "torque": t} for h, v, t in zip(header, speed, torque, strict=True)]
    path = by_hand([(at, at, content) for at, content in zip(logged.tolist(), contents, strict=True)])
    fields = {"speed": "velocity", "torque": "torque"}
    channels = "".join(f'{name} = {{ topic = "/a", field = "{field}" }}\n' for name, field in fields.items())
    mapped = machine(f"[channels.mcap]\n{channels}")
    findings = info(path, machine=mapped).findings
    assert [item.channel for item in findings if item.kind == "steady_header"] == wanted
    drafted = cdtool("init", path, "-o", tmp_path / "draft.toml")
    assert ('write time = { clock = "header" }' in drafted.err) == steady and drafted.status == 0


def test_a_speed_of_empty_arrays_is_to_be_deleted(by_hand, machine):
    messages = [(i * 10**7, i * 10**7, {"position": [i / 400.0], "velocity": []}) for i in range(400)]
    fields = {"position": "position[0]", "speed": "velocity[0]"}
    channels = "".join(f'{name} = {{ topic = "/a", field = "{field}" }}\n' for name, field in fields.items())
    recording = read_recording(by_hand(messages), machine(f"[channels.mcap]\n{channels}"))
    assert Finding("speed_without_value", "speed") in recording.findings


@pytest.mark.parametrize("rate_hz", [1.0, 10.0, 1000.0])
def test_excel_days_are_distinguished_from_seconds_at_any_rate(tmp_path, rate_hz):
    days = 45231.5 + np.arange(2000) / rate_hz / DAY_S
    path = tmp_path / "log.csv"
    path.write_text("time,torque\n" + "".join(f"{day:.12f},{i % 7}\n" for i, day in enumerate(days)))
    shown = info(path)
    assert any(finding.numbers.get("evidence", "") == "excel" for finding in shown.findings)
    assert [channel.rate_hz for channel in shown.channels] == [pytest.approx(rate_hz, rel=1e-3)] * 2


@pytest.mark.parametrize(("name", "is_one"), [("time", True), ("travel", False)])
def test_uneven_steps_are_those_of_a_clock_only_if_its_name_says_so(tmp_path, name, is_one):
    steps = np.random.default_rng(1).choice([0.005, 0.016, 0.031, 0.047], 2000)
    path = tmp_path / "log.csv"
    path.write_text(f"{name},torque\n" + "".join(f"{time:.3f},{i % 7}\n" for i, time in enumerate(np.cumsum(steps))))
    assert any(finding.numbers.get("evidence", "") == "steps" for finding in info(path).findings) is is_one


@pytest.mark.parametrize(
    ("first", "evidence"),
    [("23:59:5", "digits"), ("12:00:0", "digits"), ("08:30:0", "steps")],
    ids=["near midnight", "noon", "fewer seconds than a day has"],
)
def test_times_of_day_without_colons_are_said(tmp_path, first, evidence):
    start = first.replace(":", "")
    path = tmp_path / "log.csv"
    path.write_text("Time,torque\n" + "".join(f"{start}{i / 100:.2f},{i % 7}\n" for i in range(900)))
    assert [finding.numbers["evidence"] for finding in info(path).findings if finding.kind == "assumed_clock"] == [
        evidence
    ]


def test_seconds_of_more_than_a_day_are_no_times_of_day(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("Time,torque\n" + "".join(f"{120000 + i / 10:.1f},{i % 7}\n" for i in range(900)))
    assert [finding.numbers["evidence"] for finding in info(path).findings if finding.kind == "assumed_clock"] == [
        "steps"
    ]
