"""Messages that are truncated, or have an unknown encoding or another kind of CDR, in otherwise undamaged files."""

from __future__ import annotations

import math
import struct
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from tests.formats.mcap_damage import records
from tests.formats.mcap_damage.assembly import Block
from tests.formats.mcap_damage.draft import Draft, share
from tests.formats.mcap_damage.messages import ALL_DEFINITIONS, DEFINITIONS, START, payload
from tests.formats.mcap_damage.truth import Case, Message, without


def _block(tag: bytes, body: bytes) -> bytes:
    """Return a length-delimited protobuf field of less than 128 bytes."""
    return tag + bytes([len(body)]) + body


# A FileDescriptorSet: package m, proto3; message Number { double data = 1; int64 count = 2; }
_NUMBER = _block(b"\n", b"Number") + _block(b"\x12", _block(b"\n", b"data") + b"\x18\1\x20\1\x28\1")
_NUMBER += _block(b"\x12", _block(b"\n", b"count") + b"\x18\2\x20\1\x28\3")
_FILE = _block(b"\n", b"m.proto") + _block(b"\x12", b"m") + _block(b'"', _NUMBER) + _block(b"b", b"proto3")
PROTOBUF_SCHEMA = _block(b"\n", _FILE)

# JSON that never gives a value and is always counted.
GARBLED = (
    *(b"[1, 2]", b"3.5", b"{'x': 1}", b'{"x": 1}}', b'{"x": 1,}', b'{"x" 1}', b'{"x": 01}', b'{"x": .5}'),
    *(b'{"x": 1e}', b'{"x": --1}', b'{"x": 1} trailing', b'\xff\xfe{"x": 1}', b'{"x": "\xff"}'),
    *(b'{"x": ' + b"[" * 100_000, b'{"a":' * 50_000 + b"1", b"null", b"\0" * 16, b'{"x": 1, "x', b'{"x": tru}'),
)
NUMBERS = (math.nan, math.inf, -math.inf, -0.0, 5e-324, 1.7976931348623157e308, float(2**53), 1e22, 1e-5)


@share(5)
def cut_payload(rng: np.random.Generator) -> Case:
    """Truncate some messages of a topic at random bytes, or set the length of their string too large."""
    draft = Draft(rng)
    topic = draft.pick(list(DEFINITIONS))
    hit = _some(draft, topic, 3)
    short = {id(message): replace(message, payload=_cut(message, rng)) for message in hit}
    return _undecodable(draft, short, f"cut_payload {topic}")


@share(3)
def garbled_payload(rng: np.random.Generator) -> Case:
    """Write invalid JSON."""
    draft = Draft(rng)
    changed = {id(m): replace(m, payload=draft.pick(GARBLED)) for m in _some(draft, "/state", 2)}
    return _undecodable(draft, changed, "garbled_payload")


@share(2)
def other_cdr(rng: np.random.Generator) -> Case:
    """Write another encapsulation (parameter lists, XCDR2), which is refused per message and counted."""
    draft = Draft(rng)
    kind = int(rng.choice([2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 0xFF]))
    topic = draft.pick(("/force", "/axis"))
    hit = [message for message in draft.messages if message.topic == topic][:4]
    head = (b"\0" if kind < 255 else b"\xff") + bytes([kind])
    changed = {id(message): replace(message, payload=head + message.payload[2:]) for message in hit}
    return _undecodable(draft, changed, f"other_cdr {kind}")


@share(1)
def big_endian_cdr(rng: np.random.Generator) -> Case:
    """Write all or some messages in big-endian CDR, which must be read."""
    draft = Draft(rng)
    of_all = draft.pick((0.3, 1.0))
    draft.change(
        {
            id(m): replace(m, payload=payload(m.topic, m.time, m.value, big_endian=True))
            for m in draft.messages
            if m.topic in ("/force", "/axis") and rng.random() < of_all
        }
    )
    return draft.case("big_endian_cdr", loss=False)


@share(1)
def long_payload(rng: np.random.Generator) -> Case:
    """Append padding to CDR messages, and white space to JSON, which must be ignored."""
    draft = Draft(rng)
    changed = {}
    for message in draft.other_than("/raw"):
        padded = b" \n" + message.payload + b"\t " if message.topic == "/state" else None
        padded = message.payload + bytes(int(rng.integers(0, 4))) if padded is None else padded
        changed[id(message)] = replace(message, payload=padded)
    draft.change(changed)
    return draft.case("long_payload", loss=False)


@share(3)
def unknown_encoding(rng: np.random.Generator) -> Case:
    """Give /force an unknown message or schema encoding, or an unknown schema; the other topics must be read."""
    draft = Draft(rng, everywhere=False)
    known = DEFINITIONS["/force"]
    itself = b"std_msgs/Float64 data\n" + b"=" * 80 + b"\nMSG: std_msgs/Float64\nFloat64 data"
    schemas = (b"not ? a definition", b"float64 data extra words [", b"pkg/Missing data", b"\xff\xfe\x00")
    schemas += (b"float64[99999999999999999999] data", itself)
    variants = [
        *(replace(known, encoding=encoding) for encoding in ("flatbuffer", "", "CDR", "cdr\0")),
        *(replace(known, schema_encoding=encoding) for encoding in ("omgidl", "")),
        *(replace(known, schema_data=schema) for schema in schemas),
        replace(known, encoding="protobuf", schema_encoding="protobuf", schema_data=b"\xff" * 30),
        replace(known, encoding="ros1", schema_encoding="ros1msg", schema_data=b"\0"),
    ]
    chosen = draft.pick(variants)
    draft.define(ALL_DEFINITIONS.replace(known.records, chosen.records))
    name = f"unknown_encoding {chosen.encoding!r} {chosen.schema_encoding!r} {chosen.schema_data[:20]!r}"
    return draft.case(name, required=draft.other_than("/force"))


@share(1)
def cut_protobuf(rng: np.random.Generator) -> Case:
    """Write protobuf messages, some of them truncated in a field; an omitted number is 0, as in proto3."""
    draft = Draft(rng, everywhere=False)
    schema = records.schema(9, "m.Number", "protobuf", PROTOBUF_SCHEMA)
    own, after = [], b""
    for k, value in enumerate(rng.integers(1, 2**40, 8).tolist()):
        whole = b"\x09" + struct.pack("<d", 0.5) + b"\x10" + _varint(value)
        cut = k % 3 == 1
        # Cut in the number or in the double: a cut between two fields cannot be detected.
        body = whole[: int(rng.choice([*range(1, 9), *range(10, len(whole))]))] if cut else whole
        after += records.message(9, START + k, body)
        own.append(Message("/count", START + k, body, math.nan if cut else float(value)))
    definition = schema + records.channel(9, 9, "/count", "protobuf")
    draft.blocks.append(Block((), definition, after, draft.blocks[0].compression))
    draft.ending = replace(draft.ending, summary=False)
    written = (*draft.messages, *own)
    return draft.case("cut_protobuf", required=(m for m in written if not math.isnan(m.value)), written=written)


@share(2)
def special_numbers(rng: np.random.Generator) -> Case:
    """Write NaN, infinities, -0, subnormals and 2^53, which must be read."""
    draft = Draft(rng)
    changed = {}
    for message in draft.messages:
        if rng.random() < 0.4:
            value = draft.pick(NUMBERS)
            changed[id(message)] = replace(message, value=value, payload=payload(message.topic, message.time, value))
    draft.change(changed)
    return draft.case("special_numbers", loss=False)


@share(2)
def unusual_times(rng: np.random.Generator) -> Case:
    """Write times that repeat, go backwards, are 0 or 2^64 - 1, which must be read unchanged."""
    draft = Draft(rng)
    choices = [
        lambda _: START,
        lambda i: START + (64 - i) * 1000,
        lambda i: 0 if i % 2 else START,
        lambda i: 2**64 - 1 if i % 5 == 0 else START + i,
        lambda i: 2**63 - 3 + i,
        lambda _: 2**64 - 1,
        lambda i: 1_700_000_000 * 10**9 + i * 1_000_000,
    ]
    which = int(rng.integers(len(choices)))
    draft.change({id(m): replace(m, time=choices[which](i)) for i, m in enumerate(draft.messages)})
    return draft.case(f"unusual_times {which}", loss=False)


def _some(draft: Draft, topic: str, count: int) -> list[Message]:
    own = [message for message in draft.messages if message.topic == topic]
    return [own[i] for i in draft.rng.choice(len(own), count, replace=False).tolist()]


def _undecodable(draft: Draft, changed: Mapping[int, Message], name: str) -> Case:
    """Return a case with payloads that cannot be decoded: they have no value, and are reported with their topic."""
    without_value = {key: replace(message, value=math.nan) for key, message in changed.items()}
    draft.change(without_value)
    return draft.case(name, required=without(draft.messages, without_value.values()))


def _cut(message: Message, rng: np.random.Generator) -> bytes:
    if message.topic == "/axis" and rng.random() < 0.4:
        claimed = int(rng.choice([30, 1000, 2**31 - 1, 2**31, 2**32 - 8, 2**32 - 1]))
        return message.payload[:12] + struct.pack("<I", claimed) + message.payload[16:]
    return message.payload[: int(rng.integers(len(message.payload)))]


def _varint(value: int) -> bytes:
    encoded = b""
    while value > 127:
        encoded += bytes([value & 127 | 128])
        value >>= 7
    return encoded + bytes([value])
