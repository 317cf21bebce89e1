"""Compare the summary with the data section, without decompression, to find chunks that can be skipped."""

from __future__ import annotations

import struct
from collections import Counter
from collections.abc import Callable, Iterator

from cdtool.formats.mcap.container.chunks import HEADER_LENGTH, chunk_header
from cdtool.formats.mcap.container.file_bytes import FileBytes
from cdtool.formats.mcap.container.records import (
    MAGIC,
    PREFIX,
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Message,
    MessageIndex,
    Schema,
)
from cdtool.formats.mcap.container.summary import Summary, matches_header

# The message indexes of a chunk that are read as a whole [bytes].
_SHORT = 1 << 12
_OPCODE_AND_LENGTH = struct.Struct("<BQ")


def skippable_chunks(file: FileBytes, summary: Summary, wanted: Callable[[str], bool]) -> dict[int, dict[int, int]]:
    """Return the messages per channel of chunks without wanted topics, by the chunk's byte; empty if not verified.

    The summary is verified if its CRC matches, all chunks are at the bytes in the index and have the same header
    values, no message is outside of chunks, and the sums of the message indexes are those of the statistics for each
    channel. The first chunk is never skipped, because it has the log's start.
    """
    if not summary.verified or summary.statistics is None or not summary.chunks:
        return {}
    unwanted = {at for at, index in summary.chunks.items() if not _may_be_wanted(index, summary, wanted)}
    unwanted.discard(min(summary.chunks))
    if not unwanted:
        return {}
    file.expect(_between_chunks(summary))
    indexed = _indexed_messages(file, summary)
    if indexed is None:
        return {}
    total: Counter[int] = Counter()
    for counts in indexed.values():
        total.update(counts)
    stated = {channel: count for channel, count in summary.statistics.channel_message_counts.items() if count}
    return {at: indexed[at] for at in unwanted} if dict(total) == stated else {}


def _between_chunks(summary: Summary) -> Iterator[tuple[int, int]]:
    """Yield the ranges that show what is between the data of the chunks: their headers, and the message indexes.

    Of a long message index only the beginning is needed. The end of the last one is followed by the end of the data.
    """
    for at, index in summary.chunks.items():
        yield at, at + HEADER_LENGTH
        end, length = at + index.chunk_length, index.message_index_length
        if length <= _SHORT:
            yield end, end + length + HEADER_LENGTH
            continue
        for start in index.message_index_offsets.values():
            yield start, start + HEADER_LENGTH
        yield end + length, end + length + HEADER_LENGTH


def only_message_indexes(content: memoryview, at: int = 0) -> bool:
    """Return whether the bytes from `at` on are only message indexes, and no chunk that the summary omits."""
    end = len(content)
    while at <= end - PREFIX:
        opcode, length = _OPCODE_AND_LENGTH.unpack_from(content, at)
        if opcode != MessageIndex.opcode:
            return False
        at += PREFIX + length
    return at == end


def only_message_indexes_between(file: FileBytes, at: int, end: int) -> bool:
    """Return the same for the bytes of a file, reading only the beginning of each record."""
    while at <= end - PREFIX:
        opcode, length = _OPCODE_AND_LENGTH.unpack(file.read(at, PREFIX))
        if opcode != MessageIndex.opcode:
            return False
        at += PREFIX + length
    return at == end


def _may_be_wanted(index: ChunkIndex, summary: Summary, wanted: Callable[[str], bool]) -> bool:
    """Return whether a chunk may have a wanted topic: its index names one, or an undefined channel, or no channel."""
    channels = [summary.channels.get(channel) for channel in index.message_index_offsets]
    return not channels or any(channel is None or wanted(channel.topic) for channel in channels)


def _indexed_messages(file: FileBytes, summary: Summary) -> dict[int, dict[int, int]] | None:
    """Return the messages per channel of every chunk, from the message indexes after it; None for any inconsistency."""
    indexed: dict[int, dict[int, int]] = {}
    at, chunk = len(MAGIC), -1
    while at < file.size:
        head = file.read(at, HEADER_LENGTH)
        if len(head) < PREFIX or head[0] in (0, Schema.opcode, Channel.opcode, Message.opcode):
            return None
        length = PREFIX + int.from_bytes(head[1:PREFIX], "little")
        header = chunk_header(at, head)
        if head[0] == DataEnd.opcode:
            same = all(set(indexed[start]) == set(summary.chunks[start].message_index_offsets) for start in indexed)
            return indexed if same and len(indexed) == len(summary.chunks) else None
        if head[0] == Chunk.opcode:
            index = summary.chunks.get(at)
            if header is None or index is None or not matches_header(index, header):
                return None
            chunk = at
            indexed[chunk] = {}
        elif head[0] == MessageIndex.opcode:
            channel, size = int.from_bytes(head[9:11], "little"), int.from_bytes(head[11:15], "little")
            stated = summary.chunks[chunk].message_index_offsets.get(channel) if chunk >= 0 else None
            if stated != at or length < PREFIX + 6 + size:
                return None
            indexed[chunk][channel] = size // 16
        at += length
    return None
