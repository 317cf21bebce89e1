"""ros1msg: the concatenated .msg text of ROS 1 (MCAP, appendix "Well-known schema encodings").

http://wiki.ros.org/msg: `char` is a uint8, `byte` an int8; `time` and `duration` are two numbers, `secs` and `nsecs`.
"""

from __future__ import annotations

from cdtool.messages.layouts.layout import Layout, Member, Message, Number, Schema, Text
from cdtool.messages.layouts.message_text import Dialect, Kind, parse_definitions

_SAME = ("bool", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64", "float32", "float64")
_PRIMITIVES: dict[str, Kind] = {
    **{name: Number(name) for name in _SAME},
    "byte": Number("int8"),
    "char": Number("uint8"),
    "string": Text(),
    "time": Message("time"),
    "duration": Message("duration"),
}
_ROS1 = Dialect(
    _PRIMITIVES,
    (
        Layout("time", (Member("secs", Number("uint32")), Member("nsecs", Number("uint32")))),
        Layout("duration", (Member("secs", Number("int32")), Member("nsecs", Number("int32")))),
    ),
)


def parse_ros1msg(name: str, data: bytes) -> Schema:
    """Return the layouts of the message `name` and of its nested messages; raises SchemaError."""
    return parse_definitions(name, data, _ROS1)
