"""Messages -> columns: decoding by the encoding's package, picking fields, choosing the clock."""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from cdtool.errors import RecordingError
from cdtool.formats.mcap.fields import FieldMissingError, Value, header_stamp, missing, numeric_fields, parse_field
from cdtool.formats.mcap.read import RawMessage, Topic
from cdtool.formats.source import Column
from cdtool.recording import Finding, FloatArray

Decoder = Callable[[bytes], Any]
_PLAIN_CDR = (0, 1)  # CDR of DDS-XTypes 1.0, big and little endian: other kinds align differently


class UndecodableError(Exception):
    """There is no decoder for a channel; says why."""


@dataclass
class Decoders:
    """One decoder a channel, made when its first message comes."""

    _made: dict[int, Decoder | UndecodableError] = field(default_factory=dict)

    def decode(self, message: RawMessage) -> Any:
        """The message's content: a dict (JSON) or an object with its fields; raises whatever the bytes provoke."""
        decoder = self._made.get(message.channel.id)
        if decoder is None:
            decoder = self._made[message.channel.id] = _decoder(message)
        if isinstance(decoder, UndecodableError):
            raise decoder
        return decoder(message.data)


def _decoder(message: RawMessage) -> Decoder | UndecodableError:
    encoding, schema = message.channel.message_encoding, message.schema
    if encoding == "json":
        return _decode_json
    if encoding == "cdr" and schema is not None and schema.encoding == "ros2msg":
        from mcap_ros2.decoder import DecoderFactory

        try:
            decode: Decoder | None = DecoderFactory().decoder_for(encoding, schema)
        except Exception as fault:  # whatever a schema that is no message definition provokes
            return UndecodableError(f"schema '{schema.name}' is not understood: {type(fault).__name__}: {fault}")
        if decode is not None:
            return partial(_decode_cdr, decode)
    described = f"schema encoding '{schema.encoding}'" if schema is not None else "no schema"
    return UndecodableError(f"message encoding '{encoding}' with {described} is not read (json and ROS 2 cdr are)")


def _decode_json(data: bytes) -> Any:
    value = json.loads(data)
    if not isinstance(value, dict):
        raise ValueError("the JSON is not an object")
    return value


def _decode_cdr(decode: Decoder, data: bytes) -> Any:
    if len(data) < 4 or data[1] not in _PLAIN_CDR:
        raise ValueError(f"not plain CDR (starts with {data[:4].hex() or 'nothing'})")
    return decode(data)


@dataclass
class Decoded:
    """The decodable messages of a topic, and why others are not."""

    messages: list[tuple[RawMessage, Any]]
    failed: int
    reason: str


def decode_topic(topic: Topic) -> Decoded:
    """Decode all messages that were kept; one that cannot be decoded is counted."""
    decoders, decoded, failed, reason = Decoders(), [], 0, ""
    for message in topic.messages:
        try:
            decoded.append((message, decoders.decode(message)))
        except Exception as fault:  # the decoders throw all kinds of errors at damaged bytes
            failed += 1
            text = str(fault) if isinstance(fault, UndecodableError) else f"{type(fault).__name__}: {fault}"
            reason = reason or " ".join(text.split())[:200]
    return Decoded(decoded, failed, reason)


def field_column(
    path: Path, topic: Topic, decoded: Decoded, text: str, clock: str, origin: int, joints: Sequence[str] = ()
) -> tuple[Column, list[Finding]]:
    """One wanted field of a topic as a column, sorted by the chosen clock; raises RecordingError.

    A whole array whose elements the messages name comes in the order of `joints`.
    """
    where = f"{path}: {topic.name}"
    picked = parse_field(text, where)
    name = f"{topic.name} {text}"
    values: list[Value] = []
    stamps: list[int] = []
    elsewhere = 0
    for raw, message in decoded.messages:
        try:
            value = picked.of(message, joints)
        except FieldMissingError as fault:
            raise missing(where, text, fault) from fault
        if value is None:
            elsewhere += 1
            continue
        values.append(value)
        stamps.append(stamp_of(raw, message, clock, where))
    if decoded.messages and not values:
        joints = sorted({str(joint) for _, message in decoded.messages[:10] for joint in _names(message)})
        raise missing(where, text, FieldMissingError("no message names this joint", joints))
    findings = []
    if elsewhere:
        findings.append(Finding(f"{elsewhere} messages name other joints only: left out", name, "note"))
    table, empty = _table(values, where, text)
    if empty:
        findings.append(Finding(f"{empty} messages hold an empty array: NaN", name))
    return Column(name, *_sorted(table, stamps, origin)), findings


def survey_columns(topic: Topic, decoded: Decoded, origin: int) -> Iterator[Column | Finding]:
    """Every numeric field of a topic, by log time; fields whose length varies become a finding."""
    rows = [numeric_fields(message) for _, message in decoded.messages]
    names = list(dict.fromkeys(name for row in rows for name in row))
    stamps = [raw.log_time for raw, _ in decoded.messages]
    for name in names:
        values = [row.get(name, math.nan) for row in rows]
        widths = Counter(len(value) for value in values if isinstance(value, list) and value)
        full = f"{topic.name} {name}"
        if len(widths) > 1:
            yield Finding(f"arrays of {' and '.join(map(str, sorted(widths)))} elements: left out", full, "note")
        elif name.endswith("[:]") and not widths:
            continue  # always empty
        else:
            table, _ = _table([[] if isinstance(v, float) and widths else v for v in values], full, name)
            yield Column(full, *_sorted(table, stamps, origin))


def stamp_of(raw: RawMessage, message: Any, clock: str, where: str) -> int:
    """The message's time [ns] by the chosen clock; raises RecordingError where it has no header stamp."""
    if clock == "log":
        return raw.log_time
    if clock == "publish":
        return raw.publish_time
    stamp = header_stamp(message)
    if stamp is None:
        raise RecordingError(
            f"{where}: a message has no header.stamp", "use time = { clock = 'log' } in [channels.mcap]"
        )
    return stamp


def _names(message: Any) -> list[Any]:
    names = message.get("name", []) if isinstance(message, dict) else getattr(message, "name", [])
    return list(names)


def _table(values: list[Value], where: str, text: str) -> tuple[FloatArray, int]:
    """(n,) or (n, k) of the values, and how many were empty arrays (NaN)."""
    widths = Counter(len(value) for value in values if isinstance(value, list))
    empty = widths.pop(0, 0)
    if not widths and not empty:
        return np.array(values, dtype=np.float64), 0
    if len(widths) > 1:
        found = ", ".join(f"{width} in {count}" for width, count in widths.most_common())
        raise RecordingError(
            f"{where}: the length of field '{text}' varies: {found} messages", "name one element, e.g. position[0]"
        )
    width = next(iter(widths), 1)
    blank = [math.nan] * width
    return np.array([value or blank for value in values], dtype=np.float64).reshape(-1, width), empty


def _sorted(values: FloatArray, stamps: list[int], origin: int) -> tuple[FloatArray, FloatArray]:
    # The difference is taken between integers: an epoch in ns has more digits than a float64.
    time = np.array([(stamp - origin) / 1e9 for stamp in stamps], dtype=np.float64)
    order = np.argsort(time, kind="stable")
    return values[order], time[order]
