"""Messages that are truncated, or have an unknown encoding or another kind of CDR, in otherwise undamaged files."""

from __future__ import annotations

import math
import struct
from dataclasses import replace

import numpy as np

from tests.formats.mcap_damage import records
from tests.formats.mcap_damage.assembly import Block, assemble
from tests.formats.mcap_damage.chunks import draw_blocks, draw_ending
from tests.formats.mcap_damage.messages import ALL_DEFINITIONS, DEFINITIONS, START, payload
from tests.formats.mcap_damage.truth import Case, Message, Truth, without


def _block(tag: bytes, body: bytes) -> bytes:
    """Return a length-delimited protobuf field of less than 128 bytes."""
    return tag + bytes([len(body)]) + body


# A FileDescriptorSet: package m, proto3; message Number { double data = 1; int64 count = 2; }
_NUMBER = _block(b"\n", b"Number") + _block(b"\x12", _block(b"\n", b"data") + b"\x18\1\x20\1\x28\1")
_NUMBER += _block(b"\x12", _block(b"\n", b"count") + b"\x18\2\x20\1\x28\3")
_FILE = _block(b"\n", b"m.proto") + _block(b"\x12", b"m") + _block(b'"', _NUMBER) + _block(b"b", b"proto3")
PROTOBUF_SCHEMA = _block(b"\n", _FILE)


def cut_payload(rng: np.random.Generator) -> Case:
    """Truncate some messages of a topic at random bytes, or set the length of their string too large."""
    messages, blocks = draw_blocks(rng)
    topic = list(DEFINITIONS)[int(rng.integers(4))]
    hit = [message for message in messages if message.topic == topic]
    hit = [hit[i] for i in rng.choice(len(hit), 3, replace=False).tolist()]
    short = {id(message): replace(message, payload=_cut(message, rng)) for message in hit}
    return _changed(rng, messages, blocks, short, f"cut_payload {topic}")


def garbled_payload(rng: np.random.Generator) -> Case:
    """Write invalid JSON, which never gives a value and is always counted."""
    messages, blocks = draw_blocks(rng)
    variants = [
        b"[1, 2]",
        b"3.5",
        b"{'x': 1}",
        b'{"x": 1}}',
        b'{"x": 1,}',
        b'{"x" 1}',
        b'{"x": 01}',
        b'{"x": .5}',
        b'{"x": 1e}',
        b'{"x": --1}',
        b'{"x": 1} trailing',
        b'\xff\xfe{"x": 1}',
        b'{"x": "\xff"}',
        b'{"x": ' + b"[" * 100_000,
        b'{"a":' * 50_000 + b"1",
        b"null",
        b"\0" * 16,
        b'{"x": 1, "x',
        b'{"x": tru}',
    ]
    hit = [message for message in messages if message.topic == "/state"]
    hit = [hit[i] for i in rng.choice(len(hit), 2, replace=False).tolist()]
    changed = {id(message): replace(message, payload=variants[int(rng.integers(len(variants)))]) for message in hit}
    return _changed(rng, messages, blocks, changed, "garbled_payload")


def other_cdr(rng: np.random.Generator) -> Case:
    """Write another encapsulation (parameter lists, XCDR2), which is refused per message and counted."""
    messages, blocks = draw_blocks(rng)
    kind = int(rng.choice([2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 0xFF]))
    topic = ("/force", "/axis")[int(rng.integers(2))]
    hit = [message for message in messages if message.topic == topic][:4]
    changed = {
        id(m): replace(m, payload=(b"\0" if kind < 255 else b"\xff") + bytes([kind]) + m.payload[2:]) for m in hit
    }
    return _changed(rng, messages, blocks, changed, f"other_cdr {kind}")


def big_endian_cdr(rng: np.random.Generator) -> Case:
    """Write all or some messages in big-endian CDR, which must be read."""
    messages, blocks = draw_blocks(rng)
    share = (0.3, 1.0)[int(rng.integers(2))]
    changed = {
        id(m): replace(m, payload=payload(m.topic, m.time, m.value, big_endian=True))
        for m in messages
        if m.topic in ("/force", "/axis") and rng.random() < share
    }
    blocks = _with(blocks, changed)
    written = tuple(changed.get(id(message), message) for message in messages)
    return Case("big_endian_cdr", assemble(blocks, draw_ending(rng)), Truth(written, written, loss=False))


def long_payload(rng: np.random.Generator) -> Case:
    """Append padding to CDR messages, and white space to JSON, which must be ignored."""
    messages, blocks = draw_blocks(rng)
    changed = {}
    for message in messages:
        if message.topic == "/state":
            changed[id(message)] = replace(message, payload=b" \n" + message.payload + b"\t ")
        elif message.topic != "/raw":
            changed[id(message)] = replace(message, payload=message.payload + bytes(int(rng.integers(0, 4))))
    blocks = _with(blocks, changed)
    written = tuple(changed.get(id(message), message) for message in messages)
    return Case("long_payload", assemble(blocks, draw_ending(rng)), Truth(written, written, loss=False))


def unknown_encoding(rng: np.random.Generator) -> Case:
    """Give /force an unknown message or schema encoding, or an unknown schema; the other topics must be read."""
    messages, blocks = draw_blocks(rng, everywhere=False)
    known = DEFINITIONS["/force"]
    variants = [
        replace(known, encoding="flatbuffer"),
        replace(known, encoding=""),
        replace(known, encoding="CDR"),
        replace(known, encoding="cdr\0"),
        replace(known, schema_encoding="omgidl"),
        replace(known, schema_encoding=""),
        replace(known, schema_data=b"not ? a definition"),
        replace(known, schema_data=b"float64 data extra words ["),
        replace(known, schema_data=b"pkg/Missing data"),
        replace(known, schema_data=b"\xff\xfe\x00"),
        replace(known, schema_data=b"float64[99999999999999999999] data"),
        replace(known, schema_data=b"std_msgs/Float64 data\n" + b"=" * 80 + b"\nMSG: std_msgs/Float64\nFloat64 data"),
        replace(known, encoding="protobuf", schema_encoding="protobuf", schema_data=b"\xff" * 30),
        replace(known, encoding="ros1", schema_encoding="ros1msg", schema_data=b"\0"),
    ]
    chosen = variants[int(rng.integers(len(variants)))]
    definitions = ALL_DEFINITIONS.replace(known.records, chosen.records)
    blocks[0] = replace(blocks[0], before=definitions)
    others = tuple(message for message in messages if message.topic != "/force")
    how = replace(draw_ending(rng), definitions=definitions)
    name = f"unknown_encoding {chosen.encoding!r} {chosen.schema_encoding!r} {chosen.schema_data[:20]!r}"
    return Case(name, assemble(blocks, how), Truth(tuple(messages), others))


def cut_protobuf(rng: np.random.Generator) -> Case:
    """Write protobuf messages, some of them truncated in a field; an omitted number is 0, as in proto3."""
    messages, blocks = draw_blocks(rng, everywhere=False)
    schema = records.schema(9, "m.Number", "protobuf", PROTOBUF_SCHEMA)
    definition = schema + records.channel(9, 9, "/count", "protobuf")
    own, after = [], b""
    for k, value in enumerate(rng.integers(1, 2**40, 8).tolist()):
        whole = b"\x09" + struct.pack("<d", 0.5) + b"\x10" + _varint(value)
        cut = k % 3 == 1
        # Cut in the number or in the double: a cut between two fields cannot be detected.
        body = whole[: int(rng.choice([*range(1, 9), *range(10, len(whole))]))] if cut else whole
        after += records.message(9, START + k, body)
        own.append(Message("/count", START + k, body, math.nan if cut else float(value)))
    blocks.append(Block((), definition, after, blocks[0].compression))
    how = replace(draw_ending(rng), summary=False)
    written = (*messages, *own)
    required = tuple(message for message in written if not math.isnan(message.value))
    return Case("cut_protobuf", assemble(blocks, how), Truth(written, required))


def special_numbers(rng: np.random.Generator) -> Case:
    """Write NaN, infinities, -0, subnormals and 2^53 + 1, which must be read."""
    messages, blocks = draw_blocks(rng)
    variants = [
        float("nan"),
        float("inf"),
        float("-inf"),
        -0.0,
        5e-324,
        1.7976931348623157e308,
        float(2**53),
        1e22,
        1e-5,
    ]
    changed = {}
    for message in messages:
        if rng.random() < 0.4:
            value = variants[int(rng.integers(len(variants)))]
            changed[id(message)] = replace(message, value=value, payload=payload(message.topic, message.time, value))
    blocks = _with(blocks, changed)
    written = tuple(changed.get(id(message), message) for message in messages)
    return Case("special_numbers", assemble(blocks, draw_ending(rng)), Truth(written, written, loss=False))


def unusual_times(rng: np.random.Generator) -> Case:
    """Write times that repeat, go backwards, are 0 or 2^64 - 1, which must be read unchanged."""
    messages, blocks = draw_blocks(rng)
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
    changed = {id(m): replace(m, time=choices[which](i)) for i, m in enumerate(messages)}
    blocks = _with(blocks, changed)
    written = tuple(changed[id(message)] for message in messages)
    return Case(f"unusual_times {which}", assemble(blocks, draw_ending(rng)), Truth(written, written, loss=False))


def _changed(
    rng: np.random.Generator, messages: list[Message], blocks: list[Block], changed: dict[int, Message], name: str
) -> Case:
    """Return a case with payloads that cannot be decoded: they have no value, and are reported with their topic."""
    changed = {key: replace(message, value=math.nan) for key, message in changed.items()}
    written = tuple(changed.get(id(message), message) for message in messages)
    required = without(written, changed.values())
    return Case(name, assemble(_with(blocks, changed), draw_ending(rng)), Truth(written, required))


def _with(blocks: list[Block], changed: dict[int, Message]) -> list[Block]:
    return [replace(block, messages=tuple(changed.get(id(m), m) for m in block.messages)) for block in blocks]


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


KINDS = {
    cut_payload: 5,
    garbled_payload: 3,
    other_cdr: 2,
    big_endian_cdr: 1,
    long_payload: 1,
    unknown_encoding: 3,
    cut_protobuf: 1,
    special_numbers: 2,
    unusual_times: 2,
}
