"""Schemas and channels that change, are missing, are very many, or have false lengths of strings and maps."""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from tests.formats.mcap_damage import records
from tests.formats.mcap_damage.assembly import Block, Ending
from tests.formats.mcap_damage.draft import Draft, share
from tests.formats.mcap_damage.messages import ALL_DEFINITIONS, DEFINITIONS, START
from tests.formats.mcap_damage.truth import Case, Message

_FORCE = DEFINITIONS["/force"]


@share(3)
def redefined_schema(rng: np.random.Generator) -> Case:
    """Redefine the schema of /force at some chunk: with the old schema, messages after it would have wrong values."""
    draft = Draft(rng, everywhere=False)
    other = records.schema(_FORCE.schema, _FORCE.schema_name, "ros2msg", b"float64 other\nfloat64 data")
    return _redefined(draft, other, "redefined_schema", _two_numbers)


@share(3)
def redefined_channel(rng: np.random.Generator) -> Case:
    """Redefine the channel of /force at some chunk as another topic."""
    draft = Draft(rng, everywhere=False)
    other = records.channel(_FORCE.channel, _FORCE.schema, "/other", "cdr")
    return _redefined(draft, other, "redefined_channel", lambda message: replace(message, topic="/other"))


def _redefined(draft: Draft, other: bytes, kind: str, change: Callable[[Message], Message]) -> Case:
    i = int(draft.rng.integers(1, len(draft.blocks)))
    changed = {id(m): change(m) for block in draft.blocks[i:] for m in block.messages if m.topic == "/force"}
    draft.change(changed)
    parts: list[Block | bytes] = list(draft.blocks)
    if draft.rng.random() < 0.3:  # on the top level
        parts.insert(i, other)
    else:
        parts[i] = replace(draft.blocks[i], before=other)
    # All messages of this channel may be refused; the messages of other channels must be read.
    return draft.case(f"{kind} in chunk {i}", parts, required=draft.other_than("/force", "/other"))


def _two_numbers(message: Message) -> Message:
    return replace(message, payload=b"\0\1\0\0" + struct.pack("<dd", -7.5, message.value))


@share(1)
def repeated_definitions(rng: np.random.Generator) -> Case:
    """Repeat the definitions, in chunks and between them, which is allowed."""
    draft = Draft(rng, everywhere=True)
    return draft.case("repeated_definitions", [*draft.blocks[:3], ALL_DEFINITIONS, *draft.blocks[3:]], loss=False)


@share(1)
def channel_without_its_schema(rng: np.random.Generator) -> Case:
    """Remove the schema of /force: its messages are lost and counted, all others are read."""
    draft = Draft(rng, everywhere=False)
    schema = records.schema(_FORCE.schema, _FORCE.schema_name, _FORCE.schema_encoding, _FORCE.schema_data)
    draft.define(ALL_DEFINITIONS.replace(schema, b""))
    return draft.case("channel_without_its_schema", required=draft.other_than("/force"), loss=True)


@share(1)
def message_of_an_unknown_channel(rng: np.random.Generator) -> Case:
    """Remove the channel of /raw."""
    draft = Draft(rng, everywhere=False)
    channel = records.channel(DEFINITIONS["/raw"].channel, DEFINITIONS["/raw"].schema, "/raw", "ros1")
    draft.define(ALL_DEFINITIONS.replace(channel, b""))
    name = "message_of_an_unknown_channel"
    return draft.case(name, required=draft.other_than("/raw"), loss=True, skippable=True)


@share(1)
def definitions_in_the_last_chunk(rng: np.random.Generator) -> Case:
    """Write the definitions after the messages: only a summary has them before."""
    draft = Draft(rng, everywhere=False)
    draft.blocks[0] = replace(draft.blocks[0], before=b"")
    draft.blocks[-1] = replace(draft.blocks[-1], after=ALL_DEFINITIONS)
    required = draft.messages if draft.ending.summary and draft.ending.crc else []
    return draft.case("definitions_in_the_last_chunk", required=required, refusable=not required)


@share(1)
def schema_of_id_0(rng: np.random.Generator) -> Case:
    """Insert a schema with the id 0, which is invalid and ignored; channels with the schema id 0 have no schema."""
    draft = Draft(rng)
    variants = records.schema(0, "nobody/Knows", "ros2msg", b"float32 x") + records.schema(0, "other", "json", b"")
    draft.blocks[0] = replace(draft.blocks[0], before=variants + draft.blocks[0].before)
    return draft.case("schema_of_id_0", loss=False)


@share(1)
def two_channels_of_a_topic(rng: np.random.Generator) -> Case:
    """Insert a second channel of a topic with another layout: each channel is read with its own layout."""
    draft = Draft(rng, everywhere=False)
    schema = records.schema(9, "std_msgs/msg/Two", "ros2msg", b"float64 other\nfloat64 data")
    values = enumerate(rng.normal(size=5).tolist())
    own = [_two_numbers(Message("/force", START + 10**9 + k, b"", value)) for k, value in values]
    after = b"".join(records.message(9, message.time, message.payload) for message in own)
    before = schema + records.channel(9, 9, "/force", "cdr")
    draft.blocks.append(Block((), before, after, draft.blocks[0].compression))
    draft.ending = replace(draft.ending, summary=False)
    return draft.case("two_channels_of_a_topic", written=(*draft.messages, *own), loss=False)


@share(0.1)
def many_schemas(rng: np.random.Generator) -> Case:
    """Define 65,535 schemas, the largest possible number, and repeat some of them."""
    draft = Draft(rng, "zstd", everywhere=False)
    extra = b"".join(records.schema(i, f"a/msg/M{i}", "ros2msg", b"float64 x") for i in range(5, 65536))
    draft.blocks[0] = replace(draft.blocks[0], before=extra + draft.blocks[0].before)
    return draft.case("many_schemas", loss=False)


@share(0.1)
def many_channels(rng: np.random.Generator) -> Case:
    """Define twenty thousand channels without a message."""
    draft = Draft(rng, "lz4", everywhere=False)
    extra = b"".join(records.channel(i, 0, f"/t{i}", "json") for i in range(10, 20_000))
    draft.blocks[0] = replace(draft.blocks[0], after=extra)
    return draft.case("many_channels", loss=False)


@share(2)
def unusual_topic(rng: np.random.Generator) -> Case:
    """Define a channel whose topic is very long, empty, not UTF-8, or contains control sequences of a terminal."""
    topics = [b"/" + b"long" * 100_000, b"", b"\xff\xfe", b"a\nb\nc", b"\x1b[31mred", b"/a b", b"\0", "/µ°€".encode()]
    draft = Draft(rng)
    topic = draft.pick(topics)
    extra = records.channel(9, 0, topic, "json") + records.message(9, START, b'{"x": 1}')
    draft.blocks[2] = replace(draft.blocks[2], after=extra)
    draft.ending = replace(draft.ending, summary=False)
    optional = Message(topic.decode("utf-8", "replace"), START, b'{"x": 1}', 1.0)
    return draft.case(f"unusual_topic {topic[:12]!r}", optional=(optional,))


@share(4)
def oversized_definition(rng: np.random.Generator) -> Case:
    """Define a schema or channel with a string or map longer than its record, in a chunk with a valid CRC."""
    draft = Draft(rng, everywhere=True)
    claim = draft.pick([2**32 - 1, 2**31, 1000, 12])
    text, head, ids = records.text, struct.pack("<H", 77), struct.pack("<HH", 77, 0)
    json = ids + text("t") + text("json")
    schemas = [
        head + text("name", claim),
        head + text("name") + text("ros2msg", claim),
        head + text("n") + text("e") + text(b"d", claim),
        b"\1",
        b"",
    ]
    channels = [
        ids + text("topic", claim),
        ids + text("t") + text("json", claim),
        json + b"\0",
        json + records.texts({"a": "b"}, claim),
        json + struct.pack("<I", 9) + text("a", claim) + b"abcd",
        b"",
    ]
    bodies = [*((records.SCHEMA, body) for body in schemas), *((records.CHANNEL, body) for body in channels)]
    opcode, body = draft.pick(bodies)
    i = draft.place()
    draft.blocks[i] = replace(draft.blocks[i], before=draft.blocks[i].before + records.record(opcode, body))
    return draft.case(f"oversized_definition {opcode} {claim}")


@share(2)
def different_definition_in_the_summary(rng: np.random.Generator) -> Case:
    """Give /force another layout in a summary with a valid CRC: it is refused, or read with the layout of the data."""
    draft = Draft(rng, everywhere=bool(rng.integers(2)))
    swapped = ALL_DEFINITIONS.replace(b"float64 data", b"float32 data", 1)
    draft.ending = Ending(definitions=swapped, crc=bool(rng.random() < 0.7))
    return draft.case("different_definition_in_the_summary", required=draft.other_than("/force"))
