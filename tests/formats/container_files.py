"""Small recordings that the tests of several containers write, and an exact comparison of recordings."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cdtool.formats.channels.channel_assembly import assemble_recording
from cdtool.formats.channels.reading import mapped_source
from cdtool.formats.machine_file import read_machine_file
from cdtool.formats.mcap.write import Stream, write_mcap
from cdtool.recordings.recording import Recording

MACHINE = """# A gate, as its maker knows it.
[machine]
type = "linear_axis"
name = "gate"
motor_inertia = 9.5e-4
load_mass = 620
transmission_ratio = 1.333e-3

[channels]  # of a table
time = { column = "time", unit = "s" }
speed_low_pass_hz = 40
torque = { column = "torque", unit = "N m" }
speed = { column = "speed", unit = "rad/s" }

[channels.mcap]
speed_low_pass_hz = 40
torque = { topic = "/drive", field = "effort[0]" }
speed = { topic = "/drive", field = "velocity[0]" }
acceleration = { topic = "/imu", field = "linear_acceleration.x", unit = "g" }

[detectors.feekf]
minimum_speed = 0.015  # m/s
"""


def machine_file(folder: Path, text: str = MACHINE) -> Path:
    """Write a machine file for all of these recordings."""
    path = folder / "machine.toml"
    path.write_text(text)
    return path


def two_clocks(path: Path, start_ns: int = 0) -> Path:
    """Write an MCAP file: a drive at 1 kHz and an accelerometer at 3 kHz that starts later."""
    random = np.random.default_rng(4)
    drive = Stream(
        "/drive",
        "sensor_msgs/msg/JointState",
        np.arange(300) / 1000.0,
        {"effort[0]": random.normal(size=300), "velocity[0]": random.normal(size=300)},
    )
    drive.fields["effort[0]"][[3, 7]] = np.nan, -0.0
    imu_time = 0.0101 + np.arange(700) / 3000.0
    imu = Stream("/imu", "sensor_msgs/msg/Imu", imu_time, {"linear_acceleration.x": random.normal(size=700)})
    write_mcap(path, [drive, imu], start_ns=start_ns)
    return path


def logged(path: Path | str, machine: Path | str) -> Recording:
    """Return the channels of a file as logged."""
    source, channels = mapped_source(Path(path), read_machine_file(machine))
    return assemble_recording(source, channels, read_machine_file(machine).machine, "digest").recording


def assert_same(recording: Recording, other: Recording, exact_time: bool = True) -> None:
    """Check that channels, units, values and times are exactly equal, or the times to about a nanosecond."""
    assert set(recording.channels) == set(other.channels)
    for name, series in recording.channels.items():
        assert other[name].unit == series.unit
        assert other[name].values.tobytes() == series.values.tobytes(), name
        if exact_time:
            assert other[name].time.tobytes() == series.time.tobytes(), name
        else:
            time, other_time = series.time - recording.start, other[name].time - other.start
            np.testing.assert_allclose(other_time, time, rtol=0.0, atol=1.5e-9)
