"""Files with inserted bytes: garbage, unknown records and other files between, before or after the records."""

from __future__ import annotations

import numpy as np

from tests.formats.mcap_damage import records
from tests.formats.mcap_damage.assembly import Block, Ending, assemble, blocks_of
from tests.formats.mcap_damage.chunks import COMPRESSIONS, draw_blocks, draw_ending
from tests.formats.mcap_damage.messages import ALL_DEFINITIONS, ordinary
from tests.formats.mcap_damage.truth import Case, Message, Truth


def garbage_between_chunks(rng: np.random.Generator) -> Case:
    """Insert random bytes between two chunks: every chunk can still be read."""
    messages, blocks = draw_blocks(rng, everywhere=True)
    junk = [
        rng.bytes(int(rng.integers(1, 400))),
        bytes(int(rng.integers(1, 400))),
        b"\xff" * int(rng.integers(1, 400)),
        records.record(0, b"abc"),
        bytes([records.CHUNK]) * 50,
        records.record(records.CHUNK, b""),
        records.record(records.MESSAGE, b"", 2**63),
        records.record(records.METADATA, b"", 5_000),
        records.record(0x90, b"", 2**64 - 1),
        records.record(records.CHUNK, b"", 2**64 - 1),
        records.record(records.CHUNK, rng.bytes(39)),
        records.MAGIC,
    ]
    junk_kind = int(rng.integers(len(junk)))
    parts: list[Block | bytes] = list(blocks)
    parts.insert(int(rng.integers(1, len(parts) + 1)), junk[junk_kind])
    # The bytes may be an unknown record that ends where the next record starts, which is not a loss.
    truth = Truth(tuple(messages), tuple(messages), loss=True if junk_kind in (1, 2, 3, 6, 8, 9, 11) else None)
    return Case(f"garbage_between_chunks {junk_kind}", assemble(parts, draw_ending(rng)), truth)


def unknown_records(rng: np.random.Generator) -> Case:
    """Insert records of future or private kinds, between chunks and in them: they are skipped."""
    messages, blocks = draw_blocks(rng, everywhere=bool(rng.integers(2)))
    kinds = [0x10, 0x20, 0x7F, 0x80, 0xC3, 0xFF]

    def unknown() -> bytes:
        return records.record(kinds[int(rng.integers(len(kinds)))], rng.bytes(int(rng.integers(0, 60))))

    parts: list[Block | bytes] = []
    for block in blocks:
        if rng.random() < 0.5:
            parts.append(unknown() + (unknown() if rng.random() < 0.3 else b""))
        after = unknown() if rng.random() < 0.5 else b""
        parts.append(Block(block.messages, block.before, after, block.compression))
    truth = Truth(tuple(messages), tuple(messages), loss=False)
    return Case("unknown_records", assemble(parts, draw_ending(rng)), truth)


def extended_records(rng: np.random.Generator) -> Case:
    """Append fields to records, as a later version of the format may do: the known fields are read."""
    messages, blocks = draw_blocks(rng)
    more = rng.bytes(int(rng.integers(1, 40)))
    definitions = b""
    for opcode, body in _split(ALL_DEFINITIONS):
        definitions += records.record(opcode, body + more)
    parts: list[Block | bytes] = [
        Block(block.messages, definitions if block.before else b"", b"", block.compression) for block in blocks
    ]
    parts.insert(1, records.record(records.METADATA, records.text("a") + records.texts({"b": "c"}) + more))
    how = draw_ending(rng)
    how = Ending(how.summary, how.crc, how.data_crc, definitions)
    return Case("extended_records", assemble(parts, how), Truth(tuple(messages), tuple(messages), loss=False))


def bare_messages(rng: np.random.Generator) -> Case:
    """Insert messages outside of chunks: they are read, and reported as unverified."""
    messages, blocks = draw_blocks(rng, everywhere=True)
    parts: list[Block | bytes] = list(blocks)
    i = int(rng.integers(1, len(blocks)))
    parts[i] = blocks[i].content
    how = draw_ending(rng)
    # The summary may not count them; then its count differs from the number that is read.
    truth = Truth(tuple(messages), tuple(messages), unverified=not how.data_crc)
    return Case("bare_messages", assemble(parts, how), truth)


def trailing_garbage(rng: np.random.Generator) -> Case:
    """Append bytes after the end of the file."""
    messages, blocks = draw_blocks(rng)
    junk = [rng.bytes(int(rng.integers(1, 300))), bytes(int(rng.integers(1, 5000))), records.MAGIC, b"\n"]
    data = assemble(blocks, draw_ending(rng)) + junk[int(rng.integers(len(junk)))]
    return Case("trailing_garbage", data, Truth(tuple(messages), tuple(messages)))


def no_last_magic(rng: np.random.Generator) -> Case:
    """Remove or change the magic bytes at the end."""
    messages, blocks = draw_blocks(rng)
    data = assemble(blocks, draw_ending(rng))[:-8] + (b"", b"\x89MCAP1\r\n", bytes(8))[int(rng.integers(3))]
    return Case("no_last_magic", data, Truth(tuple(messages), tuple(messages), loss=True))


def two_files(rng: np.random.Generator) -> Case:
    """Join two files whose channel ids have different topics: the first file, or both, are read."""
    first = ordinary(rng, 32)
    second = [Message("/count", m.time, m.payload, m.value) for m in ordinary(rng, 32) if m.topic == "/force"]
    compression = COMPRESSIONS[int(rng.integers(3))]
    other = records.schema(1, "other/msg/Float64", "ros2msg", b"float64 count")
    other += records.channel(1, 1, "/count", "cdr")
    block = Block(tuple(second), other, compression=compression)
    data = assemble(blocks_of(first, 8, compression), draw_ending(rng))
    data += assemble([block], Ending(definitions=other))
    truth = Truth((*first, *second), tuple(first))
    return Case("two_files", data, truth)


def no_content(rng: np.random.Generator) -> Case:
    """Return a file without messages: empty, only magic bytes, only a header, without messages, or another format."""
    files = [
        b"",
        records.MAGIC[:5],
        records.MAGIC,
        records.MAGIC * 2,
        records.MAGIC + records.header(),
        records.MAGIC + records.header() + records.MAGIC,
        records.MAGIC + records.header() + ALL_DEFINITIONS,
        bytes(1000),
        rng.bytes(1000),
        records.MAGIC + rng.bytes(1000),
        records.MAGIC + records.header() + b"\x06" + rng.bytes(1000),
        b"time,force\n0,1\n",
        b"\x89MCAP1\r\n" + records.header(),
        b"#ROSBAG V2.0\n" + rng.bytes(100),
        records.MAGIC + records.record(records.CHUNK, b"", 2**64 - 10),
        records.MAGIC + records.record(records.SCHEMA, b"", 2**40) + b"abc",
    ]
    i = int(rng.integers(len(files)))
    return Case(f"no_content {i}", files[i], Truth((), loss=True, refusable=True))


def no_message(rng: np.random.Generator) -> Case:
    """Return a complete file without a message, which is not a loss."""
    parts: list[Block | bytes] = [] if rng.random() < 0.5 else [Block((), ALL_DEFINITIONS)]
    return Case("no_message", assemble(parts, draw_ending(rng)), Truth((), loss=False))


def attachments(rng: np.random.Generator) -> Case:
    """Insert an attachment, perhaps with a wrong CRC or a false length of its name: no message is lost."""
    messages, blocks = draw_blocks(rng)
    variants = [
        records.attachment("a.txt", b"abc"),
        records.attachment("a.txt", b"abc", crc=5),
        records.attachment("a.txt", b"abc", crc=0),
        records.record(records.ATTACHMENT, b"\0" * 16 + records.text("a", 2**32 - 1)),
        records.record(records.ATTACHMENT, b""),
        records.record(records.METADATA, records.text("a") + records.texts({"b": "c"}, 2**31)),
        records.record(records.METADATA, b"\xff"),
        records.metadata("m", {"k": "v" * 1000}),
    ]
    i = int(rng.integers(len(variants)))
    parts: list[Block | bytes] = list(blocks)
    parts.insert(int(rng.integers(len(parts) + 1)), variants[i])
    loss = False if i in (0, 2, 7) else None
    truth = Truth(tuple(messages), tuple(messages), loss=loss)
    return Case(f"attachments {i}", assemble(parts, draw_ending(rng)), truth)


def _split(data: bytes) -> list[tuple[int, bytes]]:
    parts, at = [], 0
    while at < len(data):
        length = int.from_bytes(data[at + 1 : at + 9], "little")
        parts.append((data[at], data[at + 9 : at + 9 + length]))
        at += 9 + length
    return parts


KINDS = {
    garbage_between_chunks: 5,
    unknown_records: 2,
    extended_records: 1,
    bare_messages: 1,
    trailing_garbage: 1,
    no_last_magic: 1,
    two_files: 2,
    no_content: 2,
    no_message: 1,
    attachments: 2,
}
