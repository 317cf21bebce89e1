"""A whole file of parts: chunks with their message indexes, bare records, and a summary that tells of them."""

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
    """A chunk: definitions (and whatever else), its messages, what stands behind them; `lies` go to records.chunk."""

    messages: tuple[Message, ...] = ()
    before: bytes = b""
    behind: bytes = b""
    compression: str = ""
    lies: Mapping[str, Any] = field(default_factory=dict)

    @property
    def content(self) -> bytes:
        """The records, uncompressed."""
        return self.before + b"".join(record_of(message) for message in self.messages) + self.behind

    @property
    def times(self) -> tuple[int, int]:
        """Earliest and latest log time [ns]."""
        times = [message.time for message in self.messages] or [0]
        return min(times), max(times)

    def entries(self) -> dict[int, list[tuple[int, int]]]:
        """Channel -> (time, offset) of its messages."""
        found: dict[int, list[tuple[int, int]]] = {}
        at = len(self.before)
        for message in self.messages:
            found.setdefault(CHANNELS[message.topic], []).append((message.time, at))
            at += len(record_of(message))
        return found


@dataclass(frozen=True)
class Index:
    """What a chunk index tells; see records.chunk_index."""

    times: tuple[int, int]
    start: int
    length: int
    offsets: Mapping[int, int]
    index_length: int
    compression: str
    sizes: tuple[int, int]

    @property
    def record(self) -> bytes:
        """The chunk index as bytes."""
        offsets, length = self.offsets, self.index_length
        return records.chunk_index(self.times, self.start, self.length, offsets, length, self.compression, self.sizes)


@dataclass(frozen=True)
class Ending:
    """How a file ends: with a summary or not, with CRCs or not, and in what the summary lies."""

    summary: bool = True
    crc: bool = True
    data_crc: bool = False
    definitions: bytes = ALL_DEFINITIONS
    count_off: int = 0
    counts: Callable[[dict[int, int]], dict[int, int]] = dict
    indexes: Callable[[list[Index]], list[Index]] = list


def blocks_of(messages: Sequence[Message], size: int, compression: str, everywhere: bool = False) -> list[Block]:
    """Chunks of `size` messages; the definitions stand in the first one, or in every one."""
    made = []
    for at in range(0, len(messages), size):
        before = ALL_DEFINITIONS if everywhere or at == 0 else b""
        made.append(Block(tuple(messages[at : at + size]), before, compression=compression))
    return made


def assemble(parts: Sequence[Block | bytes], ending: Ending | None = None) -> bytes:
    """The file of these parts; bare records in between are taken as they are, and the summary knows nothing of them."""
    ending = ending or Ending()
    made = bytearray(records.MAGIC + records.header())
    indexes: list[Index] = []
    counts: Counter[int] = Counter()
    for part in parts:
        if isinstance(part, bytes):
            made += part
            continue
        counts.update({channel: len(entries) for channel, entries in part.entries().items()})
        indexes.append(_add(made, part))
    made += records.data_end(zlib.crc32(made) if ending.data_crc else 0)
    if not ending.summary:
        return bytes(made) + records.ending(b"", 0, ending.crc)
    times = [time for index in indexes for time in index.times]
    told = ending.counts(dict(counts))
    summary = ending.definitions
    summary += records.statistics(
        sum(counts.values()) + ending.count_off,
        3,
        4,
        len(indexes),
        (min(times, default=0), max(times, default=0)),
        told,
    )
    summary += b"".join(index.record for index in ending.indexes(indexes))
    return bytes(made) + records.ending(summary, len(made), ending.crc)


def _add(made: bytearray, block: Block) -> Index:
    content, start = block.content, len(made)
    options = {"compression": block.compression, **block.lies}
    chunk = records.chunk(content, options.pop("times", block.times), **options)
    made += chunk
    offsets = {}
    behind = len(made)
    for number, entries in block.entries().items():
        offsets[number] = len(made)
        made += records.message_index(number, entries)
    size = len(records.packed(block.compression, content))
    return Index(block.times, start, len(chunk), offsets, len(made) - behind, block.compression, (size, len(content)))


def lying(block: Block, **lies: Any) -> Block:
    """The same chunk with lies in its header."""
    return replace(block, lies={**block.lies, **lies})
