from __future__ import annotations

from functools import partialmethod
from io import BytesIO
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap_ros2._cdr import CdrWriter, EncapsulationKind
from mcap_ros2._dynamic import _for_each_msgdef, _write_complex_type, generate_dynamic

from cdtool.messages.columns import UndecodableError, decoder_for
from cdtool.messages.columns.decoded_batch import ABSENT
from cdtool.messages.fields import FieldMissingError, header_stamp, numeric_fields
from tests.data_folder import DATA, data, needs_data
from tests.messages.batches import assert_as_the_field_language, batch_of, fields_of
from tests.messages.ros_messages import definitions, numeric_texts

NAME = "test_msgs/msg/Thing"


def decoder(text, name=NAME):
    return decoder_for("cdr", "ros2msg", name, text.encode())


def encode(text, value, big=False, name=NAME):
    """mcap-ros2-support's bytes, in either byte order."""
    found = {}
    _for_each_msgdef(name, text, lambda full, short, spec: found.update({full: spec, short: spec}))
    out = BytesIO()
    writer = CdrWriter(out, EncapsulationKind.CDR_BE if big else EncapsulationKind.CDR_LE)
    _write_complex_type(found[name].msg_name, found[name].fields, found, value, writer)
    return out.getvalue()


def oracle(text, payload, name=NAME):
    return generate_dynamic(name, text)[name](payload)


def read(text, payloads, wanted, joints=(), checked=False):
    found = decoder(text)
    if checked:
        found.finder.find = found.finder.checked
    return found.gather(batch_of(payloads), wanted, joints)


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.data())
def test_random_messages_read_as_the_package_reads_them(data):
    text, values = data.draw(definitions())
    messages = data.draw(st.lists(values, min_size=1, max_size=4))
    messages = messages * data.draw(st.integers(1, 2))
    big = data.draw(st.lists(st.booleans(), min_size=len(messages), max_size=len(messages)))
    payloads = [encode(text, message, order) for message, order in zip(messages, big, strict=True)]
    made = [oracle(text, payload) for payload in payloads]
    names = decoder(text).fields(batch_of(payloads))
    assert set(names) >= {
        name for message in made for name in numeric_fields(message) if not _text_array(message, name)
    }
    wanted = fields_of(*numeric_texts(names))
    for joints in ((), ("a", "é")):
        for checked in (False, True):
            assert_typed(read(text, payloads, wanted, joints, checked), made, wanted, joints)


def _text_array(message, name):
    value = message
    for step in name.removesuffix("[:]").split("."):
        value = getattr(value, step)
    return name.endswith("[:]") and not len(value)


def assert_typed(gathered, made, wanted, joints):
    """As the field language, but that a fault which the schema tells is one in all messages, in words of its own."""
    for field, picked in zip(wanted, gathered.picked, strict=True):
        if picked.fault is not None and picked.count is None and (picked.state == ABSENT).all():
            for message in made:
                assert absent_or_nan(field, message, joints), field.text
        else:
            part = SimpleNamespace(status=gathered.status, picked=(picked,))
            assert_as_the_field_language(part, made, [field], joints)


def absent_or_nan(field, message, joints):
    try:
        value = field.of(message, joints)
    except FieldMissingError:
        return True
    return value is None or value == [] or np.isnan(value)


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.data())
def test_a_message_cut_at_any_byte_is_damaged_and_never_a_value(data):
    text, values = data.draw(definitions())
    message = data.draw(values)
    payload = encode(text, message)
    wanted = fields_of(*decoder(text).fields(None))
    pieces = [payload[:cut] for cut in range(len(payload))]
    for checked in (False, True):
        gathered = read(text, [payload, *pieces, payload], wanted, checked=checked)
        assert gathered.status.tolist() == [0, *[1] * len(pieces), 0]
    alone = [read(text, [piece], wanted).status[0] for piece in pieces]
    assert all(alone)


def _counted_method(finder, calls, slow, *arguments):
    calls.append(1)
    return slow(finder, *arguments)


def test_messages_of_one_length_pattern_are_read_at_once_and_a_different_one_message_by_message(monkeypatch):
    text = "string frame_id\nstring[] name\nfloat64[] position\nint16 last"
    row = {"frame_id": "base", "name": ["a", "b"], "position": [1.5, -2.5], "last": 7}
    other = {"frame_id": "gripper", "name": ["b", "a"], "position": [3.0, 4.0], "last": 8}
    found = decoder(text)
    slow = type(found.finder).checked
    wanted = fields_of("position[:]", "position[b]", "last")
    for payloads, patterned in (([row] * 3, True), ([row, other, row], False), ([other] * 2, True)):
        calls = []
        monkeypatch.setattr(type(found.finder), "checked", partialmethod(_counted_method, calls, slow))
        gathered = found.gather(batch_of([encode(text, each) for each in payloads]), wanted, ("a", "b"))
        assert bool(calls) != patterned
        expected = [each["position"] if each is row else each["position"][::-1] for each in payloads]
        assert gathered.picked[0].values.tolist() == expected
        assert gathered.picked[1].values.tolist() == [each[1] for each in expected]
        assert gathered.picked[2].values.tolist() == [each["last"] for each in payloads]


def test_a_number_beyond_two_to_the_53_is_the_nearest_float():
    text = "int64 a\nuint64 b"
    message = {"a": -(2**63) + 1, "b": 2**64 - 1}
    gathered = read(text, [encode(text, message), encode(text, message, big=True)], fields_of("a", "b"))
    assert [picked.values.tolist() for picked in gathered.picked] == [[float(-(2**63) + 1)] * 2, [float(2**64 - 1)] * 2]


def test_a_header_stamp_is_exact_to_the_nanosecond_also_before_the_epoch():
    text = f"std_msgs/Header header\n{'=' * 80}\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id"
    text += f"\n{'=' * 80}\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec"
    stamps = [(1_700_000_000, 123_456_789), (-1, 999_999_999), (2**31 - 1, 1)]
    payloads = [
        encode(text, {"header": {"stamp": {"sec": s, "nanosec": n}, "frame_id": "x" * n.bit_length()}})
        for s, n in stamps
    ]
    gathered = decoder(text).gather(batch_of([*payloads, payloads[0][:9]]), [], stamps=True)
    assert gathered.stamps[:3].tolist() == [header_stamp(oracle(text, payload)) for payload in payloads]
    assert gathered.has_stamp.tolist() == [True, True, True, False]
    without = decoder("float64 data").gather(batch_of([encode("float64 data", {"data": 1.0})]), [], stamps=True)
    assert without.has_stamp.tolist() == [False]


@pytest.mark.parametrize("kind", ["0002", "0003", "0006", "0007", "0009", "000b"])
def test_other_kinds_of_cdr_are_refused(kind):
    gathered = read("float64 data", [bytes.fromhex(kind) + bytes(10)], fields_of("data"))
    assert gathered.status.tolist() == [1]
    assert gathered.reason == f"not plain CDR (starts with {kind}0000)"
    assert np.isnan(gathered.picked[0].values).all()


def test_lengths_that_the_message_cannot_hold_are_refused_at_once():
    huge = b"\xff\xff\xff\xff"
    nested = f"Inner[] a\n{'=' * 80}\nMSG: test_msgs/Inner\nstring[] name\nuint8[] b"
    for text in ("float64[] a", "string[] name", "string a", nested):
        inner = [b"\0\1\0\0" + b"\2\0\0\0" + huge * 9] if "string[]" in text else []
        for payload in (b"\0\1\0\0" + huge, b"\0\1\0\0" + huge * 64, *inner):
            assert read(text, [payload], fields_of("a[:]")).status.tolist() == [1], text


def test_a_schema_that_grows_beyond_all_bounds_is_refused():
    rule = "=" * 80
    doubling = "A0 a\nA0 b\nstring c\n" + "".join(
        f"{rule}\nMSG: test_msgs/A{i}\nA{i + 1} a\nA{i + 1} b\nstring c\n" for i in range(60)
    )
    doubling += f"{rule}\nMSG: test_msgs/A60\nint8 a\n"
    arrays = "A0[1000000] a\n" + "".join(f"{rule}\nMSG: test_msgs/A{i}\nA{i + 1}[1000000] a\n" for i in range(9))
    arrays += f"{rule}\nMSG: test_msgs/A9\nint8 a\n"
    for text in (doubling, arrays):
        with pytest.raises(UndecodableError, match="too large"):
            read(text, [b"\0\1\0\0" + bytes(8)], fields_of("a"))


def test_a_wide_string_is_refused():
    with pytest.raises(UndecodableError, match="'s' is a wstring"):
        decoder("float64 data\nwstring s")


@needs_data("mcap_samples")
@pytest.mark.parametrize("name", sorted(path.name for path in DATA.glob("mcap_samples/*.mcap")) if DATA else ["none"])
def test_files_of_other_writers_read_as_the_package_reads_them(name):
    payloads, schemas = {}, {}
    with (data("mcap_samples") / name).open("rb") as file:
        for schema, channel, message in make_reader(file).iter_messages():
            key = (schema.name, schema.encoding, channel.message_encoding)
            payloads.setdefault(key, []).append(message.data)
            schemas[key] = schema
    compared = 0
    for (title, encoding, message_encoding), parts in payloads.items():
        text = schemas[title, encoding, message_encoding].data.decode()
        try:
            found = decoder_for(message_encoding, encoding, title, text.encode())
        except UndecodableError:
            # A service's definition is none of a message, and the package refuses it too.
            assert message_encoding != "cdr" or "wstring" in text or "---" in text
            continue
        decode = generate_dynamic(title, text)[title]
        made = [decode(part) for part in parts]
        batch = batch_of(parts)
        # ROS 2's char is an uint8, which the package takes for signed.
        wanted = fields_of(*(field for field in found.fields(batch) if "char_value" not in field))
        assert_typed(found.gather(batch, wanted), made, wanted, ())
        gathered = found.gather(batch, [], stamps=True)
        assert [s if t else None for s, t in zip(gathered.stamps.tolist(), gathered.has_stamp, strict=True)] == [
            header_stamp(message) for message in made
        ]
        compared += len(parts)
    assert compared or "wrong_rmw" in name or "services" in name
