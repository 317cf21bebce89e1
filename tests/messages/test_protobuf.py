from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from cdtool.messages.columns import UndecodableError, decoder_for
from tests.messages.batches import batch_of, fields_of, same
from tests.messages.protobuf_messages import CASES, contents

pytest.importorskip("google.protobuf")
from google.protobuf.message import DecodeError


def expected(message, field):
    """What the package says of a field: NaN where it tells that it is not there."""
    for i, (name, index) in enumerate(field.steps):
        descriptor = message.DESCRIPTOR.fields_by_name[name]
        last = i == len(field.steps) - 1
        if index is None and descriptor.has_presence and not message.HasField(name):
            return [] if field.whole else math.nan
        message = getattr(message, name)
        if index == ":":
            return [float(value) for value in message]
        if index is not None:
            if int(index) >= len(message):
                return None if len(message) else [] if field.whole else math.nan
            message = message[int(index)]
        if last:
            return float(message)
    raise AssertionError


def assert_as_the_package(decoder, kind, payloads, wanted):
    messages = []
    for payload in payloads:
        try:
            messages.append(kind.FromString(payload))
        except DecodeError:
            messages.append(None)
    wanted = fields_of(*wanted)
    gathered = decoder.gather(batch_of(payloads), wanted)
    for row, message in enumerate(messages):
        if message is None or gathered.status[row]:
            continue
        for field, picked in zip(wanted, gathered.picked, strict=True):
            value = expected(message, field)
            if value is None:
                assert picked.state[row] == 2
            elif isinstance(value, list):
                assert picked.count[row] == len(value)
                if len(value) == picked.values.shape[1]:
                    assert same(picked.values[row], value), (field.text, picked.values[row], value)
            else:
                assert picked.state[row] == 0 and same([picked.values[row]], [value]), (
                    field.text,
                    picked.values[row],
                    value,
                )
    return gathered, messages


MORE = ("inners[0].one_double", "inners[1].many_float[:]", "inners[0].right.x", "many_int32[1]", "again.inner.one_bool")


@pytest.mark.parametrize("case", CASES)
@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(data=st.data())
def test_random_messages_read_as_the_package_reads_them(case, data):
    decoder, kind = CASES[case]
    drawn = data.draw(st.lists(contents("proto3" in case), min_size=1, max_size=4))
    payloads = [kind(**content).SerializeToString() for content in drawn]
    wanted = (*decoder.fields(None), *MORE)
    gathered, _ = assert_as_the_package(decoder, kind, payloads, wanted)
    assert not gathered.status.any()


@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.data())
def test_messages_that_come_in_parts_are_merged_and_the_last_one_wins(data):
    """Messages written one after another are one (protobuf.dev, "Encoding", "Last One Wins")."""
    decoder, kind = CASES[data.draw(st.sampled_from(sorted(CASES)))]
    parts = data.draw(st.lists(contents(False), min_size=2, max_size=3))
    payload = b"".join(kind(**part).SerializeToString() for part in parts)
    gathered, _ = assert_as_the_package(decoder, kind, [payload, payload], (*decoder.fields(None), *MORE))
    assert not gathered.status.any()


@settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.data())
def test_a_message_cut_at_any_byte_is_damaged_or_what_the_package_makes_of_it(data):
    decoder, kind = CASES["proto3"]
    payload = kind(**data.draw(contents(True))).SerializeToString()
    pieces = [payload[:cut] for cut in range(len(payload))]
    wanted = (*decoder.fields(None), *MORE)
    gathered, messages = assert_as_the_package(decoder, kind, [payload, *pieces], wanted)
    # Cut between two fields, it is a message, as far as anyone can tell; cut within one, it is none.
    assert [bool(status) for status in gathered.status] == [message is None for message in messages]


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.data())
def test_flipped_bytes_give_what_the_package_makes_of_them_or_damage(data):
    decoder, kind = CASES["proto3"]
    payload = bytearray(kind(**data.draw(contents(True))).SerializeToString() or b"\x08\x01")
    for _ in range(data.draw(st.integers(1, 3))):
        payload[data.draw(st.integers(0, len(payload) - 1))] = data.draw(st.integers(0, 255))
    assert_as_the_package(decoder, kind, [bytes(payload)], (*decoder.fields(None), *MORE))


def test_an_omitted_number_is_zero_where_its_absence_means_that_and_else_nan():
    decoder, kind = CASES["proto3"]
    payloads = [kind(inner={}).SerializeToString(), b"", kind(maybe=0.0, left=0.0).SerializeToString()]
    wanted = fields_of("one_double", "inner.one_double", "maybe", "left", "right.x")
    values = [picked.values for picked in decoder.gather(batch_of(payloads), wanted).picked]
    nan = math.nan
    table = [[0, 0, 0], [0, nan, nan], [nan, nan, 0], [nan, nan, 0], [nan] * 3]
    assert all(same(found, row) for found, row in zip(values, table, strict=True))
    old, kind = CASES["proto2"]
    assert np.isnan(old.gather(batch_of([b""]), fields_of("one_double")).picked[0].values).all()


@pytest.mark.parametrize(
    ("payload", "reason"),
    [
        (b"\x08", "end within a field"),
        (b"\x09\0\0\0", "end within a field"),
        (b"\x0a" + b"\xff" * 11, "end within a field"),
        (b"\xd2\x05\x05\x09\0", "end within a field"),
        (b"\x08\x01", "written as another type"),
        (b"\x0d\0\0\0\0", "written as another type"),
        (b"\x00\x01", "no protobuf"),
        (b"\x0c", "no protobuf"),
        (b"\x0f\x01", "no protobuf"),
    ],
)
def test_damage_is_told(payload, reason):
    gathered = CASES["proto3"][0].gather(batch_of([payload]), fields_of("one_double", "inner.one_double"))
    assert gathered.status.tolist() == [1]
    assert reason in gathered.reason
    assert np.isnan(gathered.picked[0].values).all()


def test_elements_that_alternate_with_those_of_another_field_stay_in_order():
    decoder, _ = CASES["proto3"]
    payload = b"".join(
        b"\xa1\x01" + np.float64(i).tobytes() + b"\xad\x01" + np.float32(-i).tobytes() for i in range(200)
    )
    first, second = decoder.gather(batch_of([payload] * 3), fields_of("many_double[:]", "many_float[:]")).picked
    assert (first.values == np.arange(200)).all() and (second.values == -np.arange(200)).all()


def test_elements_are_found_by_their_names_also_where_these_change():
    decoder, kind = CASES["proto3"]
    rows = [(["x", "y"], [1, 2]), (["y", "x"], [2, 1]), (["y"], [2])]
    for order in ([0, 0, 0], [0, 1, 0], [0, 1, 2]):
        payloads = [kind(name=rows[i][0], many_int32=rows[i][1]).SerializeToString() for i in order]
        found = decoder.gather(batch_of(payloads), fields_of("many_int32[x]", "many_int32[y]"), ("x", "y"))
        assert found.picked[1].values.tolist() == [2] * 3
        assert found.picked[0].state.tolist() == [int(i == 2) for i in order]
    payloads = [kind(name=rows[i][0], many_int32=rows[i][1]).SerializeToString() for i in (0, 1)]
    whole = decoder.gather(batch_of(payloads), fields_of("many_int32[:]"), ("y", "x")).picked[0]
    assert whole.values.tolist() == [[2, 1]] * 2
    assert decoder.names(batch_of(payloads), fields_of("many_int32[:]")[0]) == ["x", "y"]


@pytest.mark.parametrize("data", [b"\xff", b"\x0a\xff\x01", b"", b"\x08\x01", b"\x0a\x02\x22\x05"])
def test_descriptors_that_are_damaged_are_refused(data):
    with pytest.raises(UndecodableError, match=r"descriptors (are damaged|do not have)"):
        decoder_for("protobuf", "protobuf", "pkg.Outer", data)
