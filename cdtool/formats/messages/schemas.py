"""The public ROS 2 message definitions that cdtool writes and knows without a log's own (definitions/)."""

from __future__ import annotations

from importlib.resources import files

_FOLDER = files("cdtool.formats.messages").joinpath("definitions")
# Text by message type, such as sensor_msgs/msg/JointState.
DEFINITIONS = {
    file.name.removesuffix(".msg").replace(".", "/msg/"): file.read_text(encoding="utf-8")
    for file in sorted(_FOLDER.iterdir(), key=lambda file: file.name)
}
