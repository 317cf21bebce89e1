"""Speed and acceleration as derivatives: the wrong sign, unit, clock or joint is named, and rest is no evidence."""

from __future__ import annotations

import numpy as np
import pytest

from cdtool.base.arrays import FloatArray
from cdtool.base.findings import Finding
from cdtool.machines.plausibility import derivatives
from cdtool.recordings.recording import Recording, Series

TIME = np.arange(0.0, 10.0, 2e-3)
JOINTS = ("shoulder", "elbow", "wrist")
UNITS = {"position": "m", "speed": "m/s", "acceleration": "m/s2"}


def contradictions(recording: Recording) -> dict[tuple[str, str], Finding]:
    checks = [item for item in derivatives([recording]) if item.severity == "loss"]
    return {(item.channel, item.numbers["joint"]): item for item in checks}


def stroke(clock: float = 1.0, **factors: float) -> Recording:
    """One stroke of an axis with a noisy accelerometer, its clock and channels multiplied by factors."""
    time = np.arange(6000) * 1e-3
    acceleration = np.where((time > 0.5) & (time < 1.5), 0.2, 0.0) - np.where((time > 4.0) & (time < 5.0), 0.2, 0.0)
    speed = np.cumsum(acceleration) * 1e-3
    noise = 5e-3 * np.random.default_rng(1).standard_normal(len(time))
    values = {"position": np.cumsum(speed) * 1e-3, "speed": speed, "acceleration": acceleration + noise}
    channels = {name: Series(clock * time, factors.get(name, 1.0) * own, UNITS[name]) for name, own in values.items()}
    return Recording("log", "log", ("axis",), channels)


def arm(speed: FloatArray, position: FloatArray) -> Recording:
    channels = {"speed": Series(TIME, speed, "rad/s"), "position": Series(TIME, position, "rad")}
    return Recording("arm", "arm.csv", JOINTS, channels)


def swing(amplitude: float) -> tuple[FloatArray, FloatArray]:
    return amplitude * np.cos(0.8 * TIME), amplitude / 0.8 * np.sin(0.8 * TIME)


@pytest.mark.parametrize(
    ("factors", "channel", "found", "size", "units"),
    [
        ({"clock": 1000.0}, "speed", "size", 1000.0, "ms and s"),
        ({"clock": 1e-3}, "speed", "size", 1e-3, "ms and s"),
        ({"clock": 1e6}, "speed", "size", 1e6, "us and s"),
        ({"clock": 1e-6}, "speed", "size", 1e-6, "us and s"),
        ({"clock": 1.0 / 60.0}, "speed", "size", 1.0 / 60.0, "min and s"),
        ({"position": 1000.0}, "speed", "size", 1e-3, "mm and m"),
        ({"position": 2.0 * np.pi}, "speed", "size", 0.159, "turns and rad"),
        ({"speed": 180.0 / np.pi}, "speed", "size", 57.3, "deg and rad"),
        ({"speed": 100.0}, "speed", "size", 100.0, ""),
        ({"position": -1.0}, "speed", "sign", -1.0, ""),
        ({"speed": -30.0}, "speed", "sign", -30.0, ""),
        ({"acceleration": -1.0}, "acceleration", "sign", -1.0, ""),
        ({"acceleration": 1.0 / 9.80665}, "acceleration", "size", 0.102, "g and m/s2"),
        ({"acceleration": 1000.0}, "acceleration", "size", 1000.0, "mm and m"),
    ],
)
def test_a_wrong_sign_unit_or_clock_is_found_with_its_factor(factors, channel, found, size, units):
    ((key, check),) = contradictions(stroke(**factors)).items()
    assert key == (channel, "") and check.numbers["found"] == found and units in check.numbers["between"]
    assert check.numbers["value"] == pytest.approx(size, rel=0.1)


def test_a_coordinate_of_a_tool_is_no_speed_although_it_follows_one():
    """On a circle at constant speed x is proportional to dy/dt, but at rest it is not zero."""
    angle = np.clip(0.4 * (TIME - 1.0), 0.0, 1.2)[:, np.newaxis]
    channels = {"position": Series(TIME, np.sin(angle), "m"), "speed": Series(TIME, 0.4 * np.cos(angle), "m/s")}
    tool = Recording("arm", "arm.csv", ("axis",), channels)
    assert contradictions(tool)["speed", ""].numbers["found"] == "still"


@pytest.mark.parametrize("quantum", [0.0, 1e-4])
@pytest.mark.parametrize("offset", [0.0, 1e-3])
@pytest.mark.parametrize("seed", range(3))
def test_joints_at_rest_contradict_nothing_whatever_noise_offset_and_encoder(seed, offset, quantum):
    rng = np.random.default_rng(seed)
    speed, position = (np.column_stack([column, column, column]) for column in swing(0.5))
    speed[:, 1:] = offset + rng.normal(0.0, 5e-3, (len(TIME), 2))
    position[:, 1:] = 0.3 + rng.normal(0.0, 5e-5, (len(TIME), 2))
    # The wrist sags by a few encoder steps while it is held.
    position[:, 2] += 4e-4 * TIME / TIME[-1]
    if quantum:
        position = np.round(position / quantum) * quantum
    assert not contradictions(arm(speed, position))
