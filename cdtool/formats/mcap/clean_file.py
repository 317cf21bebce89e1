"""Write the recovered messages of a file unchanged, by the writer of the `mcap` package.

The package writes a CRC for every chunk or for none: those of chunks without verified messages are cleared afterwards.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import IO, Any

import numpy as np
from mcap.records import Attachment
from mcap.writer import Writer

from cdtool.formats.bags.topic_log import Messages
from cdtool.formats.mcap.definitions import DefinedStream
from cdtool.formats.mcap.records import MAGIC, PREFIX

# Bytes from the start of a chunk to its CRC: prefix, two times, size.
_CHUNK_CRC = PREFIX + 24


class CleanFile:
    """An MCAP file that is being written; `finish` completes it.

    Chunks of messages without a CRC are written without a CRC, and in that case the summary, too.
    """

    def __init__(self, file: IO[bytes], profile: str = "") -> None:
        self._file = file
        self._writer: Any = Writer(file, chunk_size=2**63)
        self._schemas: dict[tuple[int, bool], int] = {}
        self._channels: dict[tuple[int, bool], int] = {}
        self._unverified = False
        self._writer.start(profile, "cdtool")

    def add_messages(self, messages: Sequence[Messages], covered: bool) -> None:
        """Write messages as one chunk, in the order of their file; without a CRC if they are not `covered` by one."""
        begin = self._file.tell()
        channels = [self._channel(item.stream, covered) for item in messages]
        which = np.repeat(np.arange(len(messages)), [len(item.batch) for item in messages])
        row = np.concatenate([np.arange(len(item.batch)) for item in messages])
        order = np.argsort(np.concatenate([item.batch.start for item in messages]), kind="stable")
        headers = [
            list(zip(*(each.tolist() for each in (batch.log_time, batch.publish_time, batch.sequence)), strict=True))
            for batch in (item.batch for item in messages)
        ]
        for number, index in zip(which[order].tolist(), row[order].tolist(), strict=True):
            logged, published, sequence = headers[number][index]
            payload = messages[number].batch.payload(index)
            self._writer.add_message(channels[number], logged, payload, published, sequence)
        self._writer.flush()
        if not covered:
            self._clear(begin + _CHUNK_CRC)
        self._unverified = self._unverified or not covered

    def add_attachment(self, content: Attachment, covered: bool) -> None:
        """Write an attachment; without a CRC if its own is not `covered` by one."""
        self._writer.add_attachment(
            content.create_time, content.log_time, content.name, content.media_type, content.data
        )
        if not covered:
            self._clear(self._file.tell() - 4)

    def add_metadata(self, name: str, texts: dict[str, str]) -> None:
        """Write a metadata record."""
        self._writer.add_metadata(name, texts)

    def finish(self) -> None:
        """Write data end, summary and footer."""
        self._writer.finish()
        if self._unverified:  # a CRC of the summary would also cover definitions that no CRC covered before
            self._clear(self._file.tell() - len(MAGIC) - 4)

    def _channel(self, stream: object, covered: bool) -> int:
        """Return the number of a channel in this file: one that a CRC covers, or one of its own without a CRC."""
        assert isinstance(stream, DefinedStream), "the messages are those of an MCAP file"
        covered = covered or (stream.id, True) in self._channels
        channel, schema, number = stream.channel, stream.schema, 0
        if (stream.id, covered) not in self._channels:
            if schema is not None:
                key = schema.id, covered
                if key not in self._schemas:
                    self._schemas[key] = self._writer.register_schema(schema.name, schema.encoding, schema.data)
                number = self._schemas[key]
            self._channels[stream.id, covered] = self._writer.register_channel(
                channel.topic, channel.message_encoding, number, channel.metadata
            )
        return self._channels[stream.id, covered]

    def _clear(self, crc: int) -> None:
        """Write 0, which stands for "no CRC", in place of the CRC at this byte."""
        end = self._file.tell()
        self._file.seek(crc)
        self._file.write(bytes(4))
        self._file.seek(end)
