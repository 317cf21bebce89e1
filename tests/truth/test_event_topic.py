"""A topic with one message per contact is ground truth."""

from __future__ import annotations

import numpy as np
import pytest

import cdtool
from cdtool.formats.mcap.write import Stream, write_mcap

MACHINE = """
[machine]
type = "linear_axis"
name = "door"
load_mass = 50.0
coordinates = "load"
[channels.mcap]
torque = { topic = "/joint_states", field = "effort[0]" }
speed = { topic = "/joint_states", field = "velocity[0]" }
event = { topic = "/contact", field = "data" }
"""


@pytest.fixture
def folder(tmp_path):
    time = np.arange(4000) * 1e-3
    speed = 0.2 * np.ones(4000)
    states = {
        "effort[0]": 10.0 + 100.0 * ((time > 1.51) & (time < 1.7)),
        "velocity[0]": speed,
        "position[0]": 0.2 * time,
    }
    streams = [
        Stream("/joint_states", "sensor_msgs/msg/JointState", time, states, ("door",)),
        Stream("/contact", "std_msgs/msg/Float64", np.array([1.5, 1.6, 3.0]), {"data": np.array([1.0, 1.0, 1.0])}),
    ]
    write_mcap(tmp_path / "log.mcap", streams, start_ns=1_700_000_000 * 10**9)
    (tmp_path / "machine.toml").write_text(MACHINE)
    return tmp_path


def test_an_alarm_is_matched_with_it_and_no_detector_reads_it(folder):
    found = cdtool.detect(
        folder / "log.mcap", folder / "machine.toml", detector="pt", settings={"threshold.limits": 50}
    )
    outcomes = [(item.outcome, round(item.latency, 3)) for item in found.detected.matchings[0].matches]
    assert outcomes[0] == ("detected", 0.019) and outcomes[1][0] == "missed"
    assert "event" not in found.detections[0].operation.recording.without_ground_truth()
