"""Assemble a file from parts: chunks with their message indexes, single records, and a summary of them."""

from __future__ import annotations

import zlib
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from tests.formats.mcap_damage import records
from tests.formats.mcap_damage.messages import ALL_DEFINITIONS, CHANNELS, record_of
from tests.formats.mcap_damage.truth import Message


@dataclass(frozen=True)
class Block:
    """A chunk: records before its messages (definitions), its messages, and records after them.

    `false_fields` are arguments of `records.chunk`.
    """

    messages: tuple[Message, ...] = ()
    before: bytes = b""
    after: bytes = b""
    compression: str = ""
    false_fields: Mapping[str, Any] = field(default_factory=dict)

    @property
    def content(self) -> bytes:
        """Return the uncompressed records."""
        return self.before + b"".join(record_of(message) for message in self.messages) + self.after

    @property
    def times(self) -> tuple[int, int]:
        """Return earliest and latest log time [ns]."""
        times = [message.time for message in self.messages] or [0]
        return min(times), max(times)

    def entries(self) -> dict[int, list[tuple[int, int]]]:
        """Return (time, offset) of the messages per channel."""
        entries: dict[int, list[tuple[int, int]]] = {}
        at = len(self.before)
        for message in self.messages:
            entries.setdefault(CHANNELS[message.topic], []).append((message.time, at))
            at += len(record_of(message))
        return entries


@dataclass(frozen=True)
class Index:
    """The fields of a chunk index; see records.chunk_index."""

    times: tuple[int, int]
    start: int
    length: int
    offsets: Mapping[int, int]
    index_length: int
    compression: str
    sizes: tuple[int, int]

    @property
    def record(self) -> bytes:
        """Return the chunk index as bytes."""
        offsets, length = self.offsets, self.index_length
        return records.chunk_index(self.times, self.start, self.length, offsets, length, self.compression, self.sizes)


@dataclass(frozen=True)
class Ending:
    """The end of a file: with or without summary and CRCs, and functions that make the summary's values false."""

    summary: bool = True
    crc: bool = True
    data_crc: bool = False
    definitions: bytes = ALL_DEFINITIONS
    count_off: int = 0
    counts: Callable[[dict[int, int]], dict[int, int]] = dict
    indexes: Callable[[list[Index]], list[Index]] = list


def blocks_of(messages: Sequence[Message], size: int, compression: str, everywhere: bool = False) -> list[Block]:
    """Return chunks of `size` messages, with definitions in the first chunk, or in every chunk."""
    blocks = []
    for at in range(0, len(messages), size):
        before = ALL_DEFINITIONS if everywhere or at == 0 else b""
        blocks.append(Block(tuple(messages[at : at + size]), before, compression=compression))
    return blocks


def assemble(parts: Sequence[Block | bytes], ending: Ending | None = None) -> bytes:
    """Return the file of these parts; single records are inserted unchanged, and the summary does not include them."""
    ending = ending or Ending()
    data = bytearray(records.MAGIC + records.header())
    indexes: list[Index] = []
    counts: Counter[int] = Counter()
    for part in parts:
        if isinstance(part, bytes):
            data += part
            continue
        counts.update({channel: len(entries) for channel, entries in part.entries().items()})
        indexes.append(_add(data, part))
    data += records.data_end(zlib.crc32(data) if ending.data_crc else 0)
    if not ending.summary:
        return bytes(data) + records.ending(b"", 0, ending.crc)
    times = [time for index in indexes for time in index.times]
    stated_counts = ending.counts(dict(counts))
    summary = ending.definitions
    summary += records.statistics(
        sum(counts.values()) + ending.count_off,
        3,
        4,
        len(indexes),
        (min(times, default=0), max(times, default=0)),
        stated_counts,
    )
    summary += b"".join(index.record for index in ending.indexes(indexes))
    return bytes(data) + records.ending(summary, len(data), ending.crc)


def _add(data: bytearray, block: Block) -> Index:
    content, start = block.content, len(data)
    options = {"compression": block.compression, **block.false_fields}
    chunk = records.chunk(content, options.pop("times", block.times), **options)
    data += chunk
    offsets = {}
    chunk_end = len(data)
    for number, entries in block.entries().items():
        offsets[number] = len(data)
        data += records.message_index(number, entries)
    size = len(records.packed(block.compression, content))
    return Index(
        block.times, start, len(chunk), offsets, len(data) - chunk_end, block.compression, (size, len(content))
    )


def with_false_header(block: Block, **false_fields: Any) -> Block:
    """Return the same chunk with false fields in its header."""
    return replace(block, false_fields={**block.false_fields, **false_fields})
