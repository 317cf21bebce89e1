"""Read the summary at the end of a file (sections "Footer", "Summary Section"), and find chunks that can be skipped.

Its CRC is checked here, and `log` compares it with the data. A summary without a CRC is only used as a hint.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from mcap.records import Channel, ChunkIndex, Footer, MetadataIndex, Schema, Statistics

from cdtool.formats.mcap.chunks import HEADER_LENGTH, ChunkHeader
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


@dataclass(frozen=True)
class McapSummary:
    """The summary's records; `problem` is why they cannot be read, `verified`: their CRC matches."""

    footer: Footer | None = None
    verified: bool = False
    problem: str = ""
    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    chunks: dict[int, ChunkIndex] = field(default_factory=dict)
    statistics: Statistics | None = None
    metadata: tuple[MetadataIndex, ...] = ()


def read_summary(file: FileBytes) -> McapSummary:
    """Return the summary; damage is returned as its `problem`, without an exception."""
    footer = None
    try:
        footer, at = _footer(file)
        if not footer.summary_start:
            return McapSummary(footer)
        start = footer.summary_start
        if not len(MAGIC) <= start <= at or at - start > LARGEST:
            raise DamageError(f"the footer states byte {start} as the summary's start")
        section = file.read(start, at - start)
        crc = crc32(file.read(at, PREFIX + 16), crc32(section))
        if footer.summary_crc and crc != footer.summary_crc:
            raise DamageError("the checksum of the summary does not match")
        records = list(parse_all(section))
    except DamageError as fault:
        return McapSummary(footer, problem=str(fault))
    counts = [record for record in records if isinstance(record, Statistics)]
    return McapSummary(
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


def unwanted_chunks(summary: McapSummary, wanted: Callable[[str], bool]) -> set[int]:
    """Return the chunks, by their bytes, that have no wanted topic by a summary whose CRC matches.

    The first chunk is never one of them, because it has the log's start. A chunk without message indexes, or with an
    undefined channel, may have a wanted topic.
    """

    def is_unwanted(index: ChunkIndex) -> bool:
        channels = [summary.channels.get(channel) for channel in index.message_index_offsets]
        return bool(channels) and not any(channel is None or wanted(channel.topic) for channel in channels)

    chunks = summary.chunks if summary.verified else {}
    return {at for at, index in chunks.items() if is_unwanted(index)} - {min(chunks, default=0)}


def between_chunks(summary: McapSummary) -> Iterator[tuple[int, int]]:
    """Yield the ranges that show what is between the data of the chunks: their headers, and the message indexes.

    Of a long message index only the beginning is needed. The end of the last one is followed by the end of the data.
    """
    for at, index in summary.chunks.items():
        yield at, at + HEADER_LENGTH
        end, length = at + index.chunk_length, index.message_index_length
        if length <= 1 << 12:  # read as a whole
            yield end, end + length + HEADER_LENGTH
            continue
        for start in index.message_index_offsets.values():
            yield start, start + HEADER_LENGTH
        yield end + length, end + length + HEADER_LENGTH
