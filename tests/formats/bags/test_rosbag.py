from __future__ import annotations

import numpy as np
import pytest

from cdtool.base.errors import RecordingError
from cdtool.formats.channels.reading import read_recording, survey
from cdtool.formats.machine_file import read_machine_file

pytest.importorskip("rosbags")
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_typestore

START = 1_700_000_000_000_000_000
MACHINE = """[machine]
type = "rotary_axis"
coordinates = "load"
joints = ["elbow", "shoulder"]

[channels.mcap]
position = { topic = "/joint_states", field = "position[:]" }
speed = { topic = "/joint_states", field = "velocity[:]" }
torque = { topic = "/joint_states", field = "effort[:]" }
"""
VALUES = np.random.default_rng(6).normal(size=(60, 3, 2))


def messages(ros1: bool):
    store = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_HUMBLE)
    state, header = store.types["sensor_msgs/msg/JointState"], store.types["std_msgs/msg/Header"]
    time = store.types["builtin_interfaces/msg/Time"]
    for k, (position, speed, torque) in enumerate(VALUES):
        stamp = time(1_700_000_000, k * 10**7)
        head = header(k, stamp, "") if ros1 else header(stamp, "")
        content = state(head, ["shoulder", "elbow"], position, speed, torque)
        data = (
            store.serialize_ros1(content, state.__msgtype__)
            if ros1
            else store.serialize_cdr(content, state.__msgtype__)
        )
        yield store, state.__msgtype__, START + k * 10**7, data


@pytest.fixture(params=["bag", "8", "9", "9 compressed"])
def bag(request, tmp_path):
    """Write a ROS 1 bag, or a ROS 2 bag of some version; return the file or the folder."""
    ros1 = request.param == "bag"
    path = tmp_path / ("log.bag" if ros1 else "log")
    writer = Writer1(path) if ros1 else Writer2(path, version=int(request.param[0]))
    if "compressed" in request.param:
        writer.set_compression(CompressionMode.MESSAGE, CompressionFormat.ZSTD)
    with writer:
        connection = None
        for store, kind, stamp, data in messages(ros1):
            connection = connection or writer.add_connection("/joint_states", kind, typestore=store)
            writer.write(connection, stamp, data)
    return path


def test_a_bag_is_mapped_like_an_mcap_file_with_joints_by_name(bag, tmp_path):
    (tmp_path / "machine.toml").write_text(MACHINE)
    recording = read_recording(bag, read_machine_file(tmp_path / "machine.toml"))
    assert recording.origin == START / 1e9
    np.testing.assert_array_equal(recording["position"].values, VALUES[:, 0, ::-1])
    np.testing.assert_array_equal(recording["torque"].values, VALUES[:, 2, ::-1])
    np.testing.assert_allclose(recording["speed"].time, np.arange(60) * 0.01, atol=1e-12)


def test_a_missing_topic_or_field_is_named_with_the_nearest(bag, tmp_path):
    (tmp_path / "machine.toml").write_text(MACHINE.replace("/joint_states", "/joint_state"))
    with pytest.raises(RecordingError, match=r"no message of topic '/joint_state'.*did you mean /joint_states"):
        read_recording(bag, read_machine_file(tmp_path / "machine.toml"))
    (tmp_path / "machine.toml").write_text(MACHINE.replace('"effort[:]"', '"efort[:]"'))
    with pytest.raises(RecordingError, match=r"no field 'efort\[:\]'.*effort"):
        read_recording(bag, read_machine_file(tmp_path / "machine.toml"))


def test_an_sqlite_database_other_than_a_bag_is_refused(tmp_path):
    import sqlite3

    path = tmp_path / "other.db3"
    with sqlite3.connect(path) as base:
        base.execute("create table x (a)")
    with pytest.raises(RecordingError, match="an SQLite database, but not a ROS 2 bag"):
        survey(path)
