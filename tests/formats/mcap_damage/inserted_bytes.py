"""Files with inserted bytes: garbage, unknown records and other files between, before or after the records."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tests.formats.mcap_damage import records
from tests.formats.mcap_damage.assembly import Block, Ending, assemble, blocks_of
from tests.formats.mcap_damage.draft import COMPRESSIONS, Draft, draw_ending, pick, share
from tests.formats.mcap_damage.messages import ALL_DEFINITIONS, ordinary
from tests.formats.mcap_damage.truth import Case, Message, Truth


@share(5)
def garbage_between_chunks(rng: np.random.Generator) -> Case:
    """Insert random bytes between two chunks: every chunk can still be read."""
    draft = Draft(rng, everywhere=True)
    # Whether the bytes are a loss for certain: they may be an unknown record that ends where the next one starts.
    junk: list[tuple[bytes, bool]] = [
        (rng.bytes(int(rng.integers(1, 400))), False),
        (bytes(int(rng.integers(1, 400))), True),
        (b"\xff" * int(rng.integers(1, 400)), True),
        (records.record(0, b"abc"), True),
        (bytes([records.CHUNK]) * 50, False),
        (records.record(records.CHUNK, b""), False),
        (records.record(records.MESSAGE, b"", 2**63), True),
        (records.record(records.METADATA, b"", 5_000), False),
        (records.record(0x90, b"", 2**64 - 1), True),
        (records.record(records.CHUNK, b"", 2**64 - 1), True),
        (records.record(records.CHUNK, rng.bytes(39)), False),
        (records.MAGIC, True),
    ]
    kind = int(rng.integers(len(junk)))
    content, is_loss = junk[kind]
    parts: list[Block | bytes] = list(draft.blocks)
    parts.insert(int(rng.integers(1, len(parts) + 1)), content)
    return draft.case(f"garbage_between_chunks {kind}", parts, loss=is_loss or None)


@share(2)
def unknown_records(rng: np.random.Generator) -> Case:
    """Insert records of future or private kinds, between chunks and in them: they are skipped."""
    draft = Draft(rng, everywhere=bool(rng.integers(2)))

    def unknown() -> bytes:
        return records.record(draft.pick([0x10, 0x20, 0x7F, 0x80, 0xC3, 0xFF]), rng.bytes(int(rng.integers(0, 60))))

    parts: list[Block | bytes] = []
    for block in draft.blocks:
        if rng.random() < 0.5:
            parts.append(unknown() + (unknown() if rng.random() < 0.3 else b""))
        parts.append(replace(block, after=unknown() if rng.random() < 0.5 else b""))
    return draft.case("unknown_records", parts, loss=False)


@share(1)
def extended_records(rng: np.random.Generator) -> Case:
    """Append fields to records, as a later version of the format may do: the known fields are read."""
    draft = Draft(rng)
    more = rng.bytes(int(rng.integers(1, 40)))
    definitions = b"".join(records.record(opcode, body + more) for opcode, body in _split(ALL_DEFINITIONS))
    draft.blocks = [replace(block, before=definitions if block.before else b"") for block in draft.blocks]
    extended = records.record(records.METADATA, records.text("a") + records.texts({"b": "c"}) + more)
    draft.ending = replace(draft.ending, definitions=definitions)
    return draft.case("extended_records", [draft.blocks[0], extended, *draft.blocks[1:]], loss=False)


def _split(data: bytes) -> list[tuple[int, bytes]]:
    parts, at = [], 0
    while at < len(data):
        length = int.from_bytes(data[at + 1 : at + 9], "little")
        parts.append((data[at], data[at + 9 : at + 9 + length]))
        at += 9 + length
    return parts


@share(1)
def bare_messages(rng: np.random.Generator) -> Case:
    """Insert messages outside of chunks: they are read, and reported as unverified."""
    draft = Draft(rng, everywhere=True)
    parts: list[Block | bytes] = list(draft.blocks)
    i = int(rng.integers(1, len(parts)))
    parts[i] = draft.blocks[i].content
    # The summary may not count them; then its count differs from the number that is read.
    return draft.case("bare_messages", parts, unverified=not draft.ending.data_crc)


@share(1)
def trailing_garbage(rng: np.random.Generator) -> Case:
    """Append bytes after the end of the file."""
    draft = Draft(rng)
    junk = [rng.bytes(int(rng.integers(1, 300))), bytes(int(rng.integers(1, 5000))), records.MAGIC, b"\n"]
    whole = draft.case("trailing_garbage")
    return replace(whole, data=whole.data + draft.pick(junk))


@share(1)
def no_last_magic(rng: np.random.Generator) -> Case:
    """Remove or change the magic bytes at the end."""
    draft = Draft(rng)
    whole = draft.case("no_last_magic", loss=True)
    return replace(whole, data=whole.data[:-8] + draft.pick((b"", b"\x89MCAP1\r\n", bytes(8))))


@share(2)
def two_files(rng: np.random.Generator) -> Case:
    """Join two files whose channel ids have different topics: the first file, or both, are read."""
    first = ordinary(rng, 32)
    second = [Message("/count", m.time, m.payload, m.value) for m in ordinary(rng, 32) if m.topic == "/force"]
    compression = pick(rng, COMPRESSIONS)
    other = records.schema(1, "other/msg/Float64", "ros2msg", b"float64 count")
    other += records.channel(1, 1, "/count", "cdr")
    data = assemble(blocks_of(first, 8, compression), draw_ending(rng))
    data += assemble([Block(tuple(second), other, compression=compression)], Ending(definitions=other))
    return Case("two_files", data, Truth((*first, *second), tuple(first)))


@share(2)
def no_content(rng: np.random.Generator) -> Case:
    """Return a file without messages: empty, only magic bytes, only a header, without messages, or another format."""
    magic, header = records.MAGIC, records.header()
    files = [
        *(b"", magic[:5], magic, magic * 2, magic + header, magic + header + magic, magic + header + ALL_DEFINITIONS),
        *(bytes(1000), rng.bytes(1000), magic + rng.bytes(1000), magic + header + b"\x06" + rng.bytes(1000)),
        *(b"time,force\n0,1\n", b"\x89MCAP1\r\n" + header, b"#ROSBAG V2.0\n" + rng.bytes(100)),
        magic + records.record(records.CHUNK, b"", 2**64 - 10),
        magic + records.record(records.SCHEMA, b"", 2**40) + b"abc",
    ]
    i = int(rng.integers(len(files)))
    return Case(f"no_content {i}", files[i], Truth((), loss=True, refusable=True))


@share(1)
def no_message(rng: np.random.Generator) -> Case:
    """Return a complete file without a message, which is not a loss."""
    parts: list[Block | bytes] = [] if rng.random() < 0.5 else [Block((), ALL_DEFINITIONS)]
    return Case("no_message", assemble(parts, draw_ending(rng)), Truth((), loss=False))


@share(2)
def attachments(rng: np.random.Generator) -> Case:
    """Insert an attachment, perhaps with a wrong CRC or a false length of its name: no message is lost."""
    draft = Draft(rng)
    # What is inserted, and whether it is correct.
    variants = [
        (records.attachment("a.txt", b"abc"), True),
        (records.attachment("a.txt", b"abc", crc=5), False),
        (records.attachment("a.txt", b"abc", crc=0), True),
        (records.record(records.ATTACHMENT, b"\0" * 16 + records.text("a", 2**32 - 1)), False),
        (records.record(records.ATTACHMENT, b""), False),
        (records.record(records.METADATA, records.text("a") + records.texts({"b": "c"}, 2**31)), False),
        (records.record(records.METADATA, b"\xff"), False),
        (records.metadata("m", {"k": "v" * 1000}), True),
    ]
    i = int(rng.integers(len(variants)))
    content, is_correct = variants[i]
    parts: list[Block | bytes] = list(draft.blocks)
    parts.insert(int(rng.integers(len(parts) + 1)), content)
    return draft.case(f"attachments {i}", parts, loss=False if is_correct else None)
