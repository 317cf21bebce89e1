"""Streams, a channel map and files for the tests of MCAP."""

from __future__ import annotations

import json

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from mcap_ros2.decoder import DecoderFactory

from cdtool.formats.channels.channel_map import ChannelMap, ChannelSource, TimeSource
from cdtool.formats.mcap.write import Stream, write_mcap

START = 1_700_000_000 * 10**9
N = 200
TIME = np.arange(N) / 1000
RNG = np.random.default_rng(0)
JOINTS = RNG.normal(size=(N, 3))
STREAMS = [
    Stream(
        "/joint_states",
        "sensor_msgs/msg/JointState",
        TIME,
        {"position": JOINTS, "velocity[0]": JOINTS[:, 1], "effort[0]": JOINTS[:, 2]},
        ("base", "shoulder_joint", "elbow.joint"),
    ),
    Stream("/imu", "sensor_msgs/msg/Imu", TIME + 0.0005, {"linear_acceleration.x": JOINTS[:, 0]}),
    Stream("/load_cell", "geometry_msgs/msg/WrenchStamped", TIME, {"wrench.force.z": JOINTS[:, 1]}),
    Stream("/force", "std_msgs/msg/Float64", TIME, {"data": JOINTS[:, 2]}),
    Stream("/reference", "std_msgs/msg/Float64MultiArray", TIME, {"data[0]": JOINTS[:, 0], "data[1]": JOINTS[:, 1]}),
]


def wanted(*fields, clock="log", joints=("axis",)):
    sources = tuple(ChannelSource("speed", topic=topic, field=field) for topic, field in fields)
    return ChannelMap(TimeSource(clock=clock), sources, joints, topics=True)


def as_dict(message):
    """Return a message of the ROS 2 decoder as a JSON object."""
    if hasattr(message, "__slots__"):
        return {name: as_dict(getattr(message, name)) for name in message.__slots__}
    return list(message) if isinstance(message, list | tuple | np.ndarray) else message


def rewrite(path, encoding, compression):
    """Write the messages of a file again, in another encoding or compression."""
    with path.open("rb") as file:
        rows = list(make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages())
    with path.open("wb") as file:
        writer = Writer(file, compression=compression)
        writer.start()
        channels = {}
        for schema, channel, message, content in rows:
            if channel.id not in channels:
                number = writer.register_schema(schema.name, schema.encoding, schema.data)
                channels[channel.id] = writer.register_channel(channel.topic, encoding, number)
            payload = message.data if encoding == "cdr" else json.dumps(as_dict(content)).encode()
            writer.add_message(channels[channel.id], message.log_time, payload, message.publish_time, message.sequence)
        writer.finish()


@pytest.fixture
def written(tmp_path):
    def write(streams=STREAMS, name="log.mcap", encoding="cdr", compression="zstd", start_ns=START):
        write_mcap(tmp_path / name, streams, start_ns=start_ns)
        if (encoding, compression) != ("cdr", "zstd"):
            rewrite(tmp_path / name, encoding, CompressionType[compression.upper()])
        return tmp_path / name

    return write


@pytest.fixture
def by_hand(tmp_path):
    """Return a function that writes messages of one topic: (log time, publish time, content), as JSON or bytes."""

    def write(
        messages, encoding="json", schema_encoding="jsonschema", schema=b"{}", name="test_msgs/msg/Thing", **options
    ):
        path = tmp_path / "hand.mcap"
        with path.open("wb") as file:
            writer = Writer(file, **{"compression": CompressionType.NONE, **options})
            writer.start()
            number = writer.register_schema(name, schema_encoding, schema)
            channel = writer.register_channel("/a", encoding, number)
            for log_time, publish_time, content in messages:
                payload = content if isinstance(content, bytes) else json.dumps(content).encode()
                writer.add_message(channel, log_time, payload, publish_time)
            writer.finish()
        return path

    return write
