"""A simulated run of the gate as a recording, without a file in between."""

from __future__ import annotations

from cdtool.commands.simulate.gate_model import GateParameters, GateRun
from cdtool.recordings.recording import Recording, Series


def as_recording(run: GateRun, name: str, parameters: GateParameters) -> Recording:
    """Return a run as it is after reading, without a file in between: every channel on the load side."""
    ratio = parameters.transmission_ratio
    values = {
        "torque": (run.motor_torque / ratio, "N"),
        "speed": (run.motor_speed * ratio, "m/s"),
        "position": (run.motor_position * ratio, "m"),
        "acceleration": (run.acceleration, "m/s2"),
        "reference_speed": (run.reference_speed * ratio, "m/s"),
        "reference_torque": (run.reference_torque / ratio, "N"),
        "force": (run.load_cell, "N"),
    }
    channels = {channel: Series(run.time, array, unit) for channel, (array, unit) in values.items()}
    return Recording(name, name, ("gate",), channels)
