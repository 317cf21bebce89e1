"""Read the summary at the end of a file (sections "Footer", "Summary Section"), and find chunks that can be skipped.

Its CRC is checked here, and `log` compares it with the data. A summary without a CRC is only used as a hint.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from mcap.records import Channel, ChunkIndex, Footer, MetadataIndex, Schema, Statistics

from cdtool.formats.mcap.chunks import HEADER_LENGTH, ChunkHeader, chunk_header
from cdtool.formats.mcap.file_bytes import FileBytes
from cdtool.formats.mcap.records import (
    LARGEST,
    MAGIC,
    PREFIX,
    DamageError,
    Opcode,
    crc32,
    parse,
    parse_all,
    record_length,
)

_FOOTER = PREFIX + 20  # a footer is never extended
# The message indexes of a chunk that are read as a whole [bytes].
_SHORT = 1 << 12


@dataclass(frozen=True)
class Summary:
    """The summary's records; `problem` is why they cannot be read, `verified`: their CRC matches."""

    footer: Footer | None = None
    verified: bool = False
    problem: str = ""
    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    chunks: dict[int, ChunkIndex] = field(default_factory=dict)
    statistics: Statistics | None = None
    metadata: tuple[MetadataIndex, ...] = ()


def read_summary(file: FileBytes) -> Summary:
    """Return the summary; damage is returned as its `problem`, without an exception."""
    footer = None
    try:
        footer, at = _footer(file)
        if not footer.summary_start:
            return Summary(footer)
        start = footer.summary_start
        if not len(MAGIC) <= start <= at or at - start > LARGEST:
            raise DamageError(f"the footer states byte {start} as the summary's start")
        section = file.read(start, at - start)
        crc = crc32(file.read(at, PREFIX + 16), crc32(section))
        if footer.summary_crc and crc != footer.summary_crc:
            raise DamageError("the checksum of the summary does not match")
        records = list(parse_all(section))
    except DamageError as fault:
        return Summary(footer, problem=str(fault))
    counts = [record for record in records if isinstance(record, Statistics)]
    return Summary(
        footer,
        verified=bool(footer.summary_crc),
        schemas={record.id: record for record in records if isinstance(record, Schema) and record.id},
        channels={record.id: record for record in records if isinstance(record, Channel)},
        chunks={record.chunk_start_offset: record for record in records if isinstance(record, ChunkIndex)},
        statistics=counts[0] if counts else None,
        metadata=tuple(record for record in records if isinstance(record, MetadataIndex)),
    )


def matches_header(index: ChunkIndex, header: ChunkHeader) -> bool:
    """Return whether the index of a chunk has the same values as the chunk's header."""
    return (
        index.chunk_length == header.length
        and index.compressed_size == header.size
        and index.uncompressed_size == header.uncompressed_size
        and index.compression == header.compression
        and index.message_start_time == header.message_start_time
        and index.message_end_time == header.message_end_time
    )


def _footer(file: FileBytes) -> tuple[Footer, int]:
    at = file.size - _FOOTER - len(MAGIC)
    end = file.read(max(0, at), file.size)
    if at < len(MAGIC) or bytes(end[-len(MAGIC) :]) != MAGIC:
        raise DamageError("the file does not end like an MCAP file")
    if end[0] != Opcode.FOOTER or record_length(at, end, file.size) != _FOOTER:
        raise DamageError("the file does not end with a footer")
    return parse(Opcode.FOOTER, end[PREFIX : -len(MAGIC)]), at


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
        if len(head) < PREFIX or head[0] in (0, Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE):
            return None
        length = PREFIX + int.from_bytes(head[1:PREFIX], "little")
        header = chunk_header(at, head)
        if head[0] == Opcode.DATA_END:
            same = all(set(indexed[start]) == set(summary.chunks[start].message_index_offsets) for start in indexed)
            return indexed if same and len(indexed) == len(summary.chunks) else None
        if head[0] == Opcode.CHUNK:
            index = summary.chunks.get(at)
            if header is None or index is None or not matches_header(index, header):
                return None
            chunk = at
            indexed[chunk] = {}
        elif head[0] == Opcode.MESSAGE_INDEX:
            channel, size = int.from_bytes(head[9:11], "little"), int.from_bytes(head[11:15], "little")
            stated = summary.chunks[chunk].message_index_offsets.get(channel) if chunk >= 0 else None
            if stated != at or length < PREFIX + 6 + size:
                return None
            indexed[chunk][channel] = size // 16
        at += length
    return None
