"""A simulated run of the arm as a recording, without a file in between."""

from __future__ import annotations

from cdtool.commands.simulate.arm_model import ArmRun
from cdtool.recordings.recording import Recording, Series

_JOINTS = ("arm", "forearm")


def as_recording(run: ArmRun, name: str) -> Recording:
    """Return a run as logged, without a file in between: motor torque, speed and angle, accelerations, load cell."""
    values = {
        "torque": (run.motor_torque, "N m"),
        "speed": (run.motor_speed, "rad/s"),
        "position": (run.motor_position, "rad"),
        "acceleration": (run.imu, "m/s2"),
        "reference_speed": (run.reference_speed, "rad/s"),
        "reference_position": (run.reference_position, "rad"),
        "force": (run.load_cell, "N"),
    }
    channels = {channel: Series(run.time, array, unit) for channel, (array, unit) in values.items()}
    return Recording(name, name, _JOINTS, channels)
