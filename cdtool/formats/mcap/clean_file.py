"""Write the recovered messages of a file unchanged, in new chunks with indexes, CRCs and a summary.

The records are those of the `mcap` package. Its writer is not used because it writes CRCs for all chunks or for none.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import IO, Any

import numpy as np
from mcap import records as written
from mcap.data_stream import RecordBuilder

from cdtool.formats.mcap.definitions import DefinedStream
from cdtool.formats.mcap.records import MAGIC, crc32
from cdtool.formats.topic_log import Messages

_HEADER = 31  # bytes before a payload: opcode, length, channel id, sequence, two times


class CleanFile:
    """An MCAP file that is being written; `finish` completes it.

    Chunks of messages without a CRC are written without a CRC, and in that case the summary, too.
    """

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
        """Write messages as one chunk, in the order of their file; without a CRC if they are not `covered` by one."""
        builder = RecordBuilder()
        for channel_messages in messages:
            self._define(channel_messages, builder, covered)
        content = [_end(builder)]
        offset = len(content[0])
        entries: dict[int, list[tuple[int, int]]] = {channel_messages.stream.id: [] for channel_messages in messages}
        for start, length, time, channel, data in _in_file_order(messages):
            content.append(bytes(data[start - _HEADER : start + length]))
            entries[channel].append((time, offset))
            offset += _HEADER + length
        self._chunk(b"".join(content), entries, covered)

    def add_attachment(self, record: Iterable[bytes], index: written.AttachmentIndex) -> None:
        """Write an attachment's record unchanged, in pieces, and add it to the index; `index` is its previous entry."""
        self._attachments.append(replace(index, offset=self._file.tell()))
        for piece in record:
            self._file.write(piece)

    def add_metadata(self, metadata: written.Metadata) -> None:
        """Write a metadata record and add it to the index."""
        at = self._file.tell()
        self._write(metadata)
        self._metadata.append(written.MetadataIndex(offset=at, length=self._file.tell() - at, name=metadata.name))

    def finish(self) -> None:
        """Write data end, summary and footer."""
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
        # A CRC of the summary would also cover definitions that no CRC covered before.
        crc = 0 if self._unverified else crc32(end[:-4], crc32(section))
        self._file.write(end[:-4] + crc.to_bytes(4, "little") + MAGIC)

    def _define(self, channel_messages: Messages, builder: RecordBuilder, covered: bool) -> None:
        """Write schema and channel to the chunk of their first messages, and of the first messages with a CRC."""
        stream = channel_messages.stream
        assert isinstance(stream, DefinedStream), "the messages are those of an MCAP file"
        channel, schema = stream.channel, stream.schema
        known = self._covered if covered else self._defined
        if channel.id in known:
            return
        known.add(channel.id)
        self._defined.add(channel.id)
        if schema is not None:
            self._schemas[schema.id] = schema
            self._schemas[schema.id].write(builder)
        self._channels[channel.id] = channel
        self._channels[channel.id].write(builder)

    def _chunk(self, content: bytes, entries: dict[int, list[tuple[int, int]]], covered: bool) -> None:
        packed = self._compressor.compress(content)
        times = [time for of_channel in entries.values() for time, _ in of_channel]
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
        offsets = {}
        for channel, of_channel in entries.items():
            offsets[channel] = self._file.tell()
            self._counts[channel] = self._counts.get(channel, 0) + len(of_channel)
            self._write(written.MessageIndex(channel_id=channel, records=of_channel))
        self._indexes.append(
            written.ChunkIndex(
                chunk_length=end - at,
                chunk_start_offset=at,
                compression="zstd",
                compressed_size=len(packed),
                message_end_time=span[1],
                message_index_length=self._file.tell() - end,
                message_index_offsets=offsets,
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
    """Return payload start and length, log time, channel id and memory of every message; all share one memory block."""
    batches = [channel_messages.batch for channel_messages in messages]
    starts = np.concatenate([batch.start for batch in batches])
    order = np.argsort(starts, kind="stable")
    channels = np.repeat(
        [channel_messages.stream.id for channel_messages in messages], [len(batch) for batch in batches]
    )
    lengths = np.concatenate([batch.length for batch in batches])[order].tolist()
    times = np.concatenate([batch.log_time for batch in batches])[order].tolist()
    data = batches[0].data
    rows = zip(starts[order].tolist(), lengths, times, channels[order].tolist(), strict=True)
    return ((start, length, time, channel, data) for start, length, time, channel in rows)
