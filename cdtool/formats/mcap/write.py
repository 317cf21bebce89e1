"""Write recordings as MCAP, in ROS 2 CDR or JSON; the same input gives the same bytes."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
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
# stream, sample, stamp [ns], message
_Send = Callable[[int, int, int, dict[str, Any]], None]
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
        send, finish = open_file(file, streams, compression.upper())
        for number, index in zip(*_merged(stamps), strict=True):
            stamp = int(stamps[number][index])
            send(number, index, stamp, fillers[number].message(index, stamp))
        finish()


class _Filler:
    """A message object that is filled with each sample in turn."""

    def __init__(self, stream: Stream) -> None:
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


def _open_cdr(file: IO[bytes], streams: Sequence[Stream], compression: str) -> tuple[_Send, _Finish]:
    from mcap.writer import CompressionType
    from mcap_ros2.writer import Writer

    writer = Writer(file, compression=CompressionType[compression])
    schemas = {name: writer.register_msgdef(name, DEFINITIONS[name].text) for name in _types(streams)}

    def send(which: int, index: int, stamp: int, message: dict[str, Any]) -> None:
        stream = streams[which]
        writer.write_message(stream.topic, schemas[stream.schema], message, stamp, stamp, index)

    return send, writer.finish


def _open_json(file: IO[bytes], streams: Sequence[Stream], compression: str) -> tuple[_Send, _Finish]:
    from mcap.writer import CompressionType, Writer

    writer = Writer(file, compression=CompressionType[compression])
    writer.start(library="cdtool")
    schemas = {name: writer.register_schema(name, "jsonschema", b'{"type":"object"}') for name in _types(streams)}
    channels = [writer.register_channel(stream.topic, "json", schemas[stream.schema]) for stream in streams]

    def send(which: int, index: int, stamp: int, message: dict[str, Any]) -> None:
        data = json.dumps(message, separators=(",", ":")).encode()
        writer.add_message(channels[which], log_time=stamp, data=data, publish_time=stamp, sequence=index)

    return send, writer.finish


def _types(streams: Sequence[Stream]) -> list[str]:
    return list(dict.fromkeys(stream.schema for stream in streams))


def _merged(stamps: list[npt.NDArray[np.int64]]) -> tuple[list[int], list[int]]:
    """Return stream and sample of every message, by time; at equal times in the order of the streams."""
    which = np.repeat(np.arange(len(stamps)), [len(part) for part in stamps])
    index = np.concatenate([np.arange(len(part)) for part in stamps])
    order = np.lexsort((which, np.concatenate(stamps)))
    return which[order].tolist(), index[order].tolist()
