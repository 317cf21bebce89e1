"""Chunks in another order, repeated, missing, or with false sizes, times, CRC or compression in their headers."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations
from typing import Any

import lz4.frame
import numpy as np
import zstandard

from tests.formats.mcap_damage import records
from tests.formats.mcap_damage.assembly import Block, Ending, assemble, blocks_of, with_false_header
from tests.formats.mcap_damage.messages import ordinary, record_of
from tests.formats.mcap_damage.truth import Case, Message, Truth, without

COMPRESSIONS = ("", "lz4", "zstd")


def draw_blocks(
    rng: np.random.Generator, compression: str | None = None, everywhere: bool | None = None
) -> tuple[list[Message], list[Block]]:
    """Return messages and eight chunks of them; the definitions are in the first chunk, or in every chunk."""
    compression = COMPRESSIONS[int(rng.integers(3))] if compression is None else compression
    everywhere = bool(rng.random() < 0.5) if everywhere is None else everywhere
    messages = ordinary(rng, 64)
    return messages, blocks_of(messages, 8, compression, everywhere)


def draw_ending(rng: np.random.Generator) -> Ending:
    """Return an ending, usually with a summary; sometimes without the summary's CRC, or with a CRC of the data."""
    without_any, without_crc, data_crc = rng.random(3) < (0.25, 0.2, 0.2)
    return Ending(not without_any, not without_crc, bool(data_crc))


def swapped_chunks(rng: np.random.Generator) -> Case:
    """Exchange two chunks: nothing is lost."""
    messages, blocks = draw_blocks(rng, everywhere=True)
    i, k = rng.choice(len(blocks), 2, replace=False).tolist()
    blocks[i], blocks[k] = blocks[k], blocks[i]
    truth = Truth(tuple(messages), tuple(messages), loss=False)
    return Case(f"swapped_chunks {i} and {k}", assemble(blocks, draw_ending(rng)), truth)


def swapped_without_the_index(rng: np.random.Generator) -> Case:
    """Exchange two chunks of equal length, without changing the index."""
    messages, blocks = draw_blocks(rng, "", everywhere=True)
    parts = {block.messages: records.chunk(block.content, block.times) for block in blocks}
    one, two = next((a, b) for a, b in combinations(parts.values(), 2) if len(a) == len(b))
    marked = assemble(blocks, Ending()).replace(one, b"\xfe" * len(one))
    data = marked.replace(two, one).replace(b"\xfe" * len(one), two)
    return Case("swapped_without_the_index", data, Truth(tuple(messages), tuple(messages)))


def repeated_chunk(rng: np.random.Generator) -> Case:
    """Repeat a chunk: its messages must be read once, and may be read twice."""
    messages, blocks = draw_blocks(rng)
    i, k = int(rng.integers(len(blocks))), int(rng.integers(len(blocks)))
    twice = blocks[i]
    blocks.insert(max(i, k) + 1, twice)
    truth = Truth(tuple(messages), tuple(messages), optional=twice.messages)
    return Case(f"repeated_chunk {i}", assemble(blocks, draw_ending(rng)), truth)


def chunk_copied_over_another(rng: np.random.Generator) -> Case:
    """Insert a copy of a chunk that is not in the index."""
    messages, blocks = draw_blocks(rng)
    i, k = int(rng.integers(len(blocks))), int(rng.integers(len(blocks)))
    block = blocks[i]
    parts: list[Block | bytes] = list(blocks)
    parts.insert(max(i, k) + 1, records.chunk(block.content, block.times, block.compression))
    truth = Truth(tuple(messages), tuple(messages), optional=block.messages)
    return Case(f"chunk_copied_over_another {i}", assemble(parts, draw_ending(rng)), truth)


def missing_chunk(rng: np.random.Generator) -> Case:
    """Remove a chunk: all positions after it in the summary are wrong."""
    messages, blocks = draw_blocks(rng, everywhere=True)
    how = draw_ending(rng)
    i = int(rng.integers(len(blocks)))
    block = blocks[i]
    data = assemble(blocks, how)
    chunk = records.chunk(block.content, block.times, block.compression)
    rest = without(messages, block.messages)
    truth = Truth(tuple(messages), rest, undetectable=not (how.summary or how.data_crc), loss=None)
    return Case(f"missing_chunk {i}", data.replace(chunk, b"", 1), truth)


def false_chunk_header(rng: np.random.Generator) -> Case:
    """Set a false field in a chunk's header: all other chunks, which have their own definitions, must be read."""
    messages, blocks = draw_blocks(rng, everywhere=True)
    i = int(rng.integers(len(blocks)))
    block = blocks[i]
    size, data = len(block.content), records.packed(block.compression, block.content)
    false_fields: list[dict[str, Any]] = [
        {"size": size - 1},
        {"size": size + 1},
        {"size": 0},
        {"size": 2 * size},
        {"size": 2**31},
        {"size": 2**32 + size},
        {"size": 2**63},
        {"size": 2**64 - 1},
        {"data_size": len(data) + 1},
        {"data_size": len(data) - 1},
        {"data_size": 0},
        {"data_size": 2**63},
        {"data_size": 2**64 - 1},
        {"crc": 1},
        {"named": "zst"},
        {"named": "ZSTD"},
        {"named": "bz2"},
        {"named": "none"},
        {"named": "gzip\0"},
        {"named": b"\xff\xfe\xfd"},
        {"named": b"z" * 70},
        {"named": b"x" * 5000},
        {"data": b""},
        {"data": b"\x28\xb5\x2f\xfd"},
        {"data": data[: len(data) // 2]},
        {"data": bytes(len(data))},
        {"data": rng.bytes(len(data))},
    ]
    false_field = false_fields[int(rng.integers(len(false_fields)))]
    blocks[i] = with_false_header(block, **false_field)
    key, value = next(iter(false_field.items()))
    shown = value if isinstance(value, int) else value[:8]
    truth = Truth(tuple(messages), without(messages, block.messages))
    return Case(
        f"false_chunk_header {i} {block.compression or 'none'} {key} {shown!r}",
        assemble(blocks, draw_ending(rng)),
        truth,
    )


def false_chunk_times(rng: np.random.Generator) -> Case:
    """Set false times in a chunk's header: the times of the messages must be read."""
    messages, blocks = draw_blocks(rng)
    i = int(rng.integers(len(blocks)))
    times = [(0, 0), (2**64 - 1, 0), (0, 2**64 - 1), (5, 4)][int(rng.integers(4))]
    blocks[i] = with_false_header(blocks[i], times=times)
    return Case(
        f"false_chunk_times {times}", assemble(blocks, draw_ending(rng)), Truth(tuple(messages), tuple(messages))
    )


def chunk_without_crc(rng: np.random.Generator) -> Case:
    """Set a chunk's CRC to 0: its messages must be read, and reported as unverified."""
    messages, blocks = draw_blocks(rng)
    i = int(rng.integers(len(blocks)))
    blocks[i] = with_false_header(blocks[i], crc=0)
    how = draw_ending(rng)
    truth = Truth(tuple(messages), tuple(messages), loss=False, unverified=not how.data_crc)
    return Case(f"chunk_without_crc {i}", assemble(blocks, how), truth)


def other_frames(rng: np.random.Generator) -> Case:
    """Compress chunks like other writers: several frames, with checksums, without sizes; chunks with more fields."""
    messages, blocks = draw_blocks(rng)
    frames = [_framed(block, rng) for block in blocks]
    truth = Truth(tuple(messages), tuple(messages), loss=False)
    return Case(f"other_frames {blocks[0].compression or 'none'}", assemble(frames, draw_ending(rng)), truth)


def empty_chunk(rng: np.random.Generator) -> Case:
    """Insert a chunk without records, or with definitions only."""
    messages, blocks = draw_blocks(rng)
    compression = blocks[0].compression
    before = blocks[0].before if rng.random() < 0.5 else b""
    blocks.insert(int(rng.integers(len(blocks) + 1)), Block((), before, compression=compression))
    truth = Truth(tuple(messages), tuple(messages), loss=False)
    return Case("empty_chunk", assemble(blocks, draw_ending(rng)), truth)


def nested_chunk(rng: np.random.Generator) -> Case:
    """Insert a chunk in a chunk, which the specification does not allow: its messages may be read at most once."""
    messages, blocks = draw_blocks(rng, everywhere=True)
    i, k = 3, 4
    inside = records.chunk(blocks[k].content, blocks[k].times, blocks[k].compression)
    block, hidden = blocks[i], blocks[k].messages
    blocks[i] = replace(block, after=inside)
    del blocks[k]
    truth = Truth(without(messages, hidden), without(messages, hidden), optional=hidden)
    return Case("nested_chunk", assemble(blocks, draw_ending(rng)), truth)


def _framed(block: Block, rng: np.random.Generator) -> Block:
    content = block.content
    half = len(content) // 2
    extra = {"extra": rng.bytes(int(rng.integers(1, 30)))} if rng.random() < 0.2 else {}
    if block.compression == "zstd":
        many = zstandard.ZstdCompressor(level=3, write_checksum=True, write_content_size=bool(rng.integers(2)))
        stream = many.compressobj()
        choices = [
            many.compress(content[:half]) + many.compress(content[half:]),
            stream.compress(content) + stream.flush(),
            b"\x50\x2a\x4d\x18\x03\0\0\0abc" + many.compress(content),
            zstandard.ZstdCompressor(level=19).compress(content),
        ]
    elif block.compression == "lz4":
        choices = [
            lz4.frame.compress(content[:half]) + lz4.frame.compress(content[half:]),
            lz4.frame.compress(content, content_checksum=True, block_checksum=True, store_size=True),
            lz4.frame.compress(content, block_linked=False, block_size=lz4.frame.BLOCKSIZE_MAX4MB),
            lz4.frame.compress(content, compression_level=9, store_size=False),
        ]
    else:
        choices = [content]
    return with_false_header(block, data=choices[int(rng.integers(len(choices)))], **extra)


def false_record_in_chunk(rng: np.random.Generator) -> Case:
    """Insert a false record in a chunk with a valid CRC: records before it, and all other chunks, must be read."""
    messages, blocks = draw_blocks(rng, everywhere=True)
    i = int(rng.integers(len(blocks)))
    block = blocks[i]
    kept = int(rng.integers(len(block.messages)))
    whole = record_of(block.messages[kept])
    false_fields = {
        "a length beyond the chunk": whole[:1] + (10**6).to_bytes(8, "little") + whole[9:],
        "a length of 2^63": whole[:1] + (2**63).to_bytes(8, "little") + whole[9:],
        "a length of 2^64 - 1": whole[:1] + b"\xff" * 8 + whole[9:],
        "a message of 21 bytes": records.record(records.MESSAGE, whole[9:30]),
        "an empty message": records.record(records.MESSAGE, b""),
        "kind 0": b"\0" + whole[1:],
    }
    name = list(false_fields)[int(rng.integers(len(false_fields)))]
    rest = b"".join(record_of(message) for message in block.messages[kept + 1 :])
    blocks[i] = replace(block, messages=block.messages[:kept], after=false_fields[name] + rest)
    truth = Truth(tuple(messages), without(messages, block.messages[kept:]), loss=True, skippable=True)
    return Case(f"false_record_in_chunk {name}", assemble(blocks, draw_ending(rng)), truth)


KINDS = {
    swapped_chunks: 2,
    swapped_without_the_index: 1,
    repeated_chunk: 2,
    chunk_copied_over_another: 1,
    missing_chunk: 2,
    false_chunk_header: 8,
    false_chunk_times: 1,
    chunk_without_crc: 1,
    other_frames: 2,
    empty_chunk: 1,
    nested_chunk: 1,
    false_record_in_chunk: 4,
}
