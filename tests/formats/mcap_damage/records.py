"""Write records of the MCAP specification as bytes, independently of the reader under test."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterable, Mapping

import lz4.frame
import zstandard

MAGIC = b"\x89MCAP0\r\n"
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX, CHUNK_INDEX = range(1, 9)
ATTACHMENT, ATTACHMENT_INDEX, STATISTICS, METADATA, METADATA_INDEX, SUMMARY_OFFSET, DATA_END = range(9, 16)


def record(opcode: int, body: bytes, claimed: int | None = None) -> bytes:
    """Return opcode, length of the content (or the false length `claimed`), content."""
    return struct.pack("<BQ", opcode, len(body) if claimed is None else claimed) + body


def text(value: str | bytes, claimed: int | None = None) -> bytes:
    """Return a string with its length (or the false length `claimed`)."""
    raw = value.encode() if isinstance(value, str) else value
    return struct.pack("<I", len(raw) if claimed is None else claimed) + raw


def texts(values: Mapping[str, str], claimed: int | None = None) -> bytes:
    """Return a map of strings with its length in bytes."""
    body = b"".join(text(key) + text(value) for key, value in values.items())
    return struct.pack("<I", len(body) if claimed is None else claimed) + body


def header(profile: str = "", library: str = "damage") -> bytes:
    return record(HEADER, text(profile) + text(library))


def schema(number: int, name: str, encoding: str, data: bytes) -> bytes:
    return record(SCHEMA, struct.pack("<H", number) + text(name) + text(encoding) + text(data))


def channel(
    number: int, schema_id: int, topic: str | bytes, encoding: str, metadata: Mapping[str, str] | None = None
) -> bytes:
    body = struct.pack("<HH", number, schema_id) + text(topic) + text(encoding) + texts(metadata or {})
    return record(CHANNEL, body)


def message(channel_id: int, time: int, payload: bytes, sequence: int = 0, publish_time: int | None = None) -> bytes:
    published = time if publish_time is None else publish_time
    return record(MESSAGE, struct.pack("<HIQQ", channel_id, sequence, time, published) + payload)


def packed(compression: str, content: bytes) -> bytes:
    """Return the compressed content."""
    if compression == "zstd":
        return zstandard.ZstdCompressor(level=1).compress(content)
    if compression == "lz4":
        return lz4.frame.compress(content, store_size=False)
    return content


def chunk(
    content: bytes,
    times: tuple[int, int] = (0, 0),
    compression: str = "",
    *,
    crc: int | None = None,
    size: int | None = None,
    data: bytes | None = None,
    data_size: int | None = None,
    extra: bytes = b"",
    named: str | bytes | None = None,
) -> bytes:
    """Return a chunk; `crc`, uncompressed `size`, `data`, `data_size` and the compression's name may be false."""
    compressed = packed(compression, content) if data is None else data
    crc = zlib.crc32(content) if crc is None else crc
    body = struct.pack("<QQQI", *times, len(content) if size is None else size, crc)
    body += text(compression if named is None else named)
    body += struct.pack("<Q", len(compressed) if data_size is None else data_size) + compressed + extra
    return record(CHUNK, body)


def message_index(channel_id: int, entries: Iterable[tuple[int, int]]) -> bytes:
    body = b"".join(struct.pack("<QQ", time, offset) for time, offset in entries)
    return record(MESSAGE_INDEX, struct.pack("<HI", channel_id, len(body)) + body)


def chunk_index(
    times: tuple[int, int],
    start: int,
    length: int,
    offsets: Mapping[int, int],
    index_length: int,
    compression: str,
    sizes: tuple[int, int],
) -> bytes:
    """Return a chunk index; `sizes` are the compressed and the uncompressed size."""
    table = b"".join(struct.pack("<HQ", number, offset) for number, offset in offsets.items())
    body = struct.pack("<QQQQI", *times, start, length, len(table)) + table
    return record(CHUNK_INDEX, body + struct.pack("<Q", index_length) + text(compression) + struct.pack("<QQ", *sizes))


def statistics(
    messages: int, schemas: int, channels: int, chunks: int, times: tuple[int, int], counts: Mapping[int, int]
) -> bytes:
    table = b"".join(struct.pack("<HQ", number, count) for number, count in counts.items())
    body = struct.pack("<QHIIIIQQI", messages, schemas % 65536, channels, 0, 0, chunks, *times, len(table))
    return record(STATISTICS, body + table)


def attachment(name: str, data: bytes, crc: int | None = None) -> bytes:
    body = struct.pack("<QQ", 1, 2) + text(name) + text("text/plain") + struct.pack("<Q", len(data)) + data
    return record(ATTACHMENT, body + struct.pack("<I", zlib.crc32(body) if crc is None else crc))


def metadata(name: str, values: Mapping[str, str]) -> bytes:
    return record(METADATA, text(name) + texts(values))


def data_end(crc: int = 0, extra: bytes = b"") -> bytes:
    return record(DATA_END, struct.pack("<I", crc) + extra)


def ending(summary: bytes, start: int, with_crc: bool = True) -> bytes:
    """Return summary section (starting at byte `start`), footer and magic bytes."""
    body = struct.pack("<QQ", start if summary else 0, 0)
    prefix = struct.pack("<BQ", FOOTER, 20)
    crc = zlib.crc32(summary + prefix + body) if with_crc else 0
    return summary + prefix + body + struct.pack("<I", crc) + MAGIC
