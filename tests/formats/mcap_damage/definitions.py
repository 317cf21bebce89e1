"""Schemas and channels that change, are missing, are very many, or have false lengths of strings and maps."""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from tests.formats.mcap_damage import records
from tests.formats.mcap_damage.assembly import Block, Ending, assemble
from tests.formats.mcap_damage.chunks import draw_blocks, draw_ending
from tests.formats.mcap_damage.messages import ALL_DEFINITIONS, DEFINITIONS, START
from tests.formats.mcap_damage.truth import Case, Message, Truth

_FORCE = DEFINITIONS["/force"]


def redefined_schema(rng: np.random.Generator) -> Case:
    """Redefine the schema of /force at some chunk: with the old schema, messages after it would have wrong values."""
    messages, blocks = draw_blocks(rng, everywhere=False)
    other = records.schema(_FORCE.schema, _FORCE.schema_name, "ros2msg", b"float64 other\nfloat64 data")
    return _redefined(rng, messages, blocks, other, "redefined_schema", _two_numbers)


def redefined_channel(rng: np.random.Generator) -> Case:
    """Redefine the channel of /force at some chunk as another topic."""
    messages, blocks = draw_blocks(rng, everywhere=False)
    other = records.channel(_FORCE.channel, _FORCE.schema, "/other", "cdr")
    return _redefined(rng, messages, blocks, other, "redefined_channel", _other_topic)


def _redefined(
    rng: np.random.Generator,
    messages: list[Message],
    blocks: list[Block],
    other: bytes,
    kind: str,
    change: Callable[[Message], Message],
) -> Case:
    i = int(rng.integers(1, len(blocks)))
    changed = {id(m): change(m) for block in blocks[i:] for m in block.messages if m.topic == "/force"}
    blocks = [replace(block, messages=tuple(changed.get(id(m), m) for m in block.messages)) for block in blocks]
    top_level = bool(rng.random() < 0.3)
    parts: list[Block | bytes] = list(blocks)
    if top_level:
        parts.insert(i, other)
    else:
        parts[i] = replace(blocks[i], before=other)
    # All messages of this channel may be refused; the messages of other channels must be read.
    written = tuple(changed.get(id(message), message) for message in messages)
    required = tuple(message for message in messages if message.topic != "/force")
    return Case(f"{kind} in chunk {i}", assemble(parts, draw_ending(rng)), Truth(written, required, unverified=False))


def _two_numbers(message: Message) -> Message:
    return replace(message, payload=b"\0\1\0\0" + struct.pack("<dd", -7.5, message.value))


def _other_topic(message: Message) -> Message:
    return replace(message, topic="/other")


def repeated_definitions(rng: np.random.Generator) -> Case:
    """Repeat the definitions, in chunks and between them, which is allowed."""
    messages, blocks = draw_blocks(rng, everywhere=True)
    parts: list[Block | bytes] = [*blocks[:3], ALL_DEFINITIONS, *blocks[3:]]
    return Case(
        "repeated_definitions", assemble(parts, draw_ending(rng)), Truth(tuple(messages), tuple(messages), loss=False)
    )


def channel_without_its_schema(rng: np.random.Generator) -> Case:
    """Remove the schema of /force: its messages are lost and counted, all others are read."""
    messages, blocks = draw_blocks(rng, everywhere=False)
    schema = records.schema(_FORCE.schema, _FORCE.schema_name, _FORCE.schema_encoding, _FORCE.schema_data)
    rest = ALL_DEFINITIONS.replace(schema, b"")
    blocks[0] = replace(blocks[0], before=rest)
    required = tuple(message for message in messages if message.topic != "/force")
    how = replace(draw_ending(rng), definitions=rest)
    return Case("channel_without_its_schema", assemble(blocks, how), Truth(tuple(messages), required, loss=True))


def message_of_an_unknown_channel(rng: np.random.Generator) -> Case:
    """Remove the channel of /raw."""
    messages, blocks = draw_blocks(rng, everywhere=False)
    channel = records.channel(DEFINITIONS["/raw"].channel, DEFINITIONS["/raw"].schema, "/raw", "ros1")
    rest = ALL_DEFINITIONS.replace(channel, b"")
    blocks[0] = replace(blocks[0], before=rest)
    required = tuple(message for message in messages if message.topic != "/raw")
    how = replace(draw_ending(rng), definitions=rest)
    truth = Truth(tuple(messages), required, loss=True, skippable=True)
    return Case("message_of_an_unknown_channel", assemble(blocks, how), truth)


def definitions_in_the_last_chunk(rng: np.random.Generator) -> Case:
    """Write the definitions after the messages: only a summary has them before."""
    messages, blocks = draw_blocks(rng, everywhere=False)
    blocks[0] = replace(blocks[0], before=b"")
    blocks[-1] = replace(blocks[-1], after=ALL_DEFINITIONS)
    how = draw_ending(rng)
    required = tuple(messages) if how.summary and how.crc else ()
    return Case(
        "definitions_in_the_last_chunk", assemble(blocks, how), Truth(tuple(messages), required, refusable=not required)
    )


def schema_of_id_0(rng: np.random.Generator) -> Case:
    """Insert a schema with the id 0, which is invalid and ignored; channels with the schema id 0 have no schema."""
    messages, blocks = draw_blocks(rng)
    variants = records.schema(0, "nobody/Knows", "ros2msg", b"float32 x") + records.schema(0, "other", "json", b"")
    blocks[0] = replace(blocks[0], before=variants + blocks[0].before)
    return Case(
        "schema_of_id_0", assemble(blocks, draw_ending(rng)), Truth(tuple(messages), tuple(messages), loss=False)
    )


def two_channels_of_a_topic(rng: np.random.Generator) -> Case:
    """Insert a second channel of a topic with another layout: each channel is read with its own layout."""
    messages, blocks = draw_blocks(rng, everywhere=False)
    schema = records.schema(9, "std_msgs/msg/Two", "ros2msg", b"float64 other\nfloat64 data")
    extra = schema + records.channel(9, 9, "/force", "cdr")
    own: list[Message] = []
    records_of_own = b""
    for k, value in enumerate(rng.normal(size=5).tolist()):
        message = _two_numbers(Message("/force", START + 10**9 + k, b"", value))
        own.append(message)
        records_of_own += records.message(9, message.time, message.payload)
    blocks.append(Block((), extra, records_of_own, blocks[0].compression))
    written = (*messages, *own)
    how = replace(draw_ending(rng), summary=False)
    return Case("two_channels_of_a_topic", assemble(blocks, how), Truth(written, written, loss=False))


def many_schemas(rng: np.random.Generator) -> Case:
    """Define 65,535 schemas, the largest possible number, and repeat some of them."""
    messages, blocks = draw_blocks(rng, "zstd", everywhere=False)
    extra = b"".join(records.schema(i, f"a/msg/M{i}", "ros2msg", b"float64 x") for i in range(5, 65536))
    blocks[0] = replace(blocks[0], before=extra + blocks[0].before)
    return Case("many_schemas", assemble(blocks, draw_ending(rng)), Truth(tuple(messages), tuple(messages), loss=False))


def many_channels(rng: np.random.Generator) -> Case:
    """Define twenty thousand channels without a message."""
    messages, blocks = draw_blocks(rng, "lz4", everywhere=False)
    extra = b"".join(records.channel(i, 0, f"/t{i}", "json") for i in range(10, 20_000))
    blocks[0] = replace(blocks[0], after=extra)
    return Case(
        "many_channels", assemble(blocks, draw_ending(rng)), Truth(tuple(messages), tuple(messages), loss=False)
    )


def unusual_topic(rng: np.random.Generator) -> Case:
    """Define a channel whose topic is very long, empty, not UTF-8, or contains control sequences of a terminal."""
    topics = [b"/" + b"long" * 100_000, b"", b"\xff\xfe", b"a\nb\nc", b"\x1b[31mred", b"/a b", b"\0", "/µ°€".encode()]
    messages, blocks = draw_blocks(rng)
    topic = topics[int(rng.integers(len(topics)))]
    extra = records.channel(9, 0, topic, "json") + records.message(9, START, b'{"x": 1}')
    blocks[2] = replace(blocks[2], after=extra)
    how = replace(draw_ending(rng), summary=False)
    optional = Message(topic.decode("utf-8", "replace"), START, b'{"x": 1}', 1.0)
    truth = Truth(tuple(messages), tuple(messages), optional=(optional,))
    return Case(f"unusual_topic {topic[:12]!r}", assemble(blocks, how), truth)


def oversized_definition(rng: np.random.Generator) -> Case:
    """Define a schema or channel with a string or map longer than its record, in a chunk with a valid CRC."""
    messages, blocks = draw_blocks(rng, everywhere=True)
    claims = [2**32 - 1, 2**31, 1000, 12]
    claim = claims[int(rng.integers(len(claims)))]
    bodies = [
        (records.SCHEMA, struct.pack("<H", 77) + records.text("name", claim)),
        (records.SCHEMA, struct.pack("<H", 77) + records.text("name") + records.text("ros2msg", claim)),
        (records.SCHEMA, struct.pack("<H", 77) + records.text("n") + records.text("e") + records.text(b"d", claim)),
        (records.SCHEMA, b"\1"),
        (records.SCHEMA, b""),
        (records.CHANNEL, struct.pack("<HH", 77, 0) + records.text("topic", claim)),
        (records.CHANNEL, struct.pack("<HH", 77, 0) + records.text("t") + records.text("json", claim)),
        (records.CHANNEL, struct.pack("<HH", 77, 0) + records.text("t") + records.text("json") + b"\0"),
        (
            records.CHANNEL,
            struct.pack("<HH", 77, 0) + records.text("t") + records.text("json") + records.texts({"a": "b"}, claim),
        ),
        (
            records.CHANNEL,
            struct.pack("<HH", 77, 0)
            + records.text("t")
            + records.text("json")
            + struct.pack("<I", 9)
            + records.text("a", claim)
            + b"abcd",
        ),
        (records.CHANNEL, b""),
    ]
    opcode, body = bodies[int(rng.integers(len(bodies)))]
    i = int(rng.integers(len(blocks)))
    blocks[i] = replace(blocks[i], before=blocks[i].before + records.record(opcode, body))
    truth = Truth(tuple(messages), tuple(messages))
    return Case(f"oversized_definition {opcode} {claim}", assemble(blocks, draw_ending(rng)), truth)


def different_definition_in_the_summary(rng: np.random.Generator) -> Case:
    """Give /force another layout in a summary with a valid CRC: it is refused, or read with the layout of the data."""
    messages, blocks = draw_blocks(rng, everywhere=bool(rng.integers(2)))
    swapped = ALL_DEFINITIONS.replace(b"float64 data", b"float32 data", 1)
    how = Ending(definitions=swapped, crc=bool(rng.random() < 0.7))
    required = tuple(message for message in messages if message.topic != "/force")
    return Case("different_definition_in_the_summary", assemble(blocks, how), Truth(tuple(messages), required))


KINDS = {
    redefined_schema: 3,
    redefined_channel: 3,
    repeated_definitions: 1,
    channel_without_its_schema: 1,
    message_of_an_unknown_channel: 1,
    definitions_in_the_last_chunk: 1,
    schema_of_id_0: 1,
    two_channels_of_a_topic: 1,
    many_schemas: 0.1,
    many_channels: 0.1,
    unusual_topic: 2,
    oversized_definition: 4,
    different_definition_in_the_summary: 2,
}
