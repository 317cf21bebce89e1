"""The fast path for chunks of protobuf and JSON gives the same as single messages, whatever the messages are."""

from __future__ import annotations

import json
import math
import tempfile
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.writer import CompressionType, Writer

from cdtool.formats.mcap.container.log import Log
from tests.formats.mcap.fast_path import same
from tests.messages.protobuf_messages import KINDS, add, contents, descriptor_pb2, every_type_file, make_decoder
from tests.messages.test_json import OBJECTS

START = 1_700_000_000 * 10**9
TOPIC = "/thing"
FIELDS = [
    *(f"one_{kind}" for kind in KINDS),
    *(f"many_{kind}[:]" for kind in ("double", "float", "sfixed32", "fixed64", "int32", "bool")),
    *("many_double[1]", "many_float[a]", "left", "right.y", "maybe", "inner.one_double", "inner.many_double[:]"),
    *("inner.right.x", "again.inner.one_sint32", "inners[0].one_int32", "header.stamp.sec"),
]
CHANGES = ["none", "none", "twice", "reversed", "cut", "byte", "unknown", "group"]


def stamped_file(syntax, packed):
    """Return a file with every type of number, and a header."""
    file = every_type_file(syntax, packed)
    outer = next(message for message in file.message_type if message.name == "Outer")
    stamp, header = file.message_type.add(name="Stamp"), file.message_type.add(name="Header")
    add(stamp, "sec", 1, "int64")
    add(stamp, "nanosec", 2, "uint32")
    add(header, "stamp", 1, "message", inner=".pkg.Stamp")
    add(header, "frame_id", 2, "string")
    add(outer, "header", 100, "message", inner=".pkg.Header")
    return file


CASES = {
    name: (file, make_decoder(file)[1])
    for name, file in {
        "proto3": stamped_file("proto3", None),
        "proto3 unpacked": stamped_file("proto3", packed=False),
        "proto2": stamped_file("proto2", packed=True),
    }.items()
}


def alike(content):
    """Return a strategy for the same members with other numbers."""

    def other(name, value):
        if isinstance(value, dict):
            return alike(value)
        kind = name.removeprefix("one_").removeprefix("many_")
        if kind in KINDS:
            numbers = st.one_of(KINDS[kind], st.just(0))
            return st.tuples(*[numbers] * len(value)).map(list) if isinstance(value, list) else numbers
        return st.just(value)

    return st.fixed_dictionaries({name: other(name, value) for name, value in content.items()})


def changed(payload, change, kind, position):
    """Return the payload of a message as another writer, or damage, may leave it."""
    at = position % max(1, len(payload))
    if change == "twice":
        return payload + payload
    if change == "reversed":
        message = kind.FromString(payload)
        return b"".join(only(kind, message, field).SerializeToString() for field, _ in reversed(message.ListFields()))
    if change == "cut":
        return payload[:at]
    if change == "byte" and payload:
        return payload[:at] + bytes([payload[at] ^ (1 << position % 8)]) + payload[at + 1 :]
    more = {
        "unknown": b"\xc0\x3e\x07\x80\x80\x00\x05" if position % 2 else b"\xc0\x3e\x07",
        "group": b"\xc3\x3e\xc4\x3e",
    }
    return payload + more.get(change, b"")


def only(kind, message, field):
    """Return a message with one of the fields."""
    part = kind()
    part.CopyFrom(message)
    for other, _ in message.ListFields():
        if other.name != field.name:
            part.ClearField(other.name)
    return part


def write(path, encoding, schema, payloads, chunk_size, compression=CompressionType.ZSTD, times=None):
    """Write payloads of one topic, and messages of another topic between them."""
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=chunk_size, compression=compression)
        writer.start()
        channel = writer.register_channel(TOPIC, encoding, writer.register_schema(*schema))
        other = writer.register_channel("/other", "json", 0)
        for i, payload in enumerate(payloads):
            time = times[i % len(times)] + i if times else START + i * 10**6
            writer.add_message(channel, time, payload, time // 2, i)
            if i % 3 == 0:
                writer.add_message(other, time, b"{}", time, i)
        writer.finish()
    return path


def protobuf_schema(case):
    file, _ = CASES[case]
    return "pkg.Outer", "protobuf", descriptor_pb2.FileDescriptorSet(file=[file]).SerializeToString()


STAMPS = st.fixed_dictionaries(
    {"stamp": st.fixed_dictionaries({"sec": st.integers(-3, 2**34), "nanosec": st.integers(0, 10**9)})}
)


@pytest.mark.parametrize("case", CASES)
@settings(max_examples=100, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(data=st.data())
def test_any_protobuf_messages_are_read_like_one_by_one(case, data):
    _, kind = CASES[case]
    base = data.draw(contents(case.startswith("proto3")))
    if data.draw(st.booleans()):
        base["header"] = data.draw(STAMPS)
    runs = data.draw(
        st.lists(
            st.tuples(alike(base), st.sampled_from(CHANGES), st.integers(0, 500), st.sampled_from([1, 9, 60])),
            min_size=1,
            max_size=5,
        )
    )
    payloads = [
        payload
        for content, change, position, count in runs
        for payload in [changed(kind(**content).SerializeToString(), change, kind, position)] * count
    ]
    mentioned = [field for field in FIELDS if field.partition(".")[0].partition("[")[0] in base]
    fields = data.draw(st.lists(st.sampled_from(mentioned or FIELDS), min_size=1, max_size=5, unique=True))
    clock = data.draw(st.sampled_from(["log", "publish", "header"] if "header" in base else ["log", "publish"]))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.mcap"
        write(path, "protobuf", protobuf_schema(case), payloads, data.draw(st.sampled_from([100, 600, 5000])))
        same(path, [(TOPIC, field) for field in fields], clock)


def other_numbers(value):
    """Return a strategy for a JSON value with other numbers."""
    if isinstance(value, dict):
        return st.fixed_dictionaries(
            {name: STAMPS if name == "header" else other_numbers(each) for name, each in value.items()}
        )
    if isinstance(value, list):
        return st.tuples(*map(other_numbers, value)).map(list)
    if isinstance(value, float) or (isinstance(value, int) and not isinstance(value, bool)):
        return st.one_of(st.floats(), st.integers(-(2**66), 2**66), st.sampled_from([0, -0.0, 5e-324, 0.1]))
    return st.just(value)


@settings(max_examples=250, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(data=st.data())
def test_any_json_messages_are_read_like_one_by_one(data):
    base = data.draw(OBJECTS) | {"f": 1.5, "p": {"q": {"r": [1.5, 2.0], "name": ["a", "b"], "s": "frame"}}}
    if data.draw(st.booleans()):
        base["header"] = data.draw(STAMPS)
    changes = st.sampled_from(["none", "none", "none", "cut", "byte", "other"])
    runs = data.draw(
        st.lists(
            st.tuples(other_numbers(base), changes, st.integers(0, 500), st.sampled_from([1, 9, 60])),
            min_size=1,
            max_size=5,
        )
    )
    payloads = []
    for content, change, position, count in runs:
        text = json.dumps(content).encode()
        at = position % len(text)
        text = text[:at] if change == "cut" else text
        text = text[:at] + bytes([text[at] ^ (1 << position % 8)]) + text[at + 1 :] if change == "byte" else text
        text = json.dumps(content | {"more": [1, "x", None]}).encode() if change == "other" else text
        payloads += [text] * count
    texts = ["f", "p.q.r[:]", "p.q.r[b]", "p.q.r[1]", "a", "b.c", "q[:]", "q[1]", "l[0].c", "header.stamp.sec"]
    present = [text for text in texts if text.partition(".")[0].partition("[")[0] in base]
    fields = data.draw(st.lists(st.sampled_from(present), min_size=1, max_size=4, unique=True))
    clock = data.draw(st.sampled_from(["log", "header"] if "header" in base else ["log", "publish"]))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.mcap"
        write(path, "json", ("", "", b""), payloads, data.draw(st.sampled_from([100, 600, 5000])))
        same(path, [(TOPIC, field) for field in fields], clock)


def usual(i):
    """Return the content of message `i` of a usual log; some numbers are zero at times."""
    sec, nanosec = divmod(START + i * 10**8, 10**9)
    return {
        "header": {"stamp": {"sec": sec, "nanosec": nanosec}, "frame_id": "base"},
        "one_double": math.sin(i) if i % 7 else 0.0,
        "one_sint32": -i,
        "many_double": [math.cos(i), i / 7, -0.0],
        "many_float": [i / 4, 0.5],
        "name": ["a", "b", "c"],
        "inner": {"one_double": i / 3, "one_sint64": 3 - i % 5, "right": {"x": float(i)}},
    }


USUAL_FIELDS = ["one_double", "one_sint32", "many_double[:]", "many_double[b]", "inner.one_sint64", "inner.one_double"]


@pytest.mark.parametrize("compression", list(CompressionType))
@pytest.mark.parametrize("clock", ["log", "publish", "header"])
@pytest.mark.parametrize("encoding", ["protobuf", "json"])
def test_usual_protobuf_and_json_logs_are_read_on_the_fast_path(
    tmp_path, fast_path_chunks, encoding, clock, compression
):
    if encoding == "protobuf":
        schema, payloads = (
            protobuf_schema("proto3"),
            [CASES["proto3"][1](**usual(i)).SerializeToString() for i in range(400)],
        )
    else:
        schema, payloads = ("", "", b""), [json.dumps(usual(i)).encode() for i in range(400)]
    path = write(tmp_path / "log.mcap", encoding, schema, payloads, 2000, compression)
    before = dict(fast_path_chunks)
    columns, _, findings = same(path, [(TOPIC, field) for field in USUAL_FIELDS], clock)
    chunks = len(Log(path).summary.chunks)
    assert chunks > 20
    assert fast_path_chunks[True] - before[True] == chunks - 1
    assert fast_path_chunks[False] == before[False]
    assert not findings
    assert columns[f"{TOPIC} many_double[:]"][0] == (400, 3)


@pytest.mark.parametrize("times", [[START, START - 10**9], [-(10**9) % 2**64], [2**63 - 50], [0]])
@pytest.mark.parametrize("encoding", ["protobuf", "json"])
def test_odd_times_of_protobuf_and_json_messages(tmp_path, encoding, times):
    if encoding == "protobuf":
        schema, payloads = (
            protobuf_schema("proto3"),
            [CASES["proto3"][1](**usual(i)).SerializeToString() for i in range(200)],
        )
    else:
        schema, payloads = ("", "", b""), [json.dumps(usual(i)).encode() for i in range(200)]
    path = write(tmp_path / "log.mcap", encoding, schema, payloads, 1500, times=times)
    for clock in ("log", "header"):
        same(path, [(TOPIC, field) for field in USUAL_FIELDS], clock)


@pytest.mark.parametrize("chunk_size", [50, 100, 10**5])
def test_the_error_is_that_of_the_first_faulty_message_wherever_chunks_end(tmp_path, chunk_size):
    good = {"header": {"stamp": {"sec": 1, "nanosec": 0}}, "f": 1.0, "g": 2.0}
    messages = [good, {**good, "header": {}}, {"header": good["header"], "f": 1.0}, {**good, "f": [1.0]}]
    for order, fault in (((0, 1, 2, 3), "header.stamp"), ((0, 2, 1, 3), "'g'"), ((0, 3, 2, 1), "'f'")):
        path = tmp_path / "log.mcap"
        payloads = [json.dumps(messages[i]).encode() for i in order]
        write(path, "json", ("", "", b""), payloads, chunk_size)
        assert fault in same(path, [(TOPIC, "g"), (TOPIC, "f")], "header")
