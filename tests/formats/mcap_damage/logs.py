"""Undamaged files of the `mcap` package, with the positions of all records."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from io import BytesIO

import lz4.frame
import numpy as np
import zstandard
from mcap.writer import CompressionType, IndexType, Writer

from tests.formats.mcap_damage import records
from tests.formats.mcap_damage.draft import COMPRESSIONS, pick
from tests.formats.mcap_damage.messages import DEFINITIONS, ordinary
from tests.formats.mcap_damage.truth import Message

_KINDS = {"": CompressionType.NONE, "lz4": CompressionType.LZ4, "zstd": CompressionType.ZSTD}


@dataclass(frozen=True)
class Style:
    """The options with which a file is written."""

    compression: str = "zstd"
    chunked: bool = True
    crcs: bool = True
    data_crc: bool = False
    summary: bool = True
    indexed: bool = True

    def __str__(self) -> str:
        marks = {"unchunked": not self.chunked, "without CRCs": not self.crcs, "data CRC": self.data_crc}
        marks |= {"no summary": not self.summary, "no indexes": not self.indexed}
        return ", ".join([self.compression or "none", *(mark for mark, holds in marks.items() if holds)])


@dataclass(frozen=True)
class Span:
    """A record of the top level: data[start:end]; for a chunk also the positions of its fields, and its messages."""

    opcode: int
    start: int
    end: int
    messages: tuple[Message, ...] = ()
    name_at: int = 0  # the compression's length
    data_at: int = 0  # the compressed records

    def __contains__(self, at: int) -> bool:
        return self.start <= at < self.end


@dataclass(frozen=True)
class Log:
    """An undamaged file, its messages in order, and its records."""

    style: Style
    data: bytes
    messages: tuple[Message, ...]
    spans: tuple[Span, ...]

    @property
    def chunks(self) -> list[Span]:
        """Return the chunks."""
        return [span for span in self.spans if span.opcode == records.CHUNK]

    def span(self, at: int) -> Span | None:
        """Return the record that contains byte `at`; None for the magic bytes."""
        return next((span for span in self.spans if at in span), None)

    def opens(self, at: int) -> bool:
        """Return whether byte `at` is a record's opcode."""
        return any(span.start == at for span in self.spans)

    @property
    def data_end(self) -> int:
        """Return the byte where the data end record starts."""
        return next(span.start for span in self.spans if span.opcode == records.DATA_END)


def style(rng: np.random.Generator) -> Style:
    """Return random options: each compression equally often; usually chunked, with CRCs and a summary, like loggers."""
    compression = pick(rng, COMPRESSIONS)
    chunked = bool(rng.random() < 0.85)
    crcs, data_crc, summary, indexed = (rng.random(4) < (0.8, 0.25, 0.7, 0.85)).tolist()
    return Style(compression if chunked else "", chunked, crcs, data_crc, summary, indexed)


def write(rng: np.random.Generator, style: Style, count: int = 96, chunk_size: int = 700, filler: int = 0) -> Log:
    """Return a file of `count` messages in this style; JSON messages have `filler` more random letters."""
    messages = ordinary(rng, count)
    if filler:
        messages = [_longer(message, rng, filler) for message in messages]
    file = BytesIO()
    writer = Writer(
        file,
        chunk_size=chunk_size,
        compression=_KINDS[style.compression],
        index_types=_indexes(style),
        repeat_channels=style.summary,
        repeat_schemas=style.summary,
        use_chunking=style.chunked,
        use_statistics=style.summary,
        use_summary_offsets=style.summary,
        enable_crcs=style.crcs,
        enable_data_crcs=style.data_crc,
    )
    writer.start()
    numbers = {}
    for topic, known in DEFINITIONS.items():
        schema = known.schema
        if schema:
            schema = writer.register_schema(known.schema_name, known.schema_encoding, known.schema_data)
        numbers[topic] = writer.register_channel(topic, known.encoding, schema)
    for i, message in enumerate(messages):
        writer.add_message(numbers[message.topic], message.time, message.payload, message.time, i)
        if i == count // 2:
            writer.add_attachment(1, 2, "notes.txt", "text/plain", b"oil changed")
            writer.add_metadata("machine", {"name": "gate", "note": "cold"})
    writer.finish()
    data = file.getvalue()
    return Log(style, data, tuple(messages), tuple(_spans(data, messages)))


def span_of_any_kind(rng: np.random.Generator, log: Log) -> Span:
    """Return a record of a randomly chosen kind, so that rare kinds occur as often as messages."""
    kind = pick(rng, sorted({span.opcode for span in log.spans}))
    return pick(rng, [span for span in log.spans if span.opcode == kind])


def inner(content: bytes) -> Iterator[tuple[int, int, int]]:
    """Yield (opcode, start, end) of the complete records in a chunk's content."""
    at = 0
    while at + 9 <= len(content):
        opcode, length = struct.unpack_from("<BQ", content, at)
        if at + 9 + length > len(content):
            return
        yield opcode, at, at + 9 + length
        at += 9 + length


def unpacked(compression: str, data: bytes) -> bytes:
    """Return the decompressed part of a chunk's data, which may be cut off."""
    if compression == "zstd":
        return zstandard.ZstdDecompressor().decompressobj().decompress(data)
    return lz4.frame.LZ4FrameDecompressor().decompress(data) if compression == "lz4" else data


def _indexes(style: Style) -> IndexType:
    if not style.indexed:
        return IndexType.NONE
    return IndexType.ALL if style.summary else IndexType.MESSAGE


def _longer(message: Message, rng: np.random.Generator, filler: int) -> Message:
    if message.topic != "/state":
        return message
    letters = bytes(rng.integers(97, 123, filler, dtype=np.uint8))
    payload = message.payload.replace(b"up, down", letters)
    return Message(message.topic, message.time, payload, message.value)


def _spans(data: bytes, messages: list[Message]) -> Iterator[Span]:
    at, count = len(records.MAGIC), 0
    while at < len(data) - len(records.MAGIC):
        opcode, length = struct.unpack_from("<BQ", data, at)
        end = at + 9 + length
        if opcode == records.CHUNK:
            name_at = at + 9 + 28
            (name,) = struct.unpack_from("<I", data, name_at)
            data_at = name_at + 4 + name + 8
            content = unpacked(data[name_at + 4 : name_at + 4 + name].decode(), data[data_at:end])
            in_chunk = sum(kind == records.MESSAGE for kind, _, _ in inner(content))
            yield Span(opcode, at, end, tuple(messages[count : count + in_chunk]), name_at, data_at)
            count += in_chunk
        elif opcode == records.MESSAGE:
            yield Span(opcode, at, end, (messages[count],))
            count += 1
        else:
            yield Span(opcode, at, end)
        at = end
