from __future__ import annotations

import tracemalloc
from io import BytesIO
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap_ros2._cdr import CdrWriter, EncapsulationKind
from mcap_ros2._dynamic import _for_each_msgdef, _write_complex_type, generate_dynamic

from cdtool.formats.messages.decoded_batch import ABSENT, UndecodableError
from cdtool.formats.messages.decoders import decoder_for
from cdtool.formats.messages.fields import FieldMissingError, numeric_fields
from tests.data_folder import DATA, data, needs_data
from tests.formats.messages.batches import assert_follows_field_language, batch_of, fields_of, header_stamp, plain
from tests.formats.messages.ros_messages import definitions, numeric_texts

NAME = "test_msgs/msg/Thing"


def decoder_of(text, name=NAME):
    return decoder_for("cdr", "ros2msg", name, text.encode())


def encode(text, value, big=False, name=NAME):
    """Return a message encoded by mcap-ros2-support, in either byte order."""
    specs = {}
    _for_each_msgdef(name, text, lambda full, short, spec: specs.update({full: spec, short: spec}))
    out = BytesIO()
    writer = CdrWriter(out, EncapsulationKind.CDR_BE if big else EncapsulationKind.CDR_LE)
    _write_complex_type(specs[name].msg_name, specs[name].fields, specs, value, writer)
    return out.getvalue()


def oracle(text, payload, name=NAME):
    return plain(generate_dynamic(name, text)[name](payload))


def read(text, payloads, wanted, joints=()):
    return decoder_of(text).decode(batch_of(payloads), wanted, joints)


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.data())
def test_random_messages_decode_as_with_the_package(data):
    text, values = data.draw(definitions())
    messages = data.draw(st.lists(values, min_size=1, max_size=4))
    messages = messages * data.draw(st.integers(1, 2))
    big = data.draw(st.lists(st.booleans(), min_size=len(messages), max_size=len(messages)))
    payloads = [encode(text, message, order) for message, order in zip(messages, big, strict=True)]
    expected = [oracle(text, payload) for payload in payloads]
    names = decoder_of(text).fields(batch_of(payloads))
    assert set(names) >= {
        name for message in expected for name in numeric_fields(message) if not _is_empty_array(message, name)
    }
    wanted = fields_of(*numeric_texts(names))
    for joints in ((), ("a", "é")):
        assert_equals_package(read(text, payloads, wanted, joints), expected, wanted, joints)


def _is_empty_array(message, name):
    value = message
    for step in name.removesuffix("[:]").split("."):
        value = value[step]
    return name.endswith("[:]") and not len(value)


def assert_equals_package(decoded, expected, wanted, joints):
    """Assert the values of the field language; a fault of the schema may have its own text, and is in all messages."""
    for field, field_values in zip(wanted, decoded.fields, strict=True):
        if field_values.fault is not None and field_values.count is None and (field_values.state == ABSENT).all():
            for message in expected:
                assert absent_or_nan(field, message, joints), field.text
        else:
            part = SimpleNamespace(status=decoded.status, fields=(field_values,))
            assert_follows_field_language(part, expected, [field], joints)


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
    wanted = fields_of(*decoder_of(text).fields(None))
    pieces = [payload[:cut] for cut in range(len(payload))]
    decoded = read(text, [payload, *pieces, payload], wanted)
    assert decoded.status.tolist() == [0, *[1] * len(pieces), 0]
    alone = [read(text, [piece], wanted).status[0] for piece in pieces]
    assert all(alone)


def test_messages_of_more_layouts_than_are_compared_are_read_one_by_one():
    text = "string frame_id\nstring[] name\nfloat64[] position"
    messages = [{"frame_id": "x" * k, "name": [f"{k}", "b"], "position": [k, -k]} for k in range(300)] * 2
    payloads = [encode(text, message) for message in messages] + [b"\0\1\0\0"]
    decoder, wanted = decoder_of(text), fields_of("position[:]", "position[b]", "position[7]")
    for step in (1, -1):
        order = slice(None, None, step)
        decoded = decoder.decode(batch_of(payloads[order]), wanted, ())
        assert_equals_package(decoded, [*(oracle(text, payload) for payload in payloads[:-1]), None][order], wanted, ())


def test_a_header_stamp_is_exact_to_the_nanosecond_even_before_the_epoch():
    text = f"std_msgs/Header header\n{'=' * 80}\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id"
    text += f"\n{'=' * 80}\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec"
    stamps = [(1_700_000_000, 123_456_789), (-1, 999_999_999), (2**31 - 1, 1)]
    payloads = [
        encode(text, {"header": {"stamp": {"sec": s, "nanosec": n}, "frame_id": "x" * n.bit_length()}})
        for s, n in stamps
    ]
    decoded = decoder_of(text).decode(batch_of([*payloads, payloads[0][:9]]), [], stamps=True)
    assert decoded.stamps[:3].tolist() == [header_stamp(oracle(text, payload)) for payload in payloads]
    assert decoded.has_stamp.tolist() == [True, True, True, False]
    without = decoder_of("float64 data").decode(batch_of([encode("float64 data", {"data": 1.0})]), [], stamps=True)
    assert without.has_stamp.tolist() == [False]


def test_lengths_greater_than_the_message_are_refused_at_once():
    huge = b"\xff\xff\xff\xff"
    nested = f"Inner[] a\n{'=' * 80}\nMSG: test_msgs/Inner\nstring[] name\nuint8[] b"
    for text in ("float64[] a", "string[] name", "string a", nested):
        inner = [b"\0\1\0\0" + b"\2\0\0\0" + huge * 9] if "string[]" in text else []
        for payload in (b"\0\1\0\0" + huge, b"\0\1\0\0" + huge * 64, *inner):
            assert read(text, [payload], fields_of("a[:]")).status.tolist() == [1], text


def test_a_schema_of_exponential_size_is_refused_at_once():
    rule = "=" * 80
    doubling = "A0 a\nA0 b\nstring c\n" + "".join(
        f"{rule}\nMSG: test_msgs/A{i}\nA{i + 1} a\nA{i + 1} b\nstring c\n" for i in range(60)
    )
    doubling += f"{rule}\nMSG: test_msgs/A60\nint8 a\n"
    arrays = "A0[1000000] a\n" + "".join(f"{rule}\nMSG: test_msgs/A{i}\nA{i + 1}[1000000] a\n" for i in range(9))
    arrays += f"{rule}\nMSG: test_msgs/A9\nint8 a\n"
    for text in (doubling, arrays, "float64[99999999999999999999] a"):
        assert read(text, [b"\0\1\0\0" + bytes(8)], fields_of("a")).status.tolist() == [1]
    empty = doubling.replace("int8 a", "").replace("string c\n", "")
    with pytest.raises(UndecodableError, match="too large"):
        decoder_for("ros1", "ros1msg", NAME, empty.encode()).decode(batch_of([bytes(8)]), fields_of("a"))


@needs_data("mcap_samples")
@pytest.mark.parametrize("name", sorted(path.name for path in DATA.glob("mcap_samples/*.mcap")) if DATA else ["none"])
def test_files_of_other_writers_decode_as_with_the_package(name):
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
            decoder = decoder_for(message_encoding, encoding, title, text.encode())
        except UndecodableError:
            # The definition of a service is not that of a message; the package refuses it, too.
            assert message_encoding != "cdr" or "wstring" in text or "---" in text
            continue
        decode = generate_dynamic(title, text)[title]
        expected = [plain(decode(part)) for part in parts]
        batch = batch_of(parts)
        # ROS 2's char is a uint8; the package reads it as signed.
        wanted = fields_of(*(field for field in decoder.fields(batch) if "char_value" not in field))
        assert_equals_package(decoder.decode(batch, wanted), expected, wanted, ())
        decoded = decoder.decode(batch, [], stamps=True)
        assert [s if t else None for s, t in zip(decoded.stamps.tolist(), decoded.has_stamp, strict=True)] == [
            header_stamp(message) for message in expected
        ]
        compared += len(parts)
    assert compared or "wrong_rmw" in name or "services" in name


def test_the_bytes_of_an_image_are_not_made_into_numbers_by_a_survey():
    text = "float64 exposure\nuint8[] data"
    sizes = [3, 200_000, 210_000, 5, 220_000, 230_000]
    values = [{"exposure": float(size), "data": b"\1" * size} for size in sizes]
    batch = batch_of([encode(text, value) for value in values])
    decoder = decoder_of(text)
    tracemalloc.start()
    exposure, image = decoder.decode(batch, fields_of("exposure", "data[:]"), longest=16).fields
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert exposure.values.tolist() == sizes
    assert image.count.tolist() == sizes and image.values.shape == (6, 3)
    assert image.values[0].tolist() == [1.0, 1.0, 1.0] and np.isnan(image.values[1:]).all()
    assert peak < 8 * len(batch.data)  # a list of the numbers alone takes more
