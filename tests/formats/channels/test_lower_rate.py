"""Tables in which channels of several rates share the column of times: empty cells of the slow ones are no samples."""

from __future__ import annotations

import numpy as np
import pytest

import cdtool
from cdtool.formats.channels.reading import read_recording
from cdtool.recordings.clock.lost_samples import lost_samples
from tests.base.findings.facts import fact_of

CHANNELS = """[channels]
time = { column = "t", unit = "ms" }
torque = { column = "torque", unit = "N m" }
speed = { column = "speed", unit = "rad/s" }
position = { column = "phi", unit = "rad" }
label = { column = "label" }
"""


def table(step=4, lost=(), rows=400):
    """Torque in each row, speed in every `step`-th one but those in `lost`, a label in one row only."""
    lines = ["t,torque,speed,phi,label"]
    for i in range(rows):
        speed = f"{0.5 * i:.1f}" if i % step == 0 and i not in lost else ""
        lines.append(f"{i},{0.25 * i},{speed},{i / 100},{'1' if i % 100 == 7 else ''}")
    return "\n".join(lines) + "\n"


def facts(recording, channel):
    return [fact_of(finding) for finding in recording.findings if finding.channel == channel]


def test_a_channel_of_a_lower_rate_has_its_own_clock_and_misses_nothing(log, machine):
    recording = read_recording(log(table()), machine(CHANNELS))
    speed = recording["speed"]
    assert speed.time == pytest.approx([i / 1000 for i in range(0, 400, 4)], abs=1e-12)
    assert np.isfinite(speed.values).all()
    assert len(recording["torque"]) == 400
    assert facts(recording, "speed") == [("lower_rate", {"rate": pytest.approx(250.0), "share": pytest.approx(0.25)})]
    assert lost_samples(recording, ["torque", "speed"], recording["torque"].time) is None


def test_a_lost_sample_of_a_lower_rate_is_a_gap_and_lost(log, machine):
    recording = read_recording(log(table(lost=range(200, 220))), machine(CHANNELS))
    assert "sample_gaps" in [fact.kind for fact in facts(recording, "speed")]
    lost = lost_samples(recording, ["speed"], recording["torque"].time)
    assert lost is not None and lost[215, 0] and not lost[150, 0] and not lost[230, 0]


def test_single_missing_cells_and_a_sensor_that_fails_stay_missing_values(log, machine):
    lines = table(step=1).splitlines()
    for i in (50, 51, 120):
        cells = lines[1 + i].split(",")
        lines[1 + i] = ",".join([*cells[:2], "", *cells[3:]])
    recording = read_recording(log("\n".join(lines) + "\n"), machine(CHANNELS))
    assert ("missing_values", {"count": 3, "values": 400}) in facts(recording, "speed") and len(
        recording["speed"]
    ) == 400
    dead = read_recording(log(table(step=1, lost=range(250, 400))), machine(CHANNELS))
    assert ("missing_values", {"count": 150, "values": 400}) in facts(dead, "speed") and len(dead["speed"]) == 400


def test_info_shows_the_rate_of_a_channel_and_no_missing_values(log, machine):
    path = log(table())
    plain = {channel.name: channel for channel in cdtool.info(path).channels}
    assert (plain["speed"].samples, plain["speed"].missing) == (100, 0)
    assert plain["speed"].rate_hz == pytest.approx(250.0)
    assert (plain["torque"].samples, plain["torque"].missing) == (400, 0)
    mapped = {channel.name: channel for channel in cdtool.info(path, machine=machine(CHANNELS)).channels}
    assert mapped["speed"].rate_hz == pytest.approx(250.0) and mapped["speed"].missing == 0
