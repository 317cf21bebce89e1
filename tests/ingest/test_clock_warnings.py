"""Findings on logs whose clocks restart, wrap, stand still or do not overlap."""

from __future__ import annotations

import numpy as np
import pytest

from cdtool.clock import clean_time
from cdtool.errors import RecordingError
from cdtool.findings import Finding
from cdtool.findings.clocks import BackwardStamps, ClockRestart, ClocksApart
from cdtool.formats.mcap.write import Stream, write_mcap
from cdtool.ingest.reading import read_recording
from tests.ingest.test_channel_assembly import channels_and_facts, gate_columns, table


def test_rows_dropped_after_a_restart_of_the_clock_are_a_loss(log, machine):
    columns = gate_columns()
    columns["t"][40:] = 10.0 * np.arange(10)
    losses = [item for item in read_recording(log(table(columns)), machine()).findings if item.severity == "loss"]
    restart = BackwardStamps(10, 50, (42, 43, 44), "line", ClockRestart())
    assert losses == [Finding(restart, "time", "loss")]


def test_a_counters_wrap_is_reported_for_the_counter_in_the_file(log, machine):
    columns = gate_columns()
    columns["t"] = np.mod(65536.0 - 300.0 + 10.0 * np.arange(50), 65536.0)
    facts = [fact for _, fact in channels_and_facts(read_recording(log(table(columns)), machine()))]
    assert [fact.restart for fact in facts if isinstance(fact, BackwardStamps)] == [ClockRestart(wrapped_bits=16)]


def test_a_clock_that_stands_still_is_a_clear_error(log, machine):
    columns = gate_columns()
    columns["t"][:] = 0.0
    with pytest.raises(RecordingError, match="time: none of the 50 time stamps is above 0 s: the clock stands still"):
        read_recording(log(table(columns)), machine())


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
    findings = [
        item for item in read_recording(path, machine(OWN_CLOCKS)).findings if isinstance(item.fact, ClocksApart)
    ]
    later, before = ("torque", "speed") if starts[0] < starts[1] else ("speed", "torque")
    assert [item.channel for item in findings] == [later] * bool(distance)
    assert all(item.fact == ClocksApart(pytest.approx(distance, rel=1e-6), before) for item in findings)


def test_every_row_of_a_clock_that_runs_backward_is_counted():
    (finding,) = clean_time(np.arange(5000, 0, -1) * 1e-3).findings
    assert isinstance(finding.fact, BackwardStamps) and (finding.fact.count, finding.fact.rows) == (4999, 5000)
