from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from cdtool.formats.machine_file import MachineFile, read_machine_file

_MACHINE = """
[machine]
type = "linear_axis"
name = "gate"
motor_inertia = 9.5e-4
load_mass = 620.0
transmission_ratio = 2.0e-3
viscous_friction = 2.67e-4
"""

COLUMNS = """
[channels]
time = { column = "t", unit = "ms" }
torque = { column = "i_motor", unit = "A", scale = 0.5 }
speed = { column = "n_motor", unit = "rad/s" }
"""

TOPICS = """
[channels.mcap]
torque = { topic = "/joint_states", field = "effort[0]" }
speed = { topic = "/joint_states", field = "velocity[0]" }
position = { topic = "/joint_states", field = "position[0]" }
acceleration = { topic = "/imu", field = "linear_acceleration.x", scale = -1 }
force = { topic = "/load_cell", field = "wrench.force.z" }
"""


@pytest.fixture
def machine(tmp_path: Path) -> Callable[..., MachineFile]:
    """Return a function that writes a machine file with these channels (and machine table) and reads it."""

    def write(channels: str = COLUMNS, machine_table: str = _MACHINE) -> MachineFile:
        path = tmp_path / "machine.toml"
        path.write_text(machine_table + channels, encoding="utf-8")
        return read_machine_file(path)

    return write


@pytest.fixture
def log(tmp_path: Path) -> Callable[..., Path]:
    """Return a function that writes a log file."""

    def write(content: str | bytes, name: str = "log.csv") -> Path:
        path = tmp_path / name
        path.write_bytes(content.encode() if isinstance(content, str) else content)
        return path

    return write
