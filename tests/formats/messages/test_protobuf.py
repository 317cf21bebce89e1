from __future__ import annotations

import math
import sys

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from cdtool.formats.messages.decoded_batch import UndecodableError
from cdtool.formats.messages.decoders import decoder_for
from cdtool.formats.messages.fields import element_names
from tests.formats.messages.batches import batch_of, fields_of, same
from tests.formats.messages.protobuf_messages import CASES, contents

pytest.importorskip("google.protobuf")
from google.protobuf.message import DecodeError


def expected(message, field):
    """Return a field's value according to the package; NaN if the field is not present."""
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


def assert_equals_package(decoder, kind, payloads, wanted):
    messages = []
    for payload in payloads:
        try:
            messages.append(kind.FromString(payload))
        except DecodeError:
            messages.append(None)
    wanted = fields_of(*wanted)
    decoded = decoder.decode(batch_of(payloads), wanted)
    for row, message in enumerate(messages):
        if message is None or decoded.status[row]:
            continue
        for field, field_values in zip(wanted, decoded.fields, strict=True):
            value = expected(message, field)
            if value is None:
                assert field_values.state[row] == 2
            elif isinstance(value, list):
                assert field_values.count[row] == len(value)
                if len(value) == field_values.values.shape[1]:
                    assert same(field_values.values[row], value), (field.text, field_values.values[row], value)
            else:
                assert field_values.state[row] == 0 and same([field_values.values[row]], [value]), (
                    field.text,
                    field_values.values[row],
                    value,
                )
    return decoded, messages


MORE = ("inners[0].one_double", "inners[1].many_float[:]", "inners[0].right.x", "many_int32[1]", "again.inner.one_bool")


@pytest.mark.parametrize("case", CASES)
@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(data=st.data())
def test_random_messages_decode_as_with_the_package(case, data):
    decoder, kind = CASES[case]
    drawn = data.draw(st.lists(contents("proto3" in case), min_size=1, max_size=4))
    payloads = [kind(**content).SerializeToString() for content in drawn]
    wanted = (*decoder.fields(None), *MORE)
    decoded, _ = assert_equals_package(decoder, kind, payloads, wanted)
    assert not decoded.status.any()


@settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.data())
def test_a_message_cut_at_any_byte_is_damaged_or_decodes_as_with_the_package(data):
    decoder, kind = CASES["proto3"]
    payload = kind(**data.draw(contents(True))).SerializeToString()
    pieces = [payload[:cut] for cut in range(len(payload))]
    wanted = (*decoder.fields(None), *MORE)
    decoded, messages = assert_equals_package(decoder, kind, [payload, *pieces], wanted)
    # Cut between two fields, it is still a valid message; cut within a field, it is not.
    assert [bool(status) for status in decoded.status] == [message is None for message in messages]


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.data())
def test_a_message_with_changed_bytes_is_damaged_or_decodes_as_with_the_package(data):
    decoder, kind = CASES["proto3"]
    payload = bytearray(kind(**data.draw(contents(True))).SerializeToString() or b"\x08\x01")
    for _ in range(data.draw(st.integers(1, 3))):
        payload[data.draw(st.integers(0, len(payload) - 1))] = data.draw(st.integers(0, 255))
    assert_equals_package(decoder, kind, [bytes(payload)], (*decoder.fields(None), *MORE))


def test_elements_are_found_by_their_names_even_if_these_change():
    decoder, kind = CASES["proto3"]
    rows = [(["x", "y"], [1, 2]), (["y", "x"], [2, 1]), (["y"], [2])]
    for order in ([0, 0, 0], [0, 1, 0], [0, 1, 2]):
        payloads = [kind(name=rows[i][0], many_int32=rows[i][1]).SerializeToString() for i in order]
        decoded = decoder.decode(batch_of(payloads), fields_of("many_int32[x]", "many_int32[y]"), ("x", "y"))
        assert decoded.fields[1].values.tolist() == [2] * 3
        assert decoded.fields[0].state.tolist() == [int(i == 2) for i in order]
    payloads = [kind(name=rows[i][0], many_int32=rows[i][1]).SerializeToString() for i in (0, 1)]
    whole = decoder.decode(batch_of(payloads), fields_of("many_int32[:]"), ("y", "x")).fields[0]
    assert whole.values.tolist() == [[2, 1]] * 2
    contents = decoder.contents(batch_of(payloads))
    assert [element_names(content) for content in contents] == [["x", "y"], ["y", "x"]]


@pytest.mark.parametrize("data", [b"\xff", b"\x0a\xff\x01", b"", b"\x08\x01", b"\x0a\x02\x22\x05"])
def test_damaged_descriptors_are_refused(data):
    with pytest.raises(UndecodableError, match=r"descriptors (are damaged|do not define)"):
        decoder_for("protobuf", "protobuf", "pkg.Outer", data)


def test_a_float_that_signals_as_it_is_converted_is_read_without_a_warning():
    decoder, kind = CASES["proto3"]
    payload = bytearray(kind(one_float=math.inf).SerializeToString())
    payload[1] = 1  # infinity with its last bit changed
    values = decoder.decode(batch_of([bytes(payload)]), fields_of("one_float")).fields[0].values
    assert np.isnan(values).all()


def test_without_the_package_the_reason_names_how_to_install_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "google.protobuf", None)
    with pytest.raises(UndecodableError, match=r"protobuf is not installed: pip install '\.\[protobuf\]'"):
        decoder_for("protobuf", "protobuf", "pkg.Outer", b"")


def test_an_entry_of_a_map_cannot_be_selected_by_number():
    """Maps are repeated messages on the wire, whose order has no meaning."""
    decoder, kind = CASES["proto3"]
    message = kind(one_double=3.0, table={"f": 20.0, "g": 1001.0})
    refused, data = decoder.decode(
        batch_of([message.SerializeToString()]), fields_of("table[0].value", "one_double")
    ).fields
    assert refused.fault.problem == "'table' is not an array" and data.values.tolist() == [3.0]
