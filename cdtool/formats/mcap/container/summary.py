"""Read the summary at the end of a file (sections "Footer", "Summary Section", "Summary Offset Section").

Its CRC is checked here, and `log` compares it with the data. A summary without a CRC is only used as a hint.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from cdtool.formats.mcap.container.checksums import crc32
from cdtool.formats.mcap.container.chunks import LARGEST, ChunkHeader
from cdtool.formats.mcap.container.damage import DamageError
from cdtool.formats.mcap.container.file_bytes import FileBytes
from cdtool.formats.mcap.container.records import (
    KINDS,
    MAGIC,
    PREFIX,
    Channel,
    ChunkIndex,
    Footer,
    Record,
    Schema,
    Statistics,
)

_FOOTER = PREFIX + 20  # a footer is never extended


@dataclass(frozen=True)
class Summary:
    """The summary's records; `problem` is the reason why there are no records, `verified`: their CRC matches."""

    footer: Footer | None = None
    records: tuple[Record, ...] = ()
    verified: bool = False
    problem: str = ""
    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    chunks: dict[int, ChunkIndex] = field(default_factory=dict)
    statistics: Statistics | None = None


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
        records = tuple(parse_records(section))
    except DamageError as fault:
        return Summary(footer, problem=str(fault))
    counts = [record for record in records if isinstance(record, Statistics)]
    return Summary(
        footer,
        records,
        verified=bool(footer.summary_crc),
        schemas={record.id: record for record in records if isinstance(record, Schema) and record.id},
        channels={record.id: record for record in records if isinstance(record, Channel)},
        chunks={record.chunk_start_offset: record for record in records if isinstance(record, ChunkIndex)},
        statistics=counts[0] if counts else None,
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


def parse_records(section: memoryview) -> Iterator[Record]:
    """Yield the known records of a part of a file; raises DamageError."""
    at = 0
    while at < len(section):
        opcode, length = read_prefix(section[at:])
        if opcode in KINDS:
            yield KINDS[opcode].read(section[at + PREFIX : at + PREFIX + length])
        at += PREFIX + length


def read_prefix(rest: memoryview) -> tuple[int, int]:
    """Return opcode and content length of the record at the start of `rest`; raises DamageError if it is incomplete."""
    if len(rest) < PREFIX:
        raise DamageError(f"the file ends within a record: {len(rest)} bytes are left")
    opcode, length = rest[0], int.from_bytes(rest[1:PREFIX], "little")
    if opcode == 0:
        raise DamageError("a record of kind 0, which does not exist")
    if length > len(rest) - PREFIX:
        raise DamageError(f"a record declares {length} bytes, but only {len(rest) - PREFIX} are left")
    return opcode, length


def _footer(file: FileBytes) -> tuple[Footer, int]:
    at = file.size - _FOOTER - len(MAGIC)
    end = file.read(max(0, at), file.size)
    if at < len(MAGIC) or bytes(end[-len(MAGIC) :]) != MAGIC:
        raise DamageError("the file does not end like an MCAP file")
    if end[0] != Footer.opcode or read_prefix(end[: -len(MAGIC)])[1] != _FOOTER - PREFIX:
        raise DamageError("the file does not end with a footer")
    return Footer.read(end[PREFIX:]), at
