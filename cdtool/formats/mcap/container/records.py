"""The records of an MCAP file, one class per record of the specification's section "Records".

`read(body)` parses a record's content, without opcode and length. Bytes after the last known field are ignored, as the
specification requires ("Records may be extended by adding new fields at the end"). Times are uint64 ns.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from functools import cache
from itertools import groupby
from typing import Any, ClassVar, Self

from cdtool.formats.mcap.container.serialisation import (
    INTEGERS,
    Read,
    byte_block,
    index_entries,
    integers,
    long_block,
    mapping,
    numbers_by_channel,
    rest,
    string,
    uint8,
    uint16,
    uint32,
    uint64,
)

MAGIC = b"\x89MCAP0\r\n"
PREFIX = 9  # opcode (uint8) and content length (uint64)


def wire(read: Read) -> Any:
    """Return a dataclass field that `read` parses."""
    return field(metadata={"read": read})


class Record:
    """The base of all records: `read` parses the fields in their order."""

    opcode: ClassVar[int]

    @classmethod
    def read(cls, body: memoryview) -> Self:
        """Return the record with the content `body`; raises DamageError."""
        values: list[Any] = []
        at = 0
        for read, are_integers in _readers(cls):  # type: ignore[arg-type]
            value, at = read(body, at)
            if are_integers:
                values += value
            else:
                values.append(value)
        return cls(*values)


@cache
def _readers(kind: type[Record]) -> tuple[tuple[Read, bool], ...]:
    """Return the readers of a record's fields, and whether each reads several integers: all consecutive ones."""
    reads = [each.metadata["read"] for each in fields(kind)]  # type: ignore[arg-type]
    runs = [(are, list(run)) for are, run in groupby(reads, INTEGERS.__contains__)]
    return tuple((read, are) for are, run in runs for read in ([integers(run)] if are else run))


@dataclass(frozen=True)
class Header(Record):
    """Header (op=0x01): the first record."""

    opcode = 0x01
    profile: str = wire(string)
    library: str = wire(string)


@dataclass(frozen=True)
class Footer(Record):
    """Footer (op=0x02): the last record. A start of 0 means that there is no such section, a CRC of 0 no checksum."""

    opcode = 0x02
    summary_start: int = wire(uint64)
    summary_offset_start: int = wire(uint64)
    summary_crc: int = wire(uint32)


@dataclass(frozen=True)
class Schema(Record):
    """Schema (op=0x03): the layout of a channel's messages. A schema with the id 0 is ignored."""

    opcode = 0x03
    id: int = wire(uint16)
    name: str = wire(string)
    encoding: str = wire(string)
    data: bytes = wire(byte_block)


@dataclass(frozen=True)
class Channel(Record):
    """Channel (op=0x04): a stream of messages on a topic. The schema id 0 means that there is no schema."""

    opcode = 0x04
    id: int = wire(uint16)
    schema_id: int = wire(uint16)
    topic: str = wire(string)
    message_encoding: str = wire(string)
    metadata: Mapping[str, str] = wire(mapping(string, string))


@dataclass(frozen=True)
class Message(Record):
    """Message (op=0x05). `walk_kernel` reads many messages at once without creating objects."""

    opcode = 0x05
    channel_id: int = wire(uint16)
    sequence: int = wire(uint32)
    log_time: int = wire(uint64)
    publish_time: int = wire(uint64)
    data: memoryview = wire(rest)  # noqa: RUF009  (a field, made by dataclasses.field)


@dataclass(frozen=True)
class Chunk(Record):
    """Chunk (op=0x06): schemas, channels and messages, compressed or not. A CRC of 0 means no checksum."""

    opcode = 0x06
    message_start_time: int = wire(uint64)
    message_end_time: int = wire(uint64)
    uncompressed_size: int = wire(uint64)
    uncompressed_crc: int = wire(uint32)
    compression: str = wire(string)
    records: memoryview = wire(long_block)  # noqa: RUF009  (a field, made by dataclasses.field)


@dataclass(frozen=True)
class MessageIndex(Record):
    """Message Index (op=0x07): (log time, offset in the uncompressed chunk) of a channel's messages."""

    opcode = 0x07
    channel_id: int = wire(uint16)
    records: tuple[tuple[int, int], ...] = wire(index_entries)


@dataclass(frozen=True)
class ChunkIndex(Record):
    """Chunk Index (op=0x08): the position of a chunk and of its message indexes, and the values of its header."""

    opcode = 0x08
    message_start_time: int = wire(uint64)
    message_end_time: int = wire(uint64)
    chunk_start_offset: int = wire(uint64)
    chunk_length: int = wire(uint64)
    message_index_offsets: Mapping[int, int] = wire(numbers_by_channel)
    message_index_length: int = wire(uint64)
    compression: str = wire(string)
    compressed_size: int = wire(uint64)
    uncompressed_size: int = wire(uint64)


@dataclass(frozen=True)
class Attachment(Record):
    """Attachment (op=0x09): an embedded file. The CRC covers the fields before it; 0 means no checksum."""

    opcode = 0x09
    log_time: int = wire(uint64)
    create_time: int = wire(uint64)
    name: str = wire(string)
    media_type: str = wire(string)
    data: memoryview = wire(long_block)  # noqa: RUF009  (a field, made by dataclasses.field)
    crc: int = wire(uint32)


@dataclass(frozen=True)
class AttachmentIndex(Record):
    """Attachment Index (op=0x0A): the position of an attachment."""

    opcode = 0x0A
    offset: int = wire(uint64)
    length: int = wire(uint64)
    log_time: int = wire(uint64)
    create_time: int = wire(uint64)
    data_size: int = wire(uint64)
    name: str = wire(string)
    media_type: str = wire(string)


@dataclass(frozen=True)
class Statistics(Record):
    """Statistics (op=0x0B): the numbers of messages, schemas, channels, attachments, metadata and chunks."""

    opcode = 0x0B
    message_count: int = wire(uint64)
    schema_count: int = wire(uint16)
    channel_count: int = wire(uint32)
    attachment_count: int = wire(uint32)
    metadata_count: int = wire(uint32)
    chunk_count: int = wire(uint32)
    message_start_time: int = wire(uint64)
    message_end_time: int = wire(uint64)
    channel_message_counts: Mapping[int, int] = wire(numbers_by_channel)


@dataclass(frozen=True)
class Metadata(Record):
    """Metadata (op=0x0C): a user's names and values."""

    opcode = 0x0C
    name: str = wire(string)
    metadata: Mapping[str, str] = wire(mapping(string, string))


@dataclass(frozen=True)
class MetadataIndex(Record):
    """Metadata Index (op=0x0D): the position of a metadata record."""

    opcode = 0x0D
    offset: int = wire(uint64)
    length: int = wire(uint64)
    name: str = wire(string)


@dataclass(frozen=True)
class SummaryOffset(Record):
    """Summary Offset (op=0x0E): the position of the summary's records of one kind."""

    opcode = 0x0E
    group_opcode: int = wire(uint8)
    group_start: int = wire(uint64)
    group_length: int = wire(uint64)


@dataclass(frozen=True)
class DataEnd(Record):
    """Data End (op=0x0F): the last record of the data section, with the CRC of all bytes before it; 0: no checksum."""

    opcode = 0x0F
    data_section_crc: int = wire(uint32)


KINDS: dict[int, type[Record]] = {kind.opcode: kind for kind in Record.__subclasses__()}
