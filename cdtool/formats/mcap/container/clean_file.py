"""Writing what is left of a file: messages byte for byte, in new chunks with indexes, CRCs and a summary.

The records are the `mcap` package's; its writer is not used, as it puts a CRC on all chunks or on none.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import IO, Any

import numpy as np
from mcap import records as written
from mcap.data_stream import RecordBuilder

from cdtool.formats.mcap.container.checksums import crc32
from cdtool.formats.mcap.container.log import Messages
from cdtool.formats.mcap.container.records import MAGIC, AttachmentIndex, Metadata

_HEADER = 31  # opcode, length, channel id, sequence, two times: what stands before a payload


class CleanFile:
    """A file under way; `finish` makes it whole. Uncovered chunks carry no CRC, and then neither does the summary."""

    def __init__(self, file: IO[bytes], profile: str = "") -> None:
        import zstandard

        self._file = file
        self._compressor = zstandard.ZstdCompressor()
        self._schemas: dict[int, written.Schema] = {}
        self._channels: dict[int, written.Channel] = {}
        self._defined: set[int] = set()  # channels, in any chunk
        self._covered: set[int] = set()  # channels, in a chunk with a CRC
        self._indexes: list[written.ChunkIndex] = []
        self._attachments: list[written.AttachmentIndex] = []
        self._metadata: list[written.MetadataIndex] = []
        self._counts: dict[int, int] = {}
        self._times: list[tuple[int, int]] = []
        self._unverified = False
        file.write(MAGIC)
        self._write(written.Header(profile=profile, library="cdtool"))

    def add_messages(self, messages: Sequence[Messages], covered: bool) -> None:
        """One chunk of them, in the order of the file they come from; without a CRC where none covered them."""
        builder = RecordBuilder()
        for item in messages:
            self._define(item, builder, covered)
        content = [_end(builder)]
        offset = len(content[0])
        entries: dict[int, list[tuple[int, int]]] = {item.stream.id: [] for item in messages}
        for start, length, time, channel, data in _in_file_order(messages):
            content.append(bytes(data[start - _HEADER : start + length]))
            entries[channel].append((time, offset))
            offset += _HEADER + length
        self._chunk(b"".join(content), entries, covered)

    def add_attachment(self, record: Iterable[bytes], index: AttachmentIndex) -> None:
        """An attachment's record as it stood, in pieces, and what an index told of it there."""
        self._attachments.append(written.AttachmentIndex(**(vars(index) | {"offset": self._file.tell()})))
        for piece in record:
            self._file.write(piece)

    def add_metadata(self, metadata: Metadata) -> None:
        """A metadata record."""
        at = self._file.tell()
        self._write(written.Metadata(name=metadata.name, metadata=dict(metadata.metadata)))
        self._metadata.append(written.MetadataIndex(offset=at, length=self._file.tell() - at, name=metadata.name))

    def finish(self) -> None:
        """Data end, summary, footer."""
        self._write(written.DataEnd(data_section_crc=0))
        start = self._file.tell()
        builder = RecordBuilder()
        offsets: list[written.SummaryOffset] = []
        for group in (
            list(self._schemas.values()),
            list(self._channels.values()),
            [self._statistics()],
            self._indexes,
            self._attachments,
            self._metadata,
        ):
            begin = builder.count
            for record in group:
                builder.write(_bytes(record))
            if group:
                opcode = _bytes(group[0])[0]
                offsets.append(written.SummaryOffset(opcode, begin + start, builder.count - begin))
        offset_start = start + builder.count
        section = _end(builder) + b"".join(map(_bytes, offsets))
        self._file.write(section)
        end = _bytes(written.Footer(summary_start=start, summary_offset_start=offset_start, summary_crc=0))
        # The summary's CRC would cover definitions that no CRC covered.
        crc = 0 if self._unverified else crc32(end[:-4], crc32(section))
        self._file.write(end[:-4] + crc.to_bytes(4, "little") + MAGIC)

    def _define(self, item: Messages, builder: RecordBuilder, covered: bool) -> None:
        """Schema and channel in the chunk of their first messages, and of the first ones that a CRC covers."""
        channel, schema = item.stream.channel, item.stream.schema
        known = self._covered if covered else self._defined
        if channel.id in known:
            return
        known.add(channel.id)
        self._defined.add(channel.id)
        if schema is not None:
            self._schemas[schema.id] = written.Schema(**vars(schema))
            self._schemas[schema.id].write(builder)
        self._channels[channel.id] = written.Channel(**vars(channel))
        self._channels[channel.id].write(builder)

    def _chunk(self, content: bytes, entries: dict[int, list[tuple[int, int]]], covered: bool) -> None:
        packed = self._compressor.compress(content)
        times = [time for found in entries.values() for time, _ in found]
        span = (min(times), max(times))
        self._times.append(span)
        self._unverified = self._unverified or not covered
        at = self._file.tell()
        self._write(
            written.Chunk(
                compression="zstd",
                data=packed,
                message_start_time=span[0],
                message_end_time=span[1],
                uncompressed_crc=crc32(content) if covered else 0,
                uncompressed_size=len(content),
            )
        )
        end = self._file.tell()
        places = {}
        for channel, found in entries.items():
            places[channel] = self._file.tell()
            self._counts[channel] = self._counts.get(channel, 0) + len(found)
            self._write(written.MessageIndex(channel_id=channel, records=found))
        self._indexes.append(
            written.ChunkIndex(
                chunk_length=end - at,
                chunk_start_offset=at,
                compression="zstd",
                compressed_size=len(packed),
                message_end_time=span[1],
                message_index_length=self._file.tell() - end,
                message_index_offsets=places,
                message_start_time=span[0],
                uncompressed_size=len(content),
            )
        )

    def _statistics(self) -> written.Statistics:
        return written.Statistics(
            attachment_count=len(self._attachments),
            channel_count=len(self._channels),
            channel_message_counts=self._counts,
            chunk_count=len(self._indexes),
            message_count=sum(self._counts.values()),
            message_end_time=max((end for _, end in self._times), default=0),
            message_start_time=min((start for start, _ in self._times), default=0),
            metadata_count=len(self._metadata),
            schema_count=len(self._schemas),
        )

    def _write(self, record: Any) -> None:
        self._file.write(_bytes(record))


def _bytes(record: Any) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    return _end(builder)


def _end(builder: RecordBuilder) -> bytes:
    content: bytes = builder.end()  # type: ignore[no-untyped-call]
    return content


def _in_file_order(messages: Sequence[Messages]) -> Iterable[tuple[int, int, int, int, Any]]:
    """Start and length of the payload, log time, channel id, memory of every message; all share one piece of memory."""
    batches = [item.batch for item in messages]
    starts = np.concatenate([batch.start for batch in batches])
    order = np.argsort(starts, kind="stable")
    channels = np.repeat([item.stream.id for item in messages], [len(batch) for batch in batches])
    lengths = np.concatenate([batch.length for batch in batches])[order].tolist()
    times = np.concatenate([batch.log_time for batch in batches])[order].tolist()
    data = batches[0].data
    rows = zip(starts[order].tolist(), lengths, times, channels[order].tolist(), strict=True)
    return ((start, length, time, channel, data) for start, length, time, channel in rows)
