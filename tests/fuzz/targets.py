"""What is tried with any bytes: a file is read, or refused in one line; a JSON message is what Python's json says.

The fuzzers and the regression test run the same functions.
"""

from __future__ import annotations

import json
import math
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np

from cdtool.base.errors import RecordingError
from cdtool.formats.channels.channel_map import ChannelMap, ChannelSource, TimeSource
from cdtool.formats.csv import Csv
from cdtool.formats.mcap import Mcap
from cdtool.formats.source import Source
from tests.formats.mcap_damage import records

SEPARATOR = b"\xff\xfe\xfd"
_ENCODINGS = (("cdr", "ros2msg"), ("ros1", "ros1msg"), ("protobuf", "protobuf"), ("json", "jsonschema"))


def try_mcap(data: bytes, path: Path) -> None:
    """A file, as it is and with its chunks' CRCs taken out, so that damage reaches what is behind them."""
    for content in {data, without_crcs(data)}:
        path.write_bytes(content)
        _one_line_or(lambda: Mcap().columns(path))
        sources = tuple(ChannelSource("speed", topic=topic, field="data") for topic in ("/force", "/raw"))
        asked = ChannelMap(TimeSource(), sources, ("axis",), topics=True)
        _one_line_or(lambda asked=asked: Mcap().columns(path, asked))  # type: ignore[misc]


def try_messages(data: bytes, path: Path) -> None:
    """Messages in a file that is whole: encoding (1 byte), then the schema and the messages, SEPARATOR between them."""
    if not data:
        return
    encoding, schema_encoding = _ENCODINGS[data[0] % len(_ENCODINGS)]
    schema, *payloads = data[1:].split(SEPARATOR)
    content = records.schema(1, "a/msg/T", schema_encoding, schema) + records.channel(1, 1, "/a", encoding)
    content += b"".join(records.message(1, i, payload) for i, payload in enumerate(payloads))
    file = records.MAGIC + records.header() + records.chunk(content) + records.data_end()
    path.write_bytes(file + records.ending(b"", 0))
    source = _one_line_or(lambda: Mcap().columns(path))
    asked = ChannelMap(TimeSource(), (ChannelSource("speed", topic="/a", field="x"),), ("axis",), topics=True)
    wanted = _one_line_or(lambda: Mcap().columns(path, asked))
    if source is not None:
        _same(source, wanted)
    if wanted is not None and encoding in _ORACLES:
        column = wanted.columns["/a x"]
        given = dict(zip(np.rint(column.time * 1e9).astype(int).tolist(), column.values.tolist(), strict=True))
        _as_others_read(given, payloads, _ORACLES[encoding](schema), exactly=encoding == "json")


def try_csv(data: bytes, path: Path) -> None:
    """A table: a survey, and the first column as the clock of the second."""
    path.write_bytes(data)
    _one_line_or(lambda: Csv().columns(path))
    asked = ChannelMap(TimeSource(column=0), (ChannelSource("speed", columns=(1,)),), ("axis",))
    _one_line_or(lambda: Csv().columns(path, asked))


TARGETS: dict[str, Callable[[bytes, Path], None]] = {"mcap": try_mcap, "messages": try_messages, "csv": try_csv}


def without_crcs(data: bytes) -> bytes:
    """The same file with the CRCs of its chunks and its summary set to 0, which means without CRCs."""
    made, at = bytearray(data), len(records.MAGIC)
    while at + 9 <= len(made):
        opcode, length = struct.unpack_from("<BQ", made, at)
        if opcode == records.CHUNK and at + 9 + 28 <= len(made):
            made[at + 9 + 24 : at + 9 + 28] = bytes(4)
        if opcode == records.FOOTER and at + 9 + 20 <= len(made):
            made[at + 9 + 16 : at + 9 + 20] = bytes(4)
        at += 9 + length
    return bytes(made)


def _one_line_or(read: Callable[[], Source]) -> Source | None:
    try:
        return read()
    except RecordingError as fault:
        assert fault.message
        return None


def _same(survey: Source, wanted: Source | None) -> None:
    """A field that a survey gives has the same values where it is asked for."""
    column = survey.columns.get("/a x")
    if column is None or wanted is None:
        return
    values = wanted.columns["/a x"].values
    assert values.shape == column.values.shape
    assert np.array_equal(values, column.values, equal_nan=True)


def _as_others_read(
    given: dict[int, float], payloads: list[bytes], oracle: Callable[[bytes], float | None], exactly: bool
) -> None:
    """Message by message the same number; `exactly`: and no number where the other reader has no number."""
    for i, payload in enumerate(payloads):
        try:
            expected = oracle(payload)
        except Exception:  # what no reader takes, or this one does not
            assert not exactly or i not in given, payload
            continue
        if i in given and expected is not None:
            alike = given[i] == expected or (math.isnan(given[i]) and math.isnan(expected))
            assert alike, (payload, given[i], expected)
        assert not exactly or i in given, payload


def _json_oracle(_: bytes) -> Callable[[bytes], float | None]:
    def read(payload: bytes) -> float | None:
        message = json.loads(payload)
        if not isinstance(message, dict):
            raise ValueError("not an object")
        return math.nan if message["x"] is None else _float(message["x"])

    return read


def _cdr_oracle(schema: bytes) -> Callable[[bytes], float | None]:
    from mcap.records import Schema
    from mcap_ros2.decoder import DecoderFactory

    try:
        decode = DecoderFactory().decoder_for("cdr", Schema(schema, "ros2msg", 1, "a/msg/T"))
    except Exception:  # what it does not understand it has no opinion on
        return lambda _: None

    def read(payload: bytes) -> float | None:
        value = decode(payload).x if decode is not None else None
        return float(value) if isinstance(value, int | float) else None

    return read


_ORACLES = {"json": _json_oracle, "cdr": _cdr_oracle}


def _float(value: float) -> float:
    try:
        return float(value)
    except OverflowError:
        return math.copysign(math.inf, value)
