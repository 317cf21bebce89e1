from __future__ import annotations

import struct

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from cdtool.formats.messages.decoders import decoder_for
from tests.formats.messages.batches import assert_follows_field_language, batch_of, fields_of
from tests.formats.messages.ros_messages import definitions

typesys = pytest.importorskip("rosbags.typesys")

NAME = "test_msgs/Thing"
EMPTY_HEADER = f"""std_msgs/Header header
float32 x
{"=" * 80}
MSG: std_msgs/Header
uint32 seq
time stamp
string frame_id"""


def decoder_of(text, name=NAME):
    return decoder_for("ros1", "ros1msg", name, text.encode())


def encode(text, value):
    """Return a dict encoded by rosbags."""
    store = typesys.get_typestore(typesys.Stores.EMPTY)
    types = typesys.get_types_from_msg(text, "test_msgs/msg/Thing")
    store.register({name: parts for name, parts in types.items() if name not in store.fielddefs})
    return bytes(store.serialize_ros1(_message(store, "test_msgs/msg/Thing", value), "test_msgs/msg/Thing"))


def _message(store, name, value):
    filled = {}
    for field, (kind, detail) in store.fielddefs[name][1]:
        # rosbags adds a member to a message without members; ROS 1 does not write it.
        filled[field] = _value(store, kind, detail, value.get(field, 0))
    return store.types[name](**filled)


def _value(store, kind, detail, value):
    if kind == 2:
        return _message(store, detail, value)
    if kind in (3, 4):
        (inner, inner_detail), _ = detail
        if inner == 1 and inner_detail[0] != "string":
            return np.array(value, dtype=inner_detail[0])
        return [_value(store, inner, inner_detail, item) for item in value]
    return value


@settings(max_examples=50, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.data())
def test_random_messages_decode_to_the_same_bits(data):
    text, values = data.draw(definitions(ros2=False))
    messages = data.draw(st.lists(values, min_size=1, max_size=4))
    payloads = [encode(text, message) for message in messages]
    decoder = decoder_of(text)
    wanted = fields_of(*decoder.fields(None))
    assert_follows_field_language(decoder.decode(batch_of(payloads), wanted), messages, wanted)


@settings(max_examples=20, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.data())
def test_a_message_cut_at_any_byte_is_damaged_and_never_a_value(data):
    text, values = data.draw(definitions(ros2=False))
    payload = encode(text, data.draw(values))
    decoder = decoder_of(text)
    pieces = [payload[:cut] for cut in range(len(payload))]
    decoded = decoder.decode(batch_of([payload, *pieces]), fields_of(*decoder.fields(None)))
    assert decoded.status.tolist() == [0, *[1] * len(pieces)]


def test_time_and_duration_are_two_numbers_and_the_header_has_a_stamp():
    payloads = [
        struct.pack("<IIII", 3, 1_700_000_000 + i, 999_999_999, 4) + b"base" + struct.pack("<f", i) for i in range(3)
    ]
    decoder = decoder_of(EMPTY_HEADER)
    decoded = decoder.decode(batch_of(payloads), fields_of("header.stamp.nsecs", "x"), stamps=True)
    assert decoded.stamps.tolist() == [(1_700_000_000 + i) * 10**9 + 999_999_999 for i in range(3)]
    assert decoded.fields[0].values.tolist() == [999_999_999] * 3
    assert decoder.fields(None) == ["header.seq", "x"]
    moved = decoder_of("duration d").decode(batch_of([struct.pack("<ii", -1, -5)]), fields_of("d.secs", "d.nsecs"))
    assert [field_values.values.tolist() for field_values in moved.fields] == [[-1], [-5]]
