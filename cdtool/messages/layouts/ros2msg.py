"""ros2msg: the concatenated .msg text of ROS 2 (MCAP, appendix "Well-known schema encodings").

https://docs.ros.org/en/rolling/Concepts/Basic/About-Interfaces.html: `char` is a uint8, `byte` an octet. A string or
sequence may have a length limit (`string<=5`, `float64[<=3]`), which does not change its encoding.
"""

from __future__ import annotations

from cdtool.messages.layouts.layout import Layout, Member, Message, Number, Schema, Text
from cdtool.messages.layouts.message_text import Dialect, Kind, parse_definitions

_SAME = ("bool", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64", "float32", "float64")
_STAMP = (Member("sec", Number("int32")), Member("nanosec", Number("uint32")))
_PRIMITIVES: dict[str, Kind] = {
    **{name: Number(name) for name in _SAME},
    "byte": Number("uint8"),
    "char": Number("uint8"),
    "string": Text(),
    "wstring": Text(wide=True),
    "time": Message("builtin_interfaces/Time"),
    "duration": Message("builtin_interfaces/Duration"),
}
_ROS2 = Dialect(
    _PRIMITIVES,
    (Layout("builtin_interfaces/Time", _STAMP), Layout("builtin_interfaces/Duration", _STAMP)),
)


def parse_ros2msg(name: str, data: bytes) -> Schema:
    """Return the layouts of the message `name` and of its nested messages; raises SchemaError."""
    return parse_definitions(name, data, _ROS2)
