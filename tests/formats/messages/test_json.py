from __future__ import annotations

import json

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from cdtool.formats.mcap import Mcap
from cdtool.formats.messages.decoders import decoder_for
from cdtool.formats.messages.fields import numeric_fields
from tests.formats.mcap_files import by_hand  # noqa: F401
from tests.formats.messages.batches import assert_follows_field_language, batch_of, fields_of, header_stamp

WANTED = ("a", "b.c", "q[:]", "q[1]", "q[x]", "b.q[:]", "l[0].c", "l[1].q[0]", "l[x].c", "name[0]", "b", "b[0]", "a.c")
JOINTS = ("x", "y")


def new_decoder():
    return decoder_for("json", "jsonschema", "Thing", b"{}")


def loaded(payload):
    try:
        value = json.loads(payload)
    except (ValueError, RecursionError):
        return None
    return value if isinstance(value, dict) else None


def assert_equals_python(payloads, wanted=WANTED, joints=(), decoder=None):
    wanted = fields_of(*wanted)
    decoded = (decoder or new_decoder()).decode(batch_of(payloads), wanted, joints)
    assert_follows_field_language(decoded, [loaded(payload) for payload in payloads], wanted, joints)


NUMBERS = st.one_of(
    st.floats(), st.integers(-(2**70), 2**70), st.booleans(), st.none(), st.sampled_from([0, -0.0, 10**400])
)
TEXTS = st.one_of(st.text(max_size=6), st.sampled_from(["x", "y", 'a"', "a\\", "\t", "é", "\ud800"]))
ARRAYS = st.lists(st.one_of(NUMBERS, NUMBERS, NUMBERS, TEXTS), max_size=4)
ORDERS = st.sampled_from([["x", "y"], ["y", "x"], ["x"], []])
INNER = st.fixed_dictionaries({}, optional={"c": NUMBERS, "q": ARRAYS, "name": ORDERS, "s": TEXTS})
OBJECTS = st.fixed_dictionaries(
    {},
    optional={
        "a": st.one_of(NUMBERS, TEXTS, INNER),
        "b": st.one_of(INNER, INNER, ARRAYS, TEXTS),
        "q": ARRAYS,
        "l": st.lists(INNER, max_size=3),
        "name": st.one_of(ORDERS, TEXTS),
        "s": TEXTS,
    },
)
LAYOUTS = st.sampled_from([{}, {"separators": (",", ":")}, {"indent": 1}, {"ensure_ascii": True}])


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    st.lists(st.tuples(OBJECTS, LAYOUTS, st.integers(1, 3)), min_size=1, max_size=6), st.randoms(use_true_random=False)
)
def test_random_objects_decode_as_the_field_language_defines(objects, order):
    payloads = [
        json.dumps(value, **{"ensure_ascii": False, **layout}).encode("utf-8", "surrogatepass")
        for value, layout, times in objects
        for _ in range(times)
    ]
    order.shuffle(payloads)
    decoder = new_decoder()
    for joints in ((), JOINTS):
        assert_equals_python(payloads, joints=joints, decoder=decoder)
    assert set(decoder.fields(batch_of(payloads))) == {
        name for payload in payloads for name in numeric_fields(loaded(payload))
    }


@settings(max_examples=300, deadline=None)
@given(st.text(alphabet='{}[]",:\\0123456789.eE+-truefalsn aNIfy\x01é', max_size=30))
@example('{"a":1}x')
@example('{"a":01}')
@example('{"a":1.}')
@example('{"a":.5}')
@example('{"a":-}')
@example('{"a":1e}')
@example('{"a":+1}')
@example('{"a":1,}')
@example('{"a":NaN,"b":{"c":Infinity}}')
@example('{"a":1,"a":2}')
@example('{"a":"\\u00zz"}')
@example('{"\\u0061":3}')
@example('{"a":"\x01"}')
def test_a_text_is_refused_exactly_if_python_refuses_it(text):
    payload = text.encode()
    similar = b'{"a":1,"b":{"c":2}}'
    assert_equals_python([similar, payload, payload, similar])


@pytest.mark.parametrize("depth", [60, 900, 100_000])
def test_deep_nesting_neither_crashes_nor_hangs(depth):
    payload = b'{"a":1,"x":' + b"[" * depth + b"]" * depth + b"}"
    decoded = new_decoder().decode(batch_of([payload, b'{"a":2}']), fields_of("a"))
    assert decoded.status.tolist() in ([0, 0], [1, 0])
    assert decoded.fields[0].values[1] == 2


def test_header_stamps_are_read_in_all_spellings():
    spellings = [("sec", "nanosec"), ("sec", "nsec"), ("secs", "nsecs"), ("seconds", "nanos")]
    objects = [{"header": {"stamp": {s: 1_700_000_000 + i, n: 999_999_999}}} for s, n in spellings for i in range(2)]
    objects += [{"header": {"stamp": {"sec": "12", "nanosec": 5}}}, {"header": {"stamp": {"sec": 2.75, "nanosec": 5}}}]
    objects += [{"header": {"stamp": None}}, {"header": 3}, {}, {"header": {"stamp": {"sec": None, "nanosec": 1}}}]
    decoded = new_decoder().decode(batch_of([json.dumps(each).encode() for each in objects]), [], stamps=True)
    expected = [header_stamp(each) for each in objects[:-1]] + [None]
    assert [s if t else None for s, t in zip(decoded.stamps.tolist(), decoded.has_stamp, strict=True)] == expected


def test_more_fields_than_any_recorder_writes_are_refused_with_the_reason(by_hand):  # noqa: F811
    rows = [(k, k, b'{"field%d": 1.0}' % k) for k in range(5000)]
    source = Mcap().columns(by_hand(rows, "json", "jsonschema", b"{}", "Thing"))
    assert [str(finding) for finding in source.findings if finding.severity == "loss"] == [
        "/a: 5000 of 5000 messages cannot be decoded: its messages have more than 4096 different fields"
    ]


def test_a_message_larger_than_any_recorder_writes_is_damaged():
    payload = b'{"a": [' + b"1," * (8 << 20) + b"1]}"
    decoded = new_decoder().decode(batch_of([payload, b'{"a": [2]}']), fields_of("a[0]"))
    assert decoded.status.tolist() == [1, 0] and "more than 16 MiB" in decoded.reason
