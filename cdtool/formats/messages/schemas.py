"""The public ROS 2 message definitions that cdtool writes (definitions/), with the fields that a stream may fill."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.resources import files


@dataclass(frozen=True)
class Definition:
    """A message type: its definition text, its numeric fields, and its numeric arrays."""

    text: str
    numbers: tuple[str, ...] = ()
    arrays: tuple[str, ...] = ()

    @property
    def header(self) -> bool:
        """Return whether the message has a header."""
        return self.text.startswith("std_msgs/Header header")


def _definition(name: str, numbers: tuple[str, ...] = (), arrays: tuple[str, ...] = ()) -> Definition:
    file = files("cdtool.formats.messages").joinpath("definitions", f"{name.replace('/msg/', '.')}.msg")
    return Definition(file.read_text(encoding="utf-8"), numbers, arrays)


def _vectors(*names: str) -> tuple[str, ...]:
    return tuple(f"{name}.{axis}" for name in names for axis in "xyz")


DEFINITIONS = {
    name: _definition(name, *fields)
    for name, *fields in (
        ("sensor_msgs/msg/JointState", (), ("position", "velocity", "effort")),
        ("sensor_msgs/msg/Imu", (*_vectors("orientation", "angular_velocity", "linear_acceleration"), "orientation.w")),
        ("geometry_msgs/msg/WrenchStamped", _vectors("wrench.force", "wrench.torque")),
        ("std_msgs/msg/Float64", ("data",)),
        ("std_msgs/msg/Float64MultiArray", (), ("data",)),
    )
}
