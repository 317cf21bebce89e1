"""Messages that are filled in column by column are those that the library would have encoded one by one."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros2.writer import Writer

from cdtool.formats.mcap.write import Stream, write_mcap
from cdtool.formats.messages.schemas import DEFINITIONS

START = 1_700_000_000_000_000_000


def vectors(*names: str) -> list[str]:
    return [f"{name}.{axis}" for name in names for axis in "xyz"]


# The numbers and the arrays that are filled, by message type.
FIELDS: dict[str, tuple[list[str], list[str]]] = {
    "sensor_msgs/msg/JointState": ([], ["position", "velocity", "effort"]),
    "sensor_msgs/msg/Imu": ([*vectors("orientation", "angular_velocity", "linear_acceleration"), "orientation.w"], []),
    "geometry_msgs/msg/WrenchStamped": (vectors("wrench.force", "wrench.torque"), []),
    "std_msgs/msg/Float64": (["data"], []),
    "std_msgs/msg/Float64MultiArray": ([], ["data"]),
}


def stream_of(schema: str, count: int) -> Stream:
    rng = np.random.default_rng(count)
    time = np.sort(rng.random(count))
    numbers, arrays = FIELDS[schema]
    fields = {name: rng.normal(size=count) for name in numbers}
    fields |= {name: rng.normal(size=(count, 3)) for name in arrays}
    for values in fields.values():
        values[0] = np.nan
        values[-1] = np.inf
    return Stream("/topic", schema, time, fields, ("hip", "knee", "größe") if "position" in arrays else ())


def content(stream: Stream, index: int, stamp: int) -> dict[str, object]:
    """Return one message of a stream as the library's writer takes it."""
    message: dict[str, object] = {"name": list(stream.names)} if stream.names else {}
    if DEFINITIONS[stream.schema].startswith("std_msgs/Header"):
        message["header"] = {"stamp": dict(zip(("sec", "nanosec"), divmod(stamp, 10**9), strict=True))}
    for name, values in stream.fields.items():
        *parents, leaf = name.split(".")
        parent = message
        for each in parents:
            parent = parent.setdefault(each, {})
        parent[leaf] = values[index].tolist()
    return message


def encoded_one_by_one(stream: Stream) -> list[bytes]:
    file = BytesIO()
    writer = Writer(file)
    schema = writer.register_msgdef(stream.schema, DEFINITIONS[stream.schema])
    for index, stamp in enumerate((START + np.rint(stream.time * 1e9).astype(np.int64)).tolist()):
        writer.write_message("/topic", schema, content(stream, index, stamp), stamp, stamp, index)
    writer.finish()
    return payloads(file.getvalue())


def payloads(content: bytes) -> list[bytes]:
    return [message.data for _, _, message in make_reader(BytesIO(content)).iter_messages()]


@pytest.mark.parametrize("schema", DEFINITIONS)
@pytest.mark.parametrize("count", [1, 2, 100])
def test_the_bytes_are_those_of_the_library(tmp_path: Path, schema: str, count: int):
    stream = stream_of(schema, count)
    write_mcap(tmp_path / "log.mcap", [stream], start_ns=START)
    assert payloads((tmp_path / "log.mcap").read_bytes()) == encoded_one_by_one(stream)


def test_a_stream_without_samples_has_no_messages(tmp_path: Path):
    write_mcap(tmp_path / "log.mcap", [Stream("/f", "std_msgs/msg/Float64", np.empty(0), {"data": np.empty(0)})])
    assert payloads((tmp_path / "log.mcap").read_bytes()) == []
