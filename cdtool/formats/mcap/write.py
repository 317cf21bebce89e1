"""Write recordings as MCAP, in ROS 2 CDR or JSON; the same input gives the same bytes.

All messages of a stream have the same layout in CDR: one is encoded by the library, and shows where each number is. The
others are filled in column by column, which is 30 times as fast.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any, Literal

import numpy as np
import numpy.typing as npt

from cdtool.errors import UsageError, nearest
from cdtool.messages.schemas import DEFINITIONS, Definition
from cdtool.recording import FloatArray

Encoding = Literal["cdr", "json"]
_SECOND = 10**9
# Messages are filled in so many at a time.
_ROWS = 2**13
# What no recording contains: the number from which the marks of a layout are made, and the stamp of a layout.
_MARK, _STAMP = 1.2345678987654321e287, b"\x5a\xa5\x3c\x12\x69\x96\xc3\x0f"
# stream, sample, stamp [ns]
_Send = Callable[[int, int, int], None]
_Finish = Callable[[], None]


@dataclass(frozen=True)
class Stream:
    """One topic: the sample of `fields` at each `time` [s] is written as one message of the type `schema`.

    Fields have the same names as in reading: `data`, `wrench.force.z`, `position[0]`; `position` or `position[:]` with
    (n, k) values fills a whole array. `names` are the joints of a JointState (default joint_0, ...).
    """

    topic: str
    schema: str
    time: FloatArray
    fields: Mapping[str, FloatArray]
    names: tuple[str, ...] = ()


def write_mcap(
    path: Path,
    streams: Sequence[Stream],
    start_ns: int = 0,
    compression: Literal["zstd", "lz4", "none"] = "zstd",
    encoding: Encoding = "cdr",
) -> None:
    """Write the streams in the order of their times; `start_ns` is the log time of time 0. Raises UsageError."""
    topics = [stream.topic for stream in streams]
    if len(set(topics)) != len(topics):
        raise UsageError(f"{path}: several streams have the same topic: {', '.join(topics)}", "one stream per topic")
    fillers = [_Filler(stream) for stream in streams]
    stamps = [start_ns + np.rint(stream.time * _SECOND).astype(np.int64) for stream in streams]
    with path.open("wb") as file:
        open_file = _open_cdr if encoding == "cdr" else _open_json
        send, finish = open_file(file, fillers, stamps, compression.upper())
        for number, index in zip(*_merged(stamps), strict=True):
            send(number, index, int(stamps[number][index]))
        finish()


class _Filler:
    """A message object that is filled with each sample in turn."""

    def __init__(self, stream: Stream) -> None:
        self.stream = stream
        definition = DEFINITIONS.get(stream.schema)
        if definition is None:
            raise UsageError(
                f"{stream.topic}: unknown message type '{stream.schema}'", nearest(stream.schema, DEFINITIONS)
            )
        self.content: dict[str, Any] = {}
        self.stamp: dict[str, int] = {"sec": 0, "nanosec": 0}
        if definition.header:
            self.content["header"] = {"stamp": self.stamp, "frame_id": ""}
        self.leaves: list[tuple[dict[str, Any], str, list[Any]]] = []
        for name, values in _grouped(stream, definition).items():
            parent, leaf = self.content, name
            while "." in leaf:
                head, _, leaf = leaf.partition(".")
                parent = parent.setdefault(head, {})
            self.leaves.append((parent, leaf, values.tolist()))
        if "position" in definition.arrays:
            width = max((len(values[0]) for _, _, values in self.leaves if values), default=0)
            self.content["name"] = list(stream.names) or [f"joint_{i}" for i in range(width)]

    @property
    def has_stamp(self) -> bool:
        """Whether the message has a header."""
        return "header" in self.content

    def marked(self) -> tuple[dict[str, Any], list[tuple[float, FloatArray]]]:
        """Return a message whose numbers are all different, and for each of them the number of every sample (n,)."""
        self.stamp["sec"], self.stamp["nanosec"] = struct.unpack("<iI", _STAMP)
        columns: list[tuple[float, FloatArray]] = []
        for parent, leaf, values in self.leaves:
            array = np.asarray(values, dtype=np.float64)
            first = len(columns)
            parts = array.T if array.ndim == 2 else [array]
            columns += [(_MARK * (1.0 + 1e-9 * (first + i)), part) for i, part in enumerate(parts)]
            marks = [mark for mark, _ in columns[first:]]
            parent[leaf] = marks if array.ndim == 2 else marks[0]
        return self.content, columns

    def message(self, index: int, stamp: int) -> dict[str, Any]:
        """Return the message of one sample; each call returns the same object."""
        self.stamp["sec"], self.stamp["nanosec"] = divmod(stamp, _SECOND)
        for parent, leaf, values in self.leaves:
            parent[leaf] = values[index]
        return self.content


def _grouped(stream: Stream, definition: Definition) -> dict[str, FloatArray]:
    """Return the values by field; elements such as `position[0]`, `position[1]` are joined to one (n, k) array."""
    grouped: dict[str, FloatArray] = {}
    elements: dict[str, dict[int, FloatArray]] = {}
    for field, values in stream.fields.items():
        if len(values) != len(stream.time):
            raise UsageError(
                f"{stream.topic} {field}: {len(values)} values at {len(stream.time)} times", "one value per time"
            )
        name, _, index = field.removesuffix("]").partition("[")
        if name in definition.arrays and index.isdigit():
            elements.setdefault(name, {})[int(index)] = values
        elif name in definition.arrays and index in ("", ":") and values.ndim == 2:
            grouped[name] = values
        elif field in definition.numbers and values.ndim == 1:
            grouped[field] = values
        else:
            known = [*definition.numbers, *(f"{array}[:]" for array in definition.arrays)]
            raise UsageError(f"{stream.topic}: no field '{field}' in {stream.schema}", nearest(field, known))
    for name, parts in elements.items():
        if sorted(parts) != list(range(len(parts))):
            raise UsageError(f"{stream.topic}: elements {sorted(parts)} of '{name}'", "number them from 0 without gaps")
        grouped[name] = np.column_stack([parts[i] for i in range(len(parts))])
    return grouped


def _open_cdr(
    file: IO[bytes], fillers: Sequence[_Filler], stamps: Sequence[npt.NDArray[np.int64]], compression: str
) -> tuple[_Send, _Finish]:
    from mcap.writer import CompressionType, Writer

    writer = Writer(file, compression=CompressionType[compression])
    writer.start(profile="ros2", library="cdtool")
    schemas = {
        name: writer.register_schema(name, "ros2msg", DEFINITIONS[name].text.encode()) for name in _types(fillers)
    }
    channels: dict[int, int] = {}
    payloads = [_payloads(filler, own) for filler, own in zip(fillers, stamps, strict=True)]

    def send(which: int, index: int, stamp: int) -> None:
        if which not in channels:
            stream = fillers[which].stream
            channels[which] = writer.register_channel(stream.topic, "cdr", schemas[stream.schema])
        writer.add_message(channels[which], stamp, next(payloads[which]), stamp, index)

    return send, writer.finish


def _payloads(filler: _Filler, stamps: npt.NDArray[np.int64]) -> Iterator[bytes]:
    """Yield the message of each sample in CDR."""
    if not len(stamps):
        return
    template, slots = _layout(filler)
    for first in range(0, len(stamps), _ROWS):
        own = stamps[first : first + _ROWS]
        table = np.tile(np.frombuffer(template, dtype=np.uint8), (len(own), 1))
        for offset, values in slots:
            column = np.ascontiguousarray(values[first : first + _ROWS], dtype="<f8")
            table[:, offset : offset + 8] = column.view(np.uint8).reshape(-1, 8)
        if filler.has_stamp:
            offset = template.index(_STAMP)
            parts = np.column_stack(np.divmod(own, _SECOND)).astype("<i4")
            table[:, offset : offset + 8] = np.ascontiguousarray(parts).view(np.uint8)
        yield from map(bytes, table)


def _layout(filler: _Filler) -> tuple[bytes, list[tuple[int, FloatArray]]]:
    """Return a message in CDR, and the place of each number in it [bytes] with the number of every sample."""
    marked, columns = filler.marked()
    template = _encoded(filler.stream.schema, marked)
    slots = []
    for mark, values in columns:
        place = struct.pack("<d", mark)
        assert template.count(place) == 1, "each number is in one place of a message"
        slots.append((template.index(place), values))
    assert template.count(_STAMP) == filler.has_stamp, "a message has one stamp"
    return template, slots


def _encoded(schema: str, message: Mapping[str, Any]) -> bytes:
    """Return a message in CDR, as the library writes it."""
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(DEFINITIONS[schema].text, schema))
    return bytes(store.serialize_cdr(_filled(store, schema, message), schema))


def _filled(store: Any, schema: str, content: Mapping[str, Any]) -> Any:
    """Return the library's object of a message; a number without content is 0, an array empty or of zeros."""
    from rosbags.interfaces import Nodetype

    if schema == "geometry_msgs/msg/Quaternion":
        content = {"w": 1.0, **content}  # the default of its definition
    values: dict[str, Any] = {}
    for name, (kind, detail) in store.fielddefs[schema][1]:
        if kind == Nodetype.NAME:
            values[name] = _filled(store, detail, content.get(name, {}))
        elif kind == Nodetype.BASE:
            values[name] = content.get(name, "" if detail[0] == "string" else 0)
        elif detail[0][0] == Nodetype.BASE and detail[0][1][0] != "string":
            size = detail[1] if kind == Nodetype.ARRAY else 0
            values[name] = np.array(content.get(name, [0] * size), dtype=detail[0][1][0])
        else:
            values[name] = list(content.get(name, ()))
    return store.types[schema](**values)


def _open_json(
    file: IO[bytes],
    fillers: Sequence[_Filler],
    stamps: Sequence[npt.NDArray[np.int64]],  # noqa: ARG001  as _open_cdr
    compression: str,
) -> tuple[_Send, _Finish]:
    from mcap.writer import CompressionType, Writer

    writer = Writer(file, compression=CompressionType[compression])
    writer.start(library="cdtool")
    schemas = {name: writer.register_schema(name, "jsonschema", b'{"type":"object"}') for name in _types(fillers)}
    channels = [writer.register_channel(item.stream.topic, "json", schemas[item.stream.schema]) for item in fillers]

    def send(which: int, index: int, stamp: int) -> None:
        data = json.dumps(fillers[which].message(index, stamp), separators=(",", ":")).encode()
        writer.add_message(channels[which], log_time=stamp, data=data, publish_time=stamp, sequence=index)

    return send, writer.finish


def _types(fillers: Sequence[_Filler]) -> list[str]:
    return list(dict.fromkeys(item.stream.schema for item in fillers))


def _merged(stamps: list[npt.NDArray[np.int64]]) -> tuple[list[int], list[int]]:
    """Return stream and sample of every message, by time; at equal times in the order of the streams."""
    which = np.repeat(np.arange(len(stamps)), [len(part) for part in stamps])
    index = np.concatenate([np.arange(len(part)) for part in stamps])
    order = np.lexsort((which, np.concatenate(stamps)))
    return which[order].tolist(), index[order].tolist()
