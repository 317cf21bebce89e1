"""Read the data section (section "Data Section" of the specification) from start to end, also if it is damaged.

A chunk whose CRC does not match is lost as a whole. After bytes that cannot be a record, reading continues at the next
chunk, which is located by the summary if its CRC matches, or else by the consistency of its header. If the file's end
cuts off a chunk, the part that can be decompressed is returned as not covered by a CRC.

Check attachments (op=0x09) in pieces, so that a large attachment does not need memory.
"""

from __future__ import annotations

import struct
from bisect import bisect_left, bisect_right
from collections import Counter
from collections.abc import Generator, Iterator

import numpy as np
import numpy.typing as npt

from cdtool.base.files.bounded_loading import MIB
from cdtool.formats.bags.topic_log import Messages
from cdtool.formats.mcap import messages
from cdtool.formats.mcap.chunks import (
    HEADER_LENGTH,
    Bytes,
    ChunkHeader,
    ClaimedSizes,
    chunk_header,
    unpack,
    unpack_available,
)
from cdtool.formats.mcap.definitions import Definitions
from cdtool.formats.mcap.file_bytes import FileBytes
from cdtool.formats.mcap.losses import Loss, Losses
from cdtool.formats.mcap.messages import Positions, Walk
from cdtool.formats.mcap.records import LARGEST, MAGIC, PREFIX, DamageError, Opcode, RefusedError, parse, record_length
from cdtool.formats.mcap.summary import McapSummary, matches_header


def check_attachment(file: FileBytes, at: int, length: int, *, with_crc: bool = True) -> None:
    """Check the attachment record of `length` bytes at byte `at`, its content `with_crc`; raises DamageError."""
    head = file.read(at + PREFIX, min(length - PREFIX, 1 << 17))  # two texts
    try:
        offset = 16  # after two times
        for _ in range(2):
            (size,) = struct.unpack_from("<I", head, offset)
            struct.unpack_from(f"<{size}s", head, offset + 4)[0].decode()
            offset += 4 + size
        (size,) = struct.unpack_from("<Q", head, offset)
    except (struct.error, UnicodeDecodeError) as fault:
        raise DamageError(f"an attachment of {length} bytes ends within its name, or it is not UTF-8") from fault
    end = at + PREFIX + offset + 8 + size
    if end + 4 > at + length:
        raise DamageError("the declared data size of an attachment exceeds its record")
    stated = int.from_bytes(file.read(end, 4), "little") if with_crc else 0
    if stated and stated != file.crc(at + PREFIX, end):
        raise DamageError("the checksum of an attachment does not match")


# Chunks are joined up to this size [bytes]: messages of many small ones are then decoded together.
JOINED = 1 << 23
_SPARE = 8  # bytes after the last message in memory, so that all messages can be gathered in whole words
_OUTSIDE_CHUNKS = (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE)
Block = list[Messages]
_INDEX_HEAD = PREFIX + 6  # before the entries of a message index: prefix, channel id, length of the entries


class DataSection:
    """Reader of the data section, with its chunks by byte, extras, the end record and losses.

    Chunks without a wanted topic, at the bytes `unwanted`, are not read if what follows them agrees with the summary;
    `skipped` are their messages by channel. `extras` are (opcode, byte, length) of complete attachments and metadata;
    `first_time` [ns] is the log time of the first message with a valid one.
    """

    def __init__(self, file: FileBytes, summary: McapSummary, definitions: Definitions, unwanted: set[int]) -> None:
        self.losses = Losses()
        self.chunks: dict[int, ChunkHeader] = {}
        self.extras: dict[tuple[int, int, int], None] = {}
        self.data_crc = 0  # that the end record states
        self.end_at, self.is_ended = 0, False
        self.first_time: int | None = None
        self._file, self._summary, self._definitions, self._unwanted = file, summary, definitions, unwanted
        self.skipped: Counter[int] = Counter()
        self._memory = np.empty(0, np.uint8)
        self._size, self._covered = 0, False  # of what is in memory
        self._found: list[Positions] = []
        self._claims = ClaimedSizes()
        self._resync = Resync(file, summary)
        self._lost: Loss | None = None  # a lost chunk whose message indexes may follow

    def blocks(self) -> Iterator[Block]:
        """Yield all messages that can be read, channel by channel in each memory block."""
        yield from self._records()
        yield from self._flush()

    @property
    def is_partly_read(self) -> bool:
        """Return whether parts of a file at a URL are not read: a checksum of more than a chunk is not checked."""
        return self._file.is_ranged and bool(self._unwanted)

    def _records(self) -> Iterator[Block]:
        at = len(MAGIC)
        if bytes(self._file.read(0, at)) != MAGIC:
            self.losses.add(Loss(0, min(at, self._file.size), "the file does not start like an MCAP file"))
            self.losses.stopped = self._file.size <= at
        while not self.losses.stopped and not self.is_ended:
            self.end_at = at
            head = self._file.read(at, HEADER_LENGTH)
            try:
                if not len(head):
                    raise DamageError("the file ends without an end record")
                header = chunk_header(at, head)
                opcode = self._kind(head, header)
                if opcode == Opcode.CHUNK and header is not None and header.data + header.size > self._file.size:
                    yield from self._cut_chunk(header)
                    return
                length = record_length(at, head, self._file.size)
                if opcode == Opcode.FOOTER:
                    return
                if opcode in _OUTSIDE_CHUNKS:
                    at = yield from self._outside_chunks(at, length)
                elif opcode == Opcode.CHUNK and header is not None:
                    at = yield from self._chunk(header)
                else:
                    self._other(opcode, at, length, head)
                    at += length
            except DamageError as fault:
                at = self._resume(at, str(fault))

    def _kind(self, head: memoryview, header: ChunkHeader | None) -> int:
        opcode = head[0]
        if opcode != Opcode.CHUNK and header is not None and header.consistent:
            self.losses.add(Loss(header.at, 1, f"a chunk is marked as a record of kind {opcode}"))
            return Opcode.CHUNK
        if opcode == Opcode.CHUNK and header is None and len(head) == HEADER_LENGTH:
            raise DamageError("the name of a chunk's compression is damaged")
        return opcode

    def _resume(self, at: int, reason: str) -> int:
        begin, following = self._resync.after(at)
        end = self._file.size if following is None else following
        self.losses.stopped = following is None
        self.losses.add(Loss(begin, end - begin, reason))
        return end

    def _chunk(self, header: ChunkHeader) -> Generator[Block, None, int]:
        """Yield blocks that are full, and return the byte after the chunk and its message indexes."""
        self._lost = None
        self.chunks[header.at] = header
        end = header.at + header.length
        if header.at in self._unwanted and self._is_indexed(header):
            self._resync.verified_to = end
            return self._indexed(end, 0)[1]
        self._resync.verified_to = header.at + 1
        try:
            header.check()
            self._claims.add(header)
            yield from self._make_room(header.uncompressed_size, header.uncompressed_crc != 0)
            content = self._memory[self._size : self._size + header.uncompressed_size]
            unpack(header, self._file.array(header.data, header.size), content)
        except DamageError as fault:
            loss = Loss.of_chunk(header, self._summary, str(fault), refused=isinstance(fault, RefusedError))
            self._lost = self.losses.add(loss)
            return end
        self._resync.verified_to = end
        indexed, end = self._indexed(end, header.uncompressed_size)
        walked = messages.walk_by_indexes(content, indexed)
        self._add(content, walked, header.at)
        if walked.reason:
            self.losses.add(Loss(header.at, len(content) - walked.end, f"in a chunk: {walked.reason}"))
        return end

    def _is_indexed(self, header: ChunkHeader) -> bool:
        """Return whether header and message indexes of a chunk are those of the summary, and count its messages."""
        index = self._summary.chunks[header.at]
        found = list(self._indexes(header.at + header.length))
        is_same = {channel: at for at, channel, _, _ in found} == index.message_index_offsets
        if is_same and matches_header(index, header):
            self.skipped.update({channel: size // 16 for _, channel, size, _ in found})
            return True
        return False

    def _indexes(self, at: int) -> Iterator[tuple[int, int, int, int]]:
        """Yield first byte, channel, size of the entries and length of the message indexes from byte `at` on.

        One that overlaps the next chunk is left to `_other`.
        """
        limit = self._resync.following(at)
        while True:
            head = self._file.read(at, _INDEX_HEAD)
            if len(head) < _INDEX_HEAD or head[0] != Opcode.MESSAGE_INDEX:
                return
            length, channel, size = (
                PREFIX + int.from_bytes(head[1:PREFIX], "little"),
                *struct.unpack("<HI", head[PREFIX:]),
            )
            if at + length > limit or _INDEX_HEAD + size > length:
                return
            yield at, channel, size, length
            at += length

    def _indexed(self, at: int, chunk_size: int) -> tuple[Positions, int]:
        """Return the bytes that the message indexes from byte `at` on state, and the byte after these indexes.

        Without the chunk's size they are only skipped. An entry is smaller than its message: a longer index is left to
        `_other`.
        """
        stated: list[Positions] = []
        for start, _, size, length in self._indexes(at):
            if chunk_size:
                if size > chunk_size:
                    break
                entries = self._file.array(start + _INDEX_HEAD, size - size % 16).view("<u8").reshape(-1, 2)
                stated.append(np.minimum(entries[:, 1], chunk_size).astype(np.int64))
            at = start + length
        return np.concatenate([np.empty(0, np.int64), *stated]), at

    def _cut_chunk(self, header: ChunkHeader) -> Iterator[Block]:
        """Yield the messages before the cut of a chunk that the end of the file cuts off."""
        left = self._file.size - header.data
        loss = Loss.of_chunk(header, self._summary, f"the file ends within a chunk: {left} of {header.size} bytes")
        loss.size, loss.time = self._file.size - header.at, None
        if not header.consistent:
            raise DamageError(f"a record declares {header.length - PREFIX} bytes, but only {left} are left")
        header.check()
        self.losses.stopped = True
        self.losses.add(loss)
        yield from self._make_room(header.uncompressed_size, covered=False)
        content = self._memory[self._size : self._size + header.uncompressed_size]
        try:
            content = content[: unpack_available(header, self._file.array(header.data, left), content)]
        except DamageError as fault:
            loss.reason = str(fault)
            return
        self._add(content, messages.walk(content), header.at)

    def _outside_chunks(self, at: int, length: int) -> Generator[Block, None, int]:
        """Yield the records outside of chunks that fit into a window, and return the byte after them."""
        if length > LARGEST:
            raise DamageError(f"a record declares {length - PREFIX} bytes, more than {LARGEST >> 20} MiB")
        size = min(max(MIB, length), self._file.size - at)
        yield from self._make_room(size, covered=False)
        window = self._memory[self._size : self._size + size]
        self._file.read_into(at, window)
        walked = messages.walk(window, top_level=True)
        self._add(window[: walked.end], walked, at)
        self._resync.verified_to = at + walked.end
        if walked.reason == messages.SHORT_MESSAGE:
            return self._resume(at + walked.end, walked.reason)
        return at + walked.end

    def _make_room(self, size: int, covered: bool) -> Iterator[Block]:
        """Make room in memory for `size` bytes; yield what is in it if these do not fit, or only one has a CRC."""
        if covered != self._covered or self._size + size + _SPARE > len(self._memory):
            yield from self._flush()
            self._memory = np.empty(max(JOINED, size + _SPARE), np.uint8)
        self._covered = covered

    def _add(self, content: Bytes, walked: Walk, at: int) -> None:
        """Add the messages of a chunk or window at byte `at`, which is the next in memory."""
        cuts = dict.fromkeys(self._definitions.ambiguous, 0)  # channels, and the byte from which on they are ambiguous
        for opcode, start, size in walked.definitions:
            try:
                self._definitions.add(opcode, content[start : start + size].tobytes(), self._covered)
            except DamageError as fault:
                self.losses.add(Loss(at, 0, f"a definition: {fault}"))
            for channel in self._definitions.ambiguous.keys() - cuts.keys():
                cuts[channel] = start
        records = walked.records
        if len(records):
            self._note_first_time(messages.log_times(content, records))
        for channel, cut in cuts.items():
            lost = (records >= cut) & (messages.channel_ids(content, records) == channel)
            if lost.any():
                self.losses.messages[self._definitions.ambiguous[channel]] += int(np.count_nonzero(lost))
                records = records[~lost]
        self._found.append(records + self._size)
        self._size += len(content)

    def _flush(self) -> Iterator[Block]:
        """Yield the messages in memory, and release the memory."""
        data, found = self._memory[: self._size + _SPARE], np.concatenate([np.empty(0, np.int64), *self._found])
        self._memory, self._size, self._found = np.empty(0, np.uint8), 0, []
        if len(found):
            yield list(self._by_stream(data, found))

    def _by_stream(self, data: Bytes, found: Positions) -> Iterator[Messages]:
        for channel, batch in messages.by_channel(data, found):
            try:
                stream = self._definitions.stream(channel)
            except DamageError as fault:
                self.losses.messages[str(fault)] += len(batch)
            else:
                yield Messages(stream, batch, self._covered and stream.covered)

    def _note_first_time(self, times: npt.NDArray[np.uint64]) -> None:
        """Set the first time; a valid one replaces an invalid one."""
        if self.first_time is None or self.first_time >= messages.NO_DATE:
            first = int(times[np.argmax(times < messages.NO_DATE)])
            if self.first_time is None or first < messages.NO_DATE:
                self.first_time = first

    def _other(self, opcode: int, at: int, length: int, head: memoryview) -> None:
        self._resync.check(at, length)
        if opcode == Opcode.MESSAGE_INDEX:
            if self._lost is not None and length >= _INDEX_HEAD:
                self._lost.messages = (self._lost.messages or 0) + int.from_bytes(head[11:15], "little") // 16
            return
        self._lost = None
        if opcode == Opcode.DATA_END:
            if self._summary.verified and self._resync.is_before_chunk(at):
                raise DamageError("the data section ends before chunks that the summary names")
            self.data_crc = parse(opcode, self._file.read(at + PREFIX, min(length - PREFIX, 64))).data_section_crc
            self.is_ended = True
        elif opcode in (Opcode.ATTACHMENT, Opcode.METADATA):
            try:
                if opcode == Opcode.ATTACHMENT:
                    check_attachment(self._file, at, length, with_crc=not self.is_partly_read)
                    self._resync.verified_to = at + length
                else:
                    parse(opcode, self._file.read(at + PREFIX, min(length - PREFIX, LARGEST)))
            except DamageError as fault:
                self.losses.add(Loss(at, length, str(fault)))
            else:
                self.extras[opcode, at, length] = None


class Resync:
    """Locates the byte where reading continues after damage.

    All bytes before `verified_to` were read, or verified by a CRC. A wrong length that no CRC covers may skip complete
    chunks; they are before the byte where the damage is detected, and after `verified_to`. The number of bytes to go
    back is limited, because a file may consist of such lengths.
    """

    def __init__(self, file: FileBytes, summary: McapSummary) -> None:
        self.verified_to = len(MAGIC)
        self._file = file
        self._known = sorted(summary.chunks) if summary.verified else []
        self._back = file.size  # the remaining number of bytes to go back

    def following(self, at: int) -> int:
        """Return the first byte from `at` where a verified summary names a chunk, or the file's end."""
        number = bisect_left(self._known, at)
        return self._known[number] if number < len(self._known) else self._file.size

    def is_before_chunk(self, at: int) -> bool:
        """Return whether there is a chunk after byte `at` that a verified summary names."""
        starts = self._known[bisect_right(self._known, at) : bisect_left(self._known, self._file.size)]
        return any(self._file.read(start, 1)[:1] == bytes([Opcode.CHUNK]) for start in starts)

    def check(self, at: int, length: int) -> None:
        """Raise DamageError if a record other than a chunk overlaps a chunk that a verified summary names."""
        following = self.following(at + 1)
        if following < min(at + length, self._file.size):
            header = chunk_header(following, self._file.read(following, HEADER_LENGTH))
            if header is not None and header.consistent:
                raise DamageError(f"a record of {length} bytes overlaps a chunk")

    def after(self, at: int) -> tuple[int, int | None]:
        """Return the first lost byte and the next chunk (None: no more), if no record starts at byte `at`."""
        chunk = self._next(self.verified_to)
        if chunk is not None and chunk <= at:
            self._back -= at - chunk
            if chunk == at or self._back < 0:
                chunk = self._next(at + 1)
        if chunk is None:
            return at, None
        begin, self.verified_to = min(at, self.verified_to) if chunk < at else at, chunk + 1
        return begin, chunk

    def _next(self, at: int) -> int | None:
        number = bisect_left(self._known, at)
        return self._known[number] if number < len(self._known) else next_chunk(self._file, at)


def next_chunk(file: FileBytes, at: int) -> int | None:
    """Return the first byte from `at` where a chunk may start: its sizes and its compression are consistent."""
    while at < file.size - HEADER_LENGTH:
        window = file.array(at, MIB + HEADER_LENGTH)
        last = len(window) - HEADER_LENGTH
        candidates = window[:last] == int(Opcode.CHUNK)
        for i in range(PREFIX - 4, PREFIX):  # a length below 4 GiB
            candidates &= window[i : i + last] == 0
        for offset in np.flatnonzero(candidates).tolist():
            header = chunk_header(at + offset, window[offset : offset + HEADER_LENGTH].data)
            if header is not None and header.consistent and header.size <= LARGEST:
                return header.at
        at += MIB
    return None
