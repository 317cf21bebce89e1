"""The records of an MCAP file, from the front to the end, so that every CRC is checked and a cut file gives its start.

The readers of the `mcap` package are not used, its record parsers are: the seeking reader verifies no more than the
chunks that it visits, and its streams hand back short reads without a word (a message cut in two would look whole).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import IO, Any

from cdtool.errors import RecordingError
from cdtool.recording import Finding

MAGIC = b"\x89MCAP0\r\n"
_PREFIX = 9  # opcode and length of a record


@dataclass(frozen=True)
class RawMessage:
    """One message as logged; times in ns."""

    log_time: int
    publish_time: int
    data: bytes
    channel: Any
    schema: Any


@dataclass
class Topic:
    """All channels of one topic: what they say of themselves, and the messages if they were asked for."""

    name: str
    schema: str
    encoding: str
    count: int = 0
    messages: list[RawMessage] = field(default_factory=list)


@dataclass
class Log:
    """What a file holds: its topics, the log time of its first message [ns], and what was found on the way."""

    topics: dict[str, Topic] = field(default_factory=dict)
    origin: int = 0
    count: int = 0
    findings: list[Finding] = field(default_factory=list)


def read_log(path: Path, wanted: Callable[[str], bool]) -> Log:
    """All topics of a file and the messages of the wanted ones; raises RecordingError if nothing can be read."""
    reader = _Reader(path, wanted)
    with path.open("rb") as file:
        try:
            reader.run(file, path.stat().st_size)
        except Exception as fault:  # whatever the parsers throw at damaged bytes is a damaged file
            reader.stopped(fault)
    return reader.finished()


class _DamageError(Exception):
    """A fault of the file that the parsers do not see."""


class _Whole:
    """A stream that gives all that is asked for or raises; the package takes a short read for a whole one."""

    def __init__(self, stream: IO[bytes], size: int) -> None:
        self.stream = stream
        self.left = size

    def read(self, length: int) -> bytes:
        if not 0 <= length <= self.left:
            raise _DamageError(f"a record claims {length} bytes where {self.left} are left")
        self.left -= length
        return self.stream.read(length)


class _Reader:
    def __init__(self, path: Path, wanted: Callable[[str], bool]) -> None:
        self.path = path
        self.wanted = wanted
        self.log = Log()
        self.schemas: dict[int, Any] = {}
        self.channels: dict[int, Any] = {}
        self.at = 0  # byte where the record under way begins
        self.unverified = 0  # messages that no CRC covered so far
        self.stated: int | None = None  # message count of the summary
        self.in_summary = False

    def run(self, file: IO[bytes], size: int) -> None:
        from mcap.data_stream import ReadDataStream
        from mcap.opcode import Opcode
        from mcap.records import DataEnd, Statistics

        stream = ReadDataStream(_Whole(file, size), calculate_crc=True)  # type: ignore[arg-type]
        if stream.read(len(MAGIC)) != MAGIC:
            raise _DamageError("the file does not begin as an MCAP file")
        while True:
            self.at = stream.count
            before = stream.checksum()
            if self.at == size:
                raise _DamageError("the file ends without an end record")
            opcode, body = _record(stream)
            if opcode == Opcode.DATA_END:
                self._data_end(DataEnd.read(_parser(body)).data_section_crc, before)
            elif opcode == Opcode.STATISTICS:
                self.stated = Statistics.read(_parser(body)).message_count
            elif opcode == Opcode.CHUNK:
                self._chunk(body)
            elif opcode == Opcode.FOOTER:
                if stream.read(len(MAGIC)) != MAGIC:
                    raise _DamageError("the file does not end as an MCAP file")
                return
            elif not self.in_summary:
                self.unverified += self._take(opcode, body)

    def _chunk(self, body: bytes) -> None:
        from mcap.data_stream import ReadDataStream
        from mcap.records import Chunk
        from mcap.stream_reader import get_chunk_data_stream

        chunk = Chunk.read(_parser(body))
        if chunk.compression not in ("", "zstd", "lz4"):  # the package would take it for uncompressed
            raise _DamageError(f"unknown compression '{chunk.compression}'")
        packed, size = get_chunk_data_stream(chunk, validate_crc=True)
        if size != chunk.uncompressed_size:
            raise _DamageError(f"a chunk of {size} bytes claims {chunk.uncompressed_size}")
        stream = ReadDataStream(_Whole(BytesIO(packed.read(size)), size))  # type: ignore[arg-type]
        while stream.count < size:
            taken = self._take(*_record(stream))
            if not chunk.uncompressed_crc:
                self.unverified += taken

    def _take(self, opcode: int, body: bytes) -> int:
        """Take a schema, channel or message; gives the number of messages."""
        from mcap.opcode import Opcode
        from mcap.records import Channel, Message, Schema

        if opcode == Opcode.SCHEMA:
            schema = Schema.read(_parser(body))
            if self.schemas.setdefault(schema.id, schema) != schema:
                raise _DamageError(f"schema {schema.id} '{schema.name}' is defined twice, differently")
        elif opcode == Opcode.CHANNEL:
            channel = Channel.read(_parser(body))
            if channel.schema_id and channel.schema_id not in self.schemas:
                raise _DamageError(f"channel '{channel.topic}' names schema {channel.schema_id}, which is not there")
            if self.channels.setdefault(channel.id, channel) != channel:
                raise _DamageError(f"channel {channel.id} '{channel.topic}' is defined twice, differently")
            self._topic(channel)
        elif opcode == Opcode.MESSAGE:
            self._message(Message.read(_parser(body), len(body)))
            return 1
        return 0

    def _topic(self, channel: Any) -> Topic:
        schema = self.schemas.get(channel.schema_id)
        name = schema.name if schema is not None else "no schema"
        return self.log.topics.setdefault(channel.topic, Topic(channel.topic, name, channel.message_encoding))

    def _message(self, message: Any) -> None:
        channel = self.channels.get(message.channel_id)
        if channel is None:
            raise _DamageError(f"a message names channel {message.channel_id}, which is not there")
        if self.log.count == 0:
            self.log.origin = message.log_time
        self.log.count += 1
        topic = self.log.topics[channel.topic]
        topic.count += 1
        if self.wanted(channel.topic):
            schema = self.schemas.get(channel.schema_id)
            raw = RawMessage(message.log_time, message.publish_time, message.data, channel, schema)
            topic.messages.append(raw)

    def _data_end(self, stated: int, actual: int) -> None:
        self.in_summary = True
        if stated == 0:
            return
        if stated != actual and self.unverified:
            raise RecordingError(
                f"{self.path}: the checksum of the data does not fit: values are damaged, and none can be told right",
                "copy the file anew from its source",
            )
        if stated != actual:
            raise _DamageError("the checksum of the data section does not fit (those of the chunks with messages do)")
        self.unverified = 0

    def stopped(self, fault: Exception) -> None:
        if isinstance(fault, RecordingError):
            raise fault
        reason = str(fault) if isinstance(fault, _DamageError) else f"{type(fault).__name__}: {fault}".strip(": ")
        reason = " ".join(reason.split())[:200]
        if self.log.count == 0:
            raise RecordingError(
                f"{self.path}: damaged at byte {self.at}, before its first message: {reason}",
                "copy the file anew; `mcap recover` may find more",
            ) from fault
        self.log.findings.append(
            Finding(
                f"damaged at byte {self.at} ({reason}): only the {self.log.count} messages before it were read",
                severity="loss",
            )
        )

    def finished(self) -> Log:
        log = self.log
        if self.stated is not None and self.stated != log.count:
            text = f"the file's summary says {self.stated} messages, {log.count} were read"
            log.findings.append(Finding(text, severity="loss"))
        if self.unverified:
            log.findings.append(
                Finding(f"{self.unverified} of {log.count} messages carry no checksum: unverified", severity="note")
            )
        if log.count == 0:
            log.findings.append(Finding("holds no message"))
        return log


def _record(stream: Any) -> tuple[int, bytes]:
    opcode = stream.read1()
    if opcode == 0:
        raise _DamageError("a record of kind 0, which there is not")
    return opcode, stream.read(stream.read8())


def _parser(body: bytes) -> Any:
    from mcap.data_stream import ReadDataStream

    return ReadDataStream(_Whole(BytesIO(body), len(body)))  # type: ignore[arg-type]
