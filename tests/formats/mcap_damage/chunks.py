"""Chunks in another order, repeated, missing, or with false sizes, times, CRC or compression in their headers."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations
from typing import Any

import lz4.frame
import numpy as np
import zstandard

from tests.formats.mcap_damage import records
from tests.formats.mcap_damage.assembly import Block, Ending, assemble, with_false_header
from tests.formats.mcap_damage.draft import Draft, pick, share
from tests.formats.mcap_damage.messages import record_of
from tests.formats.mcap_damage.truth import Case, Truth, without


@share(2)
def swapped_chunks(rng: np.random.Generator) -> Case:
    """Exchange two chunks: nothing is lost."""
    draft = Draft(rng, everywhere=True)
    i, k = rng.choice(len(draft.blocks), 2, replace=False).tolist()
    draft.blocks[i], draft.blocks[k] = draft.blocks[k], draft.blocks[i]
    return draft.case(f"swapped_chunks {i} and {k}", loss=False)


@share(1)
def swapped_without_the_index(rng: np.random.Generator) -> Case:
    """Exchange two chunks of equal length, without changing the index."""
    draft = Draft(rng, "", everywhere=True)
    parts = {block.messages: records.chunk(block.content, block.times) for block in draft.blocks}
    one, two = next((a, b) for a, b in combinations(parts.values(), 2) if len(a) == len(b))
    marked = assemble(draft.blocks, Ending()).replace(one, b"\xfe" * len(one))
    data = marked.replace(two, one).replace(b"\xfe" * len(one), two)
    return Case("swapped_without_the_index", data, Truth(tuple(draft.messages), tuple(draft.messages)))


@share(2)
def repeated_chunk(rng: np.random.Generator) -> Case:
    """Repeat a chunk: its messages must be read once, and may be read twice."""
    draft = Draft(rng)
    i, k = draft.place(), draft.place()
    twice = draft.blocks[i]
    draft.blocks.insert(max(i, k) + 1, twice)
    return draft.case(f"repeated_chunk {i}", optional=twice.messages)


@share(1)
def chunk_copied_over_another(rng: np.random.Generator) -> Case:
    """Insert a copy of a chunk that is not in the index."""
    draft = Draft(rng)
    i, k = draft.place(), draft.place()
    block = draft.blocks[i]
    parts: list[Block | bytes] = list(draft.blocks)
    parts.insert(max(i, k) + 1, records.chunk(block.content, block.times, block.compression))
    return draft.case(f"chunk_copied_over_another {i}", parts, optional=block.messages)


@share(2)
def missing_chunk(rng: np.random.Generator) -> Case:
    """Remove a chunk: all positions after it in the summary are wrong."""
    draft = Draft(rng, everywhere=True)
    how = draft.ending
    i = draft.place()
    block = draft.blocks[i]
    chunk = records.chunk(block.content, block.times, block.compression)
    rest = without(draft.messages, block.messages)
    whole = draft.case(f"missing_chunk {i}", required=rest, undetectable=not (how.summary or how.data_crc))
    return replace(whole, data=whole.data.replace(chunk, b"", 1))


# Values of a field of a chunk's header, by the name of the argument of `records.chunk`.
_FALSE_FIELDS: dict[str, tuple[int | str | bytes, ...]] = {
    "size": (2**31, 2**63, 2**64 - 1, 0),
    "data_size": (0, 2**63, 2**64 - 1),
    "crc": (1,),
    "named": ("zst", "ZSTD", "bz2", "none", "gzip\0", b"\xff\xfe\xfd", b"z" * 70, b"x" * 5000),
    "data": (b"", b"\x28\xb5\x2f\xfd"),
}


@share(8)
def false_chunk_header(rng: np.random.Generator) -> Case:
    """Set a false field in a chunk's header: all other chunks, which have their own definitions, must be read."""
    draft = Draft(rng, everywhere=True)
    i = draft.place()
    block = draft.blocks[i]
    size, data = len(block.content), records.packed(block.compression, block.content)
    fields: list[tuple[str, Any]] = [(key, value) for key, values in _FALSE_FIELDS.items() for value in values]
    fields += [("size", value) for value in (size - 1, size + 1, 2 * size, 2**32 + size)]
    fields += [("data_size", len(data) + 1), ("data_size", len(data) - 1)]
    fields += [("data", value) for value in (data[: len(data) // 2], bytes(len(data)), rng.bytes(len(data)))]
    key, value = draft.pick(fields)
    draft.blocks[i] = with_false_header(block, **{key: value})
    shown = value if isinstance(value, int) else value[:8]
    rest = without(draft.messages, block.messages)
    return draft.case(f"false_chunk_header {i} {block.compression or 'none'} {key} {shown!r}", required=rest)


@share(1)
def false_chunk_times(rng: np.random.Generator) -> Case:
    """Set false times in a chunk's header: the times of the messages must be read."""
    draft = Draft(rng)
    i = draft.place()
    times = draft.pick([(0, 0), (2**64 - 1, 0), (0, 2**64 - 1), (5, 4)])
    draft.blocks[i] = with_false_header(draft.blocks[i], times=times)
    return draft.case(f"false_chunk_times {times}")


@share(1)
def chunk_without_crc(rng: np.random.Generator) -> Case:
    """Set a chunk's CRC to 0: its messages must be read, and reported as unverified."""
    draft = Draft(rng)
    i = draft.place()
    draft.blocks[i] = with_false_header(draft.blocks[i], crc=0)
    return draft.case(f"chunk_without_crc {i}", loss=False, unverified=not draft.ending.data_crc)


@share(2)
def other_frames(rng: np.random.Generator) -> Case:
    """Compress chunks like other writers: several frames, with checksums, without sizes; chunks with more fields."""
    draft = Draft(rng)
    frames = [_framed(block, rng) for block in draft.blocks]
    return draft.case(f"other_frames {draft.blocks[0].compression or 'none'}", frames, loss=False)


def _framed(block: Block, rng: np.random.Generator) -> Block:
    content = block.content
    half = len(content) // 2
    extra = {"extra": rng.bytes(int(rng.integers(1, 30)))} if rng.random() < 0.2 else {}
    choices = [content]
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
    return with_false_header(block, data=pick(rng, choices), **extra)


@share(1)
def empty_chunk(rng: np.random.Generator) -> Case:
    """Insert a chunk without records, or with definitions only."""
    draft = Draft(rng)
    compression = draft.blocks[0].compression
    before = draft.blocks[0].before if rng.random() < 0.5 else b""
    draft.blocks.insert(int(rng.integers(len(draft.blocks) + 1)), Block((), before, compression=compression))
    return draft.case("empty_chunk", loss=False)


@share(1)
def nested_chunk(rng: np.random.Generator) -> Case:
    """Insert a chunk in a chunk, which the specification does not allow: its messages may be read at most once."""
    draft = Draft(rng, everywhere=True)
    hidden = draft.blocks.pop(4)
    inside = records.chunk(hidden.content, hidden.times, hidden.compression)
    draft.blocks[3] = replace(draft.blocks[3], after=inside)
    return draft.case("nested_chunk", written=without(draft.messages, hidden.messages), optional=hidden.messages)


@share(4)
def false_record_in_chunk(rng: np.random.Generator) -> Case:
    """Insert a false record in a chunk with a valid CRC: records before it, and all other chunks, must be read."""
    draft = Draft(rng, everywhere=True)
    i = draft.place()
    block = draft.blocks[i]
    kept = int(rng.integers(len(block.messages)))
    whole = record_of(block.messages[kept])
    false_records = {
        "a length beyond the chunk": whole[:1] + (10**6).to_bytes(8, "little") + whole[9:],
        "a length of 2^63": whole[:1] + (2**63).to_bytes(8, "little") + whole[9:],
        "a length of 2^64 - 1": whole[:1] + b"\xff" * 8 + whole[9:],
        "a message of 21 bytes": records.record(records.MESSAGE, whole[9:30]),
        "an empty message": records.record(records.MESSAGE, b""),
        "kind 0": b"\0" + whole[1:],
    }
    name = draft.pick(list(false_records))
    rest = b"".join(record_of(message) for message in block.messages[kept + 1 :])
    draft.blocks[i] = replace(block, messages=block.messages[:kept], after=false_records[name] + rest)
    readable = without(draft.messages, block.messages[kept:])
    return draft.case(f"false_record_in_chunk {name}", required=readable, loss=True, skippable=True)
