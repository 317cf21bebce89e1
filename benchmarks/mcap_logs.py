"""The files for timing MCAP reading: topics at 1 kHz like a robot's log, in each encoding.

Their contents are four topics of the usual types, or one topic whose numbers are in messages within messages.

Written with the `mcap` package, its usual chunks of 1 MiB. CDR messages are a template of `mcap-ros2-support` with the
numbers put into their places.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

from cdtool.formats.channels.channel_map import ChannelMap, ChannelSource, TimeSource
from cdtool.formats.messages.schemas import DEFINITIONS

JOINTS = tuple(f"joint_{i}" for i in range(1, 7))
START_NS = 1_700_000_000 * 10**9
STEP_NS = 10**6


@dataclass(frozen=True)
class Content:
    """The topics of a log, each with its type and its fields, and the fields that are read from them.

    A field with numbers is an array of so many.
    """

    topics: Mapping[str, tuple[str, Mapping[str, int]]]
    wanted: tuple[tuple[str, str], ...]

    @property
    def numbers(self) -> int:
        """How many numbers are written each millisecond."""
        return sum(size or 1 for _, fields in self.topics.values() for size in fields.values())


def _axes(*names: str) -> dict[str, int]:
    return {f"{name}.{axis}": 0 for name in names for axis in "xyz"}


FLAT = Content(
    {
        "/joint_states": ("sensor_msgs/msg/JointState", {"position": 6, "velocity": 6, "effort": 6}),
        "/imu": ("sensor_msgs/msg/Imu", _axes("angular_velocity", "linear_acceleration")),
        "/wrench": ("geometry_msgs/msg/WrenchStamped", _axes("wrench.force", "wrench.torque")),
        "/force": ("std_msgs/msg/Float64", {"data": 0}),
    },
    (
        *(("/joint_states", f"{name}[:]") for name in ("position", "velocity", "effort")),
        ("/imu", "linear_acceleration.x"),
        ("/imu", "angular_velocity.z"),
        ("/wrench", "wrench.force.z"),
        ("/force", "data"),
    ),
)
NESTED = Content(
    {
        "/robot": (
            "robot_msgs/msg/RobotState",
            {
                "arm.joints.position": 6,
                "arm.joints.velocity": 6,
                **_axes("arm.base.twist.linear", "arm.base.twist.angular"),
                **_axes("arm.tool.wrench.force", "arm.tool.wrench.torque"),
            },
        )
    },
    (
        ("/robot", "arm.joints.position[:]"),
        ("/robot", "arm.joints.velocity[:]"),
        ("/robot", "arm.base.twist.linear.x"),
        ("/robot", "arm.tool.wrench.force.z"),
    ),
)
_SEPARATOR = "=" * 80
_ROBOT_STATE = f"""std_msgs/Header header
robot_msgs/Arm arm
{_SEPARATOR}
MSG: robot_msgs/Arm
robot_msgs/Joints joints
robot_msgs/Base base
geometry_msgs/WrenchStamped tool
{_SEPARATOR}
MSG: robot_msgs/Joints
std_msgs/Header header
float64[] position
float64[] velocity
{_SEPARATOR}
MSG: robot_msgs/Base
std_msgs/Header header
string child_frame_id
geometry_msgs/Twist twist
{_SEPARATOR}
MSG: geometry_msgs/Twist
geometry_msgs/Vector3 linear
geometry_msgs/Vector3 angular
{_SEPARATOR}
MSG: geometry_msgs/WrenchStamped
{DEFINITIONS["geometry_msgs/msg/WrenchStamped"]}"""
_DEFINITIONS = DEFINITIONS | {"robot_msgs/msg/RobotState": _ROBOT_STATE}
_FIELDS = dict((*FLAT.topics.values(), *NESTED.topics.values()))  # by type
Array = npt.NDArray[np.float64]


def channel_map(content: Content = FLAT) -> ChannelMap:
    """The wanted fields as a machine file would name them."""
    sources = tuple(ChannelSource("speed", topic=topic, field=field) for topic, field in content.wanted)
    return ChannelMap(TimeSource(clock="log"), sources, JOINTS, topics=True)


def write_log(path: Path, seconds: float, encoding: str, compression: str, content: Content = FLAT) -> None:
    """Write a log of so many seconds; `encoding` is cdr, json or protobuf."""
    count = round(1000 * seconds)
    rng = np.random.default_rng(0)
    makers = {"cdr": _cdr, "json": _json, "protobuf": _protobuf}
    with path.open("wb") as file:
        writer = Writer(file, compression=CompressionType[compression.upper()])
        writer.start(profile="ros2" if encoding == "cdr" else "")
        streams = []
        for topic, (kind, fields) in content.topics.items():
            values = {name: _signal(rng, count, size) for name, size in fields.items()}
            schema, payloads = makers[encoding](kind, values, count)
            number = writer.register_schema(kind if encoding != "protobuf" else _message_name(kind), *schema)
            streams.append((writer.register_channel(topic, encoding, number), payloads))
        for i in range(count):
            stamp = START_NS + i * STEP_NS
            for channel, payloads in streams:
                writer.add_message(channel, stamp, next(payloads), stamp, i)
        writer.finish()


def _signal(rng: np.random.Generator, count: int, size: int) -> Array:
    """A walk with the noise of a 16-bit sensor: (count,) or (count, size)."""
    shape = (count, size) if size else (count,)
    return np.asarray(np.round(np.cumsum(rng.normal(0.0, 1e-3, shape), axis=0) + rng.normal(0.0, 1e-4, shape), 6))


def _cdr(kind: str, values: Mapping[str, Array], count: int) -> tuple[tuple[str, bytes], Iterator[bytes]]:
    text = _DEFINITIONS[kind]
    # Unique numbers show the position of each field.
    places = {name: np.arange(array[0].size) + 1e6 * (k + 1) + 0.5 for k, (name, array) in enumerate(values.items())}
    message = _nested(
        {name: place.tolist() if values[name].ndim == 2 else float(place[0]) for name, place in places.items()}
    )
    stamp = {"sec": 0x01020304, "nanosec": 0x05060708}
    if _DEFINITIONS[kind].startswith("std_msgs/Header"):
        message["header"] = {"stamp": stamp, "frame_id": "base_link"}
    if "position" in values:
        message["name"] = list(JOINTS)
    template = _encoded(kind, text, message)
    table = np.tile(np.frombuffer(template, np.uint8), (count, 1))
    for name, array in values.items():
        at = template.index(places[name].astype("<f8").tobytes())
        raw = np.ascontiguousarray(array.reshape(count, -1), "<f8").view(np.uint8).reshape(count, -1)
        table[:, at : at + raw.shape[1]] = raw
    if _DEFINITIONS[kind].startswith("std_msgs/Header"):
        at = template.index(struct.pack("<iI", *stamp.values()))
        times = START_NS + np.arange(count) * STEP_NS
        parts = np.column_stack((times // 10**9, times % 10**9)).astype("<u4")
        table[:, at : at + 8] = parts.view(np.uint8).reshape(count, 8)
    return ("ros2msg", text.encode()), (row.tobytes() for row in table)


def _encoded(kind: str, text: str, message: dict[str, Any]) -> bytes:
    from mcap.reader import make_reader
    from mcap_ros2.writer import Writer as RosWriter

    file = BytesIO()
    writer = RosWriter(file)
    writer.write_message("/a", writer.register_msgdef(kind, text), message)
    writer.finish()
    file.seek(0)
    return next(bytes(found.data) for _, _, found in make_reader(file).iter_messages())


def _nested(fields: Mapping[str, Any]) -> dict[str, Any]:
    message: dict[str, Any] = {}
    for name, value in fields.items():
        *parents, leaf = name.split(".")
        inner = message
        for parent in parents:
            inner = inner.setdefault(parent, {})
        inner[leaf] = value
    return message


def _messages(kind: str, values: Mapping[str, Array], count: int) -> Iterator[dict[str, Any]]:
    columns = {name: array.tolist() for name, array in values.items()}
    for i in range(count):
        message = _nested({name: column[i] for name, column in columns.items()})
        if _DEFINITIONS[kind].startswith("std_msgs/Header"):
            sec, nanosec = divmod(START_NS + i * STEP_NS, 10**9)
            message["header"] = {"stamp": {"sec": sec, "nanosec": nanosec}, "frame_id": "base_link"}
        if "position" in values:
            message["name"] = list(JOINTS)
        yield message


def _json(kind: str, values: Mapping[str, Array], count: int) -> tuple[tuple[str, bytes], Iterator[bytes]]:
    payloads = (json.dumps(message, separators=(",", ":")).encode() for message in _messages(kind, values, count))
    return ("jsonschema", b'{"type":"object"}'), payloads


def _protobuf(kind: str, values: Mapping[str, Array], count: int) -> tuple[tuple[str, bytes], Iterator[bytes]]:
    descriptor, made = protobuf_message(kind)
    payloads = (_filled(made(), message).SerializeToString() for message in _messages(kind, values, count))
    return ("protobuf", descriptor), payloads


def _filled(target: Any, message: Mapping[str, Any]) -> Any:
    for name, value in message.items():
        if isinstance(value, dict):
            _filled(getattr(target, name), value)
        elif isinstance(value, list):
            getattr(target, name).extend(value)
        else:
            setattr(target, name, value)
    return target


def _message_name(kind: str) -> str:
    return f"robot.{kind.rpartition('/')[2]}"


def protobuf_message(kind: str) -> tuple[bytes, Callable[[], Any]]:
    """The FileDescriptorSet of a type with the fields of TOPICS, and its class."""
    from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

    field = descriptor_pb2.FieldDescriptorProto
    name = kind.rpartition("/")[2]
    file = descriptor_pb2.FileDescriptorProto(name=f"{name}.proto", package="robot", syntax="proto3")

    def add(message: Any, item: str, wire: int, repeated: bool = False, kind_name: str = "") -> None:
        label = field.LABEL_REPEATED if repeated else field.LABEL_OPTIONAL
        known = [each.name for each in message.field]
        if item not in known:
            made_field = message.field.add(name=item, number=len(known) + 1, type=wire, label=label)
            if kind_name:
                made_field.type_name = kind_name

    root = file.message_type.add(name=name)
    if _DEFINITIONS[kind].startswith("std_msgs/Header"):
        stamp = file.message_type.add(name="Stamp")
        add(stamp, "sec", field.TYPE_INT64)
        add(stamp, "nanosec", field.TYPE_UINT32)
        header = file.message_type.add(name="Header")
        add(header, "stamp", field.TYPE_MESSAGE, kind_name=".robot.Stamp")
        add(header, "frame_id", field.TYPE_STRING)
        add(root, "header", field.TYPE_MESSAGE, kind_name=".robot.Header")
    made = {"": root}
    for path, size in _FIELDS[kind].items():
        *parents, leaf = path.split(".")
        inner, whole = root, ""
        for parent in parents:
            whole += parent.title().replace("_", "")
            if whole not in made:
                made[whole] = file.message_type.add(name=whole)
                add(inner, parent, field.TYPE_MESSAGE, kind_name=f".robot.{whole}")
            inner = made[whole]
        add(inner, leaf, field.TYPE_DOUBLE, repeated=bool(size))
    if "position" in _FIELDS[kind]:
        add(root, "name", field.TYPE_STRING, repeated=True)
    pool = descriptor_pool.DescriptorPool()
    pool.Add(file)
    described = pool.FindMessageTypeByName(f"robot.{name}")
    return descriptor_pb2.FileDescriptorSet(file=[file]).SerializeToString(), message_factory.GetMessageClass(described)


# What MCAP reading is compared with: each decodes message by message and reads the same numbers.
Columns = dict[str, Array]


def gathered(content: Content, messages: Iterator[tuple[str, Any]], member: Callable[[Any, str], Any]) -> Columns:
    """Columns of the wanted fields of (topic, decoded message); `member` gets a field of one."""
    fields: dict[str, list[tuple[list[str], list[Any]]]] = {topic: [] for topic in content.topics}
    for topic, field in content.wanted:
        fields[topic].append((field.removesuffix("[:]").split("."), []))
    for topic, message in messages:
        for steps, values in fields[topic]:
            value = message
            for step in steps:
                value = member(value, step)
            values.append(value)
    found = {topic: iter(columns) for topic, columns in fields.items()}
    return {f"{topic} {field}": np.array(next(found[topic])[1], dtype=np.float64) for topic, field in content.wanted}


def by_rosbags(path: Path, content: Content) -> Columns:
    from rosbags.highlevel import AnyReader

    with AnyReader([path]) as reader:
        rows = reader.messages()
        return gathered(
            content, ((each.topic, reader.deserialize(raw, each.msgtype)) for each, _, raw in rows), getattr
        )


def by_orjson(path: Path, content: Content) -> Columns:
    import orjson

    with path.open("rb") as file:
        rows = make_reader(file).iter_messages(log_time_order=False)
        return gathered(
            content, ((channel.topic, orjson.loads(row.data)) for _, channel, row in rows), dict.__getitem__
        )


def by_protobuf(path: Path, content: Content) -> Columns:
    made = {topic: protobuf_message(kind)[1] for topic, (kind, _) in content.topics.items()}
    with path.open("rb") as file:
        rows = make_reader(file).iter_messages(log_time_order=False)
        return gathered(
            content,
            ((channel.topic, made[channel.topic].FromString(row.data)) for _, channel, row in rows),
            getattr,
        )
