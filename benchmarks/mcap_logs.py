"""Long ROS 2 logs: a gate's joint and sensors at 1 kHz, and a camera, which fills the rest.

The samples are those of a recording of the simulated gate, repeated from where it ended, as a position that leapt back
would be damage; the images are noise, which cannot be compressed.
`mcap` writes them in its usual chunks of 1 MiB.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from mcap.writer import CompressionType, Writer

from cdtool.formats.messages.schemas import DEFINITIONS
from cdtool.recordings.recording import Recording

START_NS, STEP_NS, SECOND_NS = 1_700_000_000 * 10**9, 10**6, 10**9
IMAGE_EVERY = 100  # samples
JOINT, CAMERA = "/joint_states", "/camera"
# Topic -> message type, and the channels that its numbers are, in the order of the message.
TOPICS: Mapping[str, tuple[str, tuple[str, ...]]] = {
    JOINT: ("sensor_msgs/msg/JointState", ("position", "speed", "torque")),
    "/accelerometer": ("std_msgs/msg/Float64", ("acceleration",)),
    "/load_cell": ("std_msgs/msg/Float64", ("force",)),
}
MACHINE_CHANNELS = """
[channels.mcap]
torque = { topic = "/joint_states", field = "effort[0]" }
speed = { topic = "/joint_states", field = "velocity[0]" }
position = { topic = "/joint_states", field = "position[0]" }
acceleration = { topic = "/accelerometer", field = "data" }
force = { topic = "/load_cell", field = "data" }
"""
_IMAGE = """std_msgs/Header header
string format
uint8[] data
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""


def write_log(path: Path, run: Recording, seconds: float, compression: str, size: float = 0.0) -> None:
    """Write so many seconds at 1 kHz of the run's channels in motor units, filled up by images to `size` bytes."""
    samples = {name: run[name].values[:, 0].tolist() for _, names in TOPICS.values() for name in names}
    length = min(len(values) for values in samples.values())
    travel = samples["position"][length - 1] - samples["position"][0]
    noise = np.random.default_rng(0).bytes(1 << 20)
    count = round(seconds * SECOND_NS / STEP_NS)
    with path.open("wb") as file:
        writer = Writer(file, compression=CompressionType[compression.upper()])
        writer.start(profile="ros2", library="cdtool")
        channels = {topic: _channel(writer, topic, kind) for topic, (kind, _) in TOPICS.items()}
        image = writer.register_schema("sensor_msgs/msg/CompressedImage", "ros2msg", _IMAGE.encode())
        camera = writer.register_channel(CAMERA, "cdr", image)
        sensors = [item for item in TOPICS.items() if item[0] != JOINT]
        written = pending = 0  # bytes in the file, and of images that wait in a chunk
        for i in range(count):
            stamp, k = START_NS + i * STEP_NS, i % length
            position = samples["position"][k] + i // length * travel
            joint = _joint_state(stamp, position, samples["speed"][k], samples["torque"][k])
            writer.add_message(channels[JOINT], stamp, joint, stamp, i)
            for topic, (_, (name, *_)) in sensors:
                value = struct.pack("<4sd", b"\0\1\0\0", samples[name][k])
                writer.add_message(channels[topic], stamp, value, stamp, i)
            if size and i % IMAGE_EVERY == 0:
                pending = pending if file.tell() == written else 0
                written = file.tell()
                missing = round(size * (i + 1) / count) - written - pending
                content = noise[: min(max(missing, 1000), len(noise) - 100)]
                pending += len(content)
                writer.add_message(camera, stamp, _compressed_image(stamp, content), stamp, i // IMAGE_EVERY)
        writer.finish()


def _channel(writer: Writer, topic: str, kind: str) -> int:
    schema = writer.register_schema(kind, "ros2msg", DEFINITIONS[kind].encode())
    return writer.register_channel(topic, "cdr", schema)


def _joint_state(stamp: int, position: float, speed: float, torque: float) -> bytes:
    """CDR of a JointState of one joint: every float64 stands at a multiple of 8 bytes behind the encapsulation."""
    head = struct.pack("<4siI", b"\0\1\0\0", *divmod(stamp, SECOND_NS))
    frame, names = struct.pack("<I1s3x", 1, b"\0"), struct.pack("<II5s3x", 1, 5, b"gate\0")
    return head + frame + names + struct.pack("<I4xdI4xdI4xd", 1, position, 1, speed, 1, torque)


def _compressed_image(stamp: int, content: bytes) -> bytes:
    head = struct.pack("<4siI", b"\0\1\0\0", *divmod(stamp, SECOND_NS))
    return head + struct.pack("<I1s3xI5s3xI", 1, b"\0", 5, b"jpeg\0", len(content)) + content
