"""Elements of arrays of messages that are found by their names: in every encoding what the field language says."""

from __future__ import annotations

import json
from functools import cache

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from cdtool.errors import RecordingError
from cdtool.formats.mcap import Mcap
from cdtool.messages.columns import decoder_for
from cdtool.messages.columns.decoded_batch import ABSENT, OTHER_JOINTS, THERE
from tests.formats.mcap_files import by_hand, wanted  # noqa: F401
from tests.messages import test_cdr, test_ros1
from tests.messages.batches import assert_as_the_field_language, batch_of, fields_of, same
from tests.messages.protobuf_messages import add, descriptor_pb2, made

RULE = "=" * 80
ROS = f"""string[] name
test_msgs/Item[] pose
test_msgs/Group[] group
{RULE}
MSG: test_msgs/Item
float64 x
string[] name
int32[] q
test_msgs/Part[] part
{RULE}
MSG: test_msgs/Part
float64 x
{RULE}
MSG: test_msgs/Group
string[] name
test_msgs/Item[] pose
"""
WANTED = (
    "pose[b].x",
    "pose[b].q[1]",
    "pose[b].q[:]",
    "pose[b].q[a]",
    "pose[b].part[a].x",
    "pose[b].part[1].x",
    "pose[0].part[b].x",
    "group[b].pose[a].x",
    "group[b].pose[a].q[:]",
    "group[1].pose[b].x",
    "group[a].pose[1].x",
)


def protobuf():
    file = descriptor_pb2.FileDescriptorProto(name="named.proto", package="pkg", syntax="proto3")
    part, item, group, thing = (file.message_type.add(name=name) for name in ("Part", "Item", "Group", "Thing"))
    add(part, "x", 1, "double")
    add(item, "x", 1, "double")
    add(item, "q", 3, "int32", repeated=True)
    add(item, "part", 4, "message", repeated=True, inner=".pkg.Part")
    for message in (item, group, thing):
        add(message, "name", 2, "string", repeated=True)
    for message in (group, thing):
        add(message, "pose", 5, "message", repeated=True, inner=".pkg.Item")
    add(thing, "group", 6, "message", repeated=True, inner=".pkg.Group")
    return file


PROTOBUF_FILE = protobuf()
PROTOBUF_SCHEMA = descriptor_pb2.FileDescriptorSet(file=[PROTOBUF_FILE]).SerializeToString()
PROTOBUF, KIND = made(PROTOBUF_FILE, "pkg.Thing")


@cache
def ros1_types():
    typesys = pytest.importorskip("rosbags.typesys")
    store = typesys.get_typestore(typesys.Stores.EMPTY)
    store.register(typesys.get_types_from_msg(ROS, "test_msgs/msg/Thing"))
    return store


def ros1_bytes(message):
    """As test_ros1.encode, with the types understood once."""
    filled = test_ros1._message(ros1_types(), "test_msgs/msg/Thing", message)
    return bytes(ros1_types().serialize_ros1(filled, "test_msgs/msg/Thing"))


def encoded(encoding, messages):
    """The decoder of an encoding, and the messages in it."""
    if encoding == "json":
        return decoder_for("json", "", "", b""), [json.dumps(message).encode() for message in messages]
    if encoding == "cdr":
        payloads = [test_cdr.encode(ROS, message, big=i % 3 == 2) for i, message in enumerate(messages)]
        return test_cdr.decoder(ROS), payloads
    if encoding == "ros1":
        return test_ros1.decoder(ROS), [ros1_bytes(message) for message in messages]
    return PROTOBUF, [KIND(**message).SerializeToString() for message in messages]


ENCODINGS = ("json", "cdr", "ros1", "protobuf")
names = st.lists(st.sampled_from(("a", "b", "c", "")), max_size=4)
numbers = st.floats(-1e6, 1e6)
items = st.lists(
    st.fixed_dictionaries(
        {
            "x": numbers,
            "name": names,
            "q": st.lists(st.integers(-9, 9), max_size=3),
            "part": st.lists(st.fixed_dictionaries({"x": numbers}), max_size=3),
        }
    ),
    max_size=4,
)
groups = st.lists(st.fixed_dictionaries({"name": names, "pose": items}), max_size=3)
things = st.fixed_dictionaries({"name": names, "pose": items, "group": groups})


@pytest.mark.parametrize("encoding", ENCODINGS)
@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(different=st.lists(things, min_size=1, max_size=4), order=st.lists(st.integers(0, 3), min_size=1, max_size=7))
def test_random_messages_give_what_the_field_language_says(encoding, different, order):
    messages = [different[i % len(different)] for i in order]
    decoder, payloads = encoded(encoding, messages)
    asked = fields_of(*WANTED)
    for joints in ((), ("a", "b")):
        for step in (1, -1):  # the second time with what the first has left behind in the decoder
            gathered = decoder.gather(batch_of(payloads[::step]), asked, joints)
            assert_as_the_field_language(gathered, messages[::step], asked, joints)


@pytest.mark.parametrize("encoding", ENCODINGS[1:])
@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(messages=st.lists(things, min_size=1, max_size=6))
def test_every_encoding_gives_what_json_gives(encoding, messages):
    asked = fields_of(*WANTED)
    found = []
    for each in ("json", encoding):
        decoder, payloads = encoded(each, messages)
        found.append(decoder.gather(batch_of(payloads), asked))
    for field, expected, picked in zip(asked, found[0].picked, found[1].picked, strict=True):
        assert picked.state.tolist() == expected.state.tolist(), field.text
        assert same(picked.values, expected.values), field.text
        there = expected.state == THERE
        assert expected.count is None or (picked.count[there] == expected.count[there]).all(), field.text
        assert (picked.fault is None) == (expected.fault is None), field.text
        if expected.fault is not None:
            assert picked.fault.problem == expected.fault.problem, field.text


def states(order, **more):
    return {"name": order, "pose": [item(ord(name)) for name in order], "group": []} | more


def item(x):
    return {"x": float(x), "name": [], "q": [x, x + 1], "part": []}


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_an_element_is_found_wherever_it_is_and_its_absence_is_told_from_an_empty_array(encoding):
    messages = [states(["a", "b"]), states(["b", "a"]), states(["a"]), states(["b"], pose=[]), states(["a", "b", "b"])]
    decoder, payloads = encoded(encoding, messages)
    number, whole = decoder.gather(batch_of(payloads), fields_of("pose[b].x", "pose[b].q[:]")).picked
    assert same(number.values, [98.0, 98.0, np.nan, np.nan, 98.0])
    assert number.state.tolist() == whole.state.tolist() == [THERE, THERE, OTHER_JOINTS, THERE, THERE]
    assert same(whole.values, [[98, 99], [98, 99], [np.nan] * 2, [np.nan] * 2, [98, 99]])
    assert whole.count[whole.state == THERE].tolist() == [2, 2, 0, 2]


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_an_element_behind_the_named_one_that_is_not_there_is_a_fault_of_its_message(encoding):
    messages = [states(["b"]), states(["a", "b"]), states(["a"])]
    decoder, payloads = encoded(encoding, messages)
    (picked,) = decoder.gather(batch_of(payloads), fields_of("pose[b].q[2]")).picked
    assert picked.state.tolist() == [ABSENT, ABSENT, OTHER_JOINTS]
    assert picked.fault.problem == "'q' has 2 elements" and picked.fault.known == ("q[0] to q[1]",)


@pytest.mark.parametrize("encoding", ENCODINGS[1:])
@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("pose[b].y", "there is no 'y'"),
        ("pose[b].part[a].y", "there is no 'y'"),
        ("pose[b]", "'pose[b]' holds a"),
        ("pose[b].name", "'pose[b].name' is an array"),
        ("pose[b].name[0]", "holds a text"),
        ("group[b].pose[b].x[0]", "'x' is not an array"),
    ],
)
def test_what_the_schema_does_not_have_is_told_once(encoding, text, problem):
    decoder, payloads = encoded(encoding, [states(["a", "b"])])
    (picked,) = decoder.gather(batch_of(payloads), fields_of(text)).picked
    assert picked.state.tolist() == [ABSENT] and problem in picked.fault.problem


def test_an_array_without_names_beside_it_is_an_error_as_in_json():
    text = f"test_msgs/Item[] pose\n{RULE}\nMSG: test_msgs/Item\nstring name\nfloat64 x\n"
    message = {"pose": [{"name": "b", "x": 1.0}]}
    (picked,) = test_cdr.read(text, [test_cdr.encode(text, message)], fields_of("pose[b].x")).picked
    decoder = decoder_for("json", "", "", b"")
    (expected,) = decoder.gather(batch_of([json.dumps(message).encode()]), fields_of("pose[b].x")).picked
    assert picked.fault.problem == expected.fault.problem == "there is no 'name'"


@pytest.mark.parametrize("encoding", ENCODINGS[1:])
def test_the_names_are_those_beside_the_array(encoding):
    decoder, payloads = encoded(encoding, [states(["b", "a"]), states(["c"])])
    assert decoder.names(batch_of(payloads), fields_of("pose[z].x")[0]) == ["a", "b", "c"]


@pytest.mark.parametrize("encoding", ["cdr", "ros1"])
def test_messages_whose_names_never_change_are_read_at_once(encoding, monkeypatch):
    decoder, payloads = encoded(encoding, [states(["a", "b"], pose=[item(1), item(k)]) for k in range(2)] * 50)
    if encoding == "cdr":
        decoder, payloads = test_cdr.decoder(ROS), [test_cdr.encode(ROS, states(["a", "b"]))] * 100
    monkeypatch.setattr(type(decoder.finder), "checked", None)
    (picked,) = decoder.gather(batch_of(payloads), fields_of("pose[b].x")).picked
    assert np.isfinite(picked.values).all()


def test_a_message_that_only_the_named_field_shows_to_be_damaged_is_damaged_for_all():
    good, bad = states(["b", "a"]), states(["a", "b"])
    payloads = [KIND(**message).SerializeToString() for message in (good, bad, good)]
    inner = KIND(**bad).pose[1].SerializeToString()
    # Field 1 (x) as a varint instead of 8 bytes; the message stays as long.
    wrong = payloads[1].replace(inner, b"\x08\x05" + inner[9:] + b"\x1a\x05" + bytes(5))
    assert len(wrong) == len(payloads[1]) and wrong != payloads[1]
    payloads[1] = wrong
    gathered = PROTOBUF.gather(batch_of(payloads), fields_of("pose[b].x", "pose[b].q[0]"))
    assert gathered.status.tolist() == [0, 1, 0]
    assert gathered.reason == "a decoding error: a field is written as another type than the schema's"


@pytest.mark.parametrize("encoding", ["json", "cdr", "ros1", "protobuf"])
def test_a_log_gives_the_named_elements_samples_and_tells_of_the_other_messages(by_hand, encoding):  # noqa: F811
    orders = [["a", "b"], ["b", "a"], ["a"], ["c", "a", "b"]]
    _, payloads = encoded(encoding, [states(order) for order in orders])
    schemas = {
        "json": ("jsonschema", b"{}", "Thing"),
        "cdr": ("ros2msg", ROS.encode(), test_cdr.NAME),
        "ros1": ("ros1msg", ROS.encode(), test_ros1.NAME),
        "protobuf": ("protobuf", PROTOBUF_SCHEMA, "pkg.Thing"),
    }
    kind, schema, name = schemas[encoding]
    path = by_hand([(10**9 * k, k, payload) for k, payload in enumerate(payloads)], encoding, kind, schema, name)
    source = Mcap().columns(path, wanted(("/a", "pose[b].x"), ("/a", "pose[a].x")))
    assert source.columns["/a pose[b].x"].values.tolist() == [98.0] * 3
    assert source.columns["/a pose[b].x"].time.tolist() == [0.0, 1.0, 3.0]
    assert source.columns["/a pose[a].x"].values.tolist() == [97.0] * 4
    assert [str(found) for found in source.findings] == ["/a pose[b].x: 1 message names other joints only: left out"]
    with pytest.raises(RecordingError, match=r"no field 'pose\[z\]\.x': no message names this joint"):
        Mcap().columns(path, wanted(("/a", "pose[z].x")))
