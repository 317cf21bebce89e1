"""Elements of message arrays selected by name: in every encoding the values that the field language defines."""

from __future__ import annotations

import json
from functools import cache

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from cdtool.base.errors import RecordingError
from cdtool.formats.mcap import Mcap
from cdtool.formats.messages.decoders import decoder_for
from tests.formats.mcap_files import by_hand, wanted  # noqa: F401
from tests.formats.messages import test_cdr, test_ros1
from tests.formats.messages.batches import assert_follows_field_language, batch_of, fields_of
from tests.formats.messages.protobuf_messages import add, descriptor_pb2, make_decoder

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


def protobuf_file():
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


PROTOBUF_FILE = protobuf_file()
PROTOBUF_SCHEMA = descriptor_pb2.FileDescriptorSet(file=[PROTOBUF_FILE]).SerializeToString()
PROTOBUF_DECODER, PROTOBUF_CLASS = make_decoder(PROTOBUF_FILE, "pkg.Thing")


@cache
def ros1_types():
    typesys = pytest.importorskip("rosbags.typesys")
    store = typesys.get_typestore(typesys.Stores.EMPTY)
    store.register(typesys.get_types_from_msg(ROS, "test_msgs/msg/Thing"))
    return store


def ros1_bytes(message):
    """Return the same as test_ros1.encode, with the types parsed only once."""
    filled = test_ros1._message(ros1_types(), "test_msgs/msg/Thing", message)
    return bytes(ros1_types().serialize_ros1(filled, "test_msgs/msg/Thing"))


def encode(encoding, messages):
    """Return the decoder of an encoding, and the encoded messages."""
    if encoding == "json":
        return decoder_for("json", "", "", b""), [json.dumps(message).encode() for message in messages]
    if encoding == "cdr":
        payloads = [test_cdr.encode(ROS, message, big=i % 3 == 2) for i, message in enumerate(messages)]
        return test_cdr.decoder_of(ROS), payloads
    if encoding == "ros1":
        return test_ros1.decoder_of(ROS), [ros1_bytes(message) for message in messages]
    return PROTOBUF_DECODER, [PROTOBUF_CLASS(**message).SerializeToString() for message in messages]


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
def test_random_messages_decode_as_the_field_language_defines(encoding, different, order):
    messages = [different[i % len(different)] for i in order]
    decoder, payloads = encode(encoding, messages)
    fields = fields_of(*WANTED)
    for joints in ((), ("a", "b")):
        for step in (1, -1):  # the second time with the state that the decoder has learned from the first batch
            decoded = decoder.decode(batch_of(payloads[::step]), fields, joints)
            assert_follows_field_language(decoded, messages[::step], fields, joints)


def states(order, **more):
    return {"name": order, "pose": [item(ord(name)) for name in order], "group": []} | more


def item(x):
    return {"x": float(x), "name": [], "q": [x, x + 1], "part": []}


def test_damage_that_only_one_field_reveals_applies_to_all_fields_of_the_message():
    good, bad = states(["b", "a"]), states(["a", "b"])
    payloads = [PROTOBUF_CLASS(**message).SerializeToString() for message in (good, bad, good)]
    inner = PROTOBUF_CLASS(**bad).pose[1].SerializeToString()
    # Field 1 (x) as a varint instead of 8 bytes; the length of the message is unchanged.
    wrong = payloads[1].replace(inner, b"\x08\x05" + inner[9:] + b"\x1a\x05" + bytes(5))
    assert len(wrong) == len(payloads[1]) and wrong != payloads[1]
    payloads[1] = wrong
    decoded = PROTOBUF_DECODER.decode(batch_of(payloads), fields_of("pose[b].x", "pose[b].q[0]"))
    assert decoded.status.tolist() == [0, 1, 0]
    assert decoded.reason == "a decoding error: a field is written as another type than the schema's"


@pytest.mark.parametrize("encoding", ["json", "cdr", "ros1", "protobuf"])
def test_a_log_yields_the_samples_of_a_named_element_and_reports_the_other_messages(by_hand, encoding):  # noqa: F811
    orders = [["a", "b"], ["b", "a"], ["a"], ["c", "a", "b"]]
    _, payloads = encode(encoding, [states(order) for order in orders])
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
    assert [str(finding) for finding in source.findings] == [
        "/a pose[b].x: 1 message names other joints only: left out"
    ]
    with pytest.raises(RecordingError, match=r"no field 'pose\[z\]\.x': no message names this joint"):
        Mcap().columns(path, wanted(("/a", "pose[z].x")))
