"""Read the data section (section "Data Section" of the specification) from start to end, also if it is damaged.

A chunk whose CRC does not match is lost as a whole. After bytes that cannot be a record, reading continues at the next
chunk, which is located by the summary if its CRC matches, or else by the consistency of its header. If the file's end
cuts off a chunk, the part that can be decompressed is returned as not covered by a CRC.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Generator, Iterator, Mapping
from itertools import pairwise

import numpy as np

from cdtool.formats.mcap.container import walk_kernel
from cdtool.formats.mcap.container.arena import Arena, MessageBlock, WalkResult
from cdtool.formats.mcap.container.attachments import check_attachment
from cdtool.formats.mcap.container.chunk_read_ahead import JOINED, CheckedChunk, ChunkReadAhead
from cdtool.formats.mcap.container.chunks import (
    HEADER_LENGTH,
    LARGEST,
    ChunkHeader,
    ClaimedSizes,
    Decompressor,
    chunk_header,
)
from cdtool.formats.mcap.container.damage import DamageError, RefusedError
from cdtool.formats.mcap.container.definitions import Definitions
from cdtool.formats.mcap.container.file_bytes import FileBytes
from cdtool.formats.mcap.container.losses import Loss, Losses
from cdtool.formats.mcap.container.records import (
    MAGIC,
    PREFIX,
    Attachment,
    Channel,
    Chunk,
    DataEnd,
    Footer,
    Message,
    MessageIndex,
    Metadata,
    Schema,
)
from cdtool.formats.mcap.container.skippable_chunks import only_message_indexes, only_message_indexes_between
from cdtool.formats.mcap.container.summary import Summary, matches_header
from cdtool.formats.mcap.container.walk_kernel import Bytes

_SMALLEST_WINDOW, _LARGEST_WINDOW = 1 << 16, 1 << 22
_OUTSIDE_CHUNKS = (Schema.opcode, Channel.opcode, Message.opcode)
_NO_KIND = "a record of kind 0, which does not exist"
_REASONS = {
    walk_kernel.NO_KIND: _NO_KIND,
    walk_kernel.TOO_LONG: "a record declares more bytes than are left in its chunk",
    walk_kernel.SHORT_MESSAGE: "a message shorter than its header",
}
_WINDOW = 1 << 20


class DataSection:
    """Reader of the data section, with its chunks by byte, extras, the end record and losses.

    `extras` are (opcode, byte, length) of complete attachments and metadata; `other_times` counts chunks whose header
    has other times than their messages.
    """

    def __init__(
        self,
        file: FileBytes,
        summary: Summary,
        definitions: Definitions,
        skip: Mapping[int, object],
    ) -> None:
        self.losses = Losses()
        self.chunks: dict[int, ChunkHeader] = {}
        self.extras: dict[tuple[int, int, int], None] = {}
        self.end: DataEnd | None = None
        self.end_at = self.other_times = 0
        self.arena = Arena(definitions)
        self._file, self._summary, self._skip = file, summary, skip
        self._following = dict(pairwise(sorted(summary.chunks)))
        self._decompressor = Decompressor()
        self._ahead = ChunkReadAhead(file.path, summary, skip)
        self._window = _SMALLEST_WINDOW
        self._claims = ClaimedSizes()
        self._resync = Resync(file, summary)
        self._lost: Loss | None = None  # a lost chunk whose message indexes may follow

    def pieces(self) -> Iterator[MessageBlock]:
        """Yield all messages that can be read."""
        with self._ahead:
            yield from self._records()
            yield from self.arena.flush()

    def _records(self) -> Iterator[MessageBlock]:
        at = len(MAGIC)
        if bytes(self._file.read(0, at)) != MAGIC:
            self.losses.add(Loss(0, min(at, self._file.size), "the file does not start like an MCAP file"))
            self.losses.stopped = self._file.size <= at
        while not self.losses.stopped and self.end is None:
            self.end_at = at = yield from self._checked_chunks(at)
            head = self._file.read(at, HEADER_LENGTH)
            try:
                if not len(head):
                    raise DamageError("the file ends without an end record")
                header = chunk_header(at, head)
                opcode = self._kind(head, header)
                if opcode == Chunk.opcode and header is not None and header.data + header.size > self._file.size:
                    yield from self._cut_chunk(header)
                    return
                length = record_length(at, head, self._file.size)
                if opcode == Footer.opcode:
                    return
                if opcode in _OUTSIDE_CHUNKS:
                    at = yield from self._outside_chunks(at, length)
                elif opcode == Chunk.opcode and header is not None:
                    yield from self._chunk(header)
                    at = self._after(header)
                else:
                    self._other(opcode, at, length, head)
                    at += length
            except DamageError as fault:
                at = self._resume(at, str(fault))

    def _kind(self, head: memoryview, header: ChunkHeader | None) -> int:
        opcode = head[0]
        if opcode != Chunk.opcode and header is not None and header.consistent:
            self.losses.add(Loss(header.at, 1, f"a chunk is marked as a record of kind {opcode}"))
            return Chunk.opcode
        if opcode == Chunk.opcode and header is None and len(head) == HEADER_LENGTH:
            raise DamageError("the name of a chunk's compression is damaged")
        return opcode

    def _resume(self, at: int, reason: str) -> int:
        begin, following = self._resync.after(at)
        end = self._file.size if following is None else following
        self.losses.stopped = following is None
        self.losses.add(Loss(begin, end - begin, reason))
        return end

    def _checked_chunks(self, at: int) -> Generator[MessageBlock, None, int]:
        """Yield the messages of chunks that were read ahead, from byte `at` on, and return the byte after them."""
        while True:
            if self._ahead.begins(at):
                yield from self.arena.flush()  # first, because the next group's fast path may learn from these messages
                memory = self._ahead.group(at)
                if memory is not None:
                    self.arena.reset(memory, covered=True)
            checked = self._ahead.checked(at)
            if checked is None:
                return at
            yield from self._chunk(checked.header, checked)
            at = checked.end if self._lost is None else at + checked.header.length

    def _chunk(self, header: ChunkHeader, checked: CheckedChunk | None = None) -> Iterator[MessageBlock]:
        self._lost = None
        self.chunks[header.at] = header
        if header.at in self._skip:
            self._resync.verified_to = header.at + header.length
            return
        self._resync.verified_to = header.at + 1
        covered = header.uncompressed_crc != 0
        try:
            header.check()
            self._claims.add(header)
            if not self.arena.fits(header.uncompressed_size, covered):
                yield from self.arena.flush()
                self.arena.reset(np.empty(max(JOINED, header.uncompressed_size), np.uint8), covered)
            content = self.arena.reserve(header.uncompressed_size)
            if checked is None or checked.address != content.ctypes.data:
                self._decompressor.read(self._file, header, content)
        except DamageError as fault:
            loss = Loss.of_chunk(header, self._summary, str(fault), refused=isinstance(fault, RefusedError))
            self._lost = self.losses.add(loss)
            return
        self._resync.verified_to = header.at + header.length
        walked = yield from self.arena.walk(len(content))
        self._note(walked, header.at, len(content))
        times = walked.times if walked.reason == walk_kernel.DONE else None
        if times is not None:
            self.other_times += times != (header.message_start_time, header.message_end_time)

    def _is_chunk(self, start: int) -> bool:
        return start < self._file.size and self._file.read(start, 1)[0] == Chunk.opcode

    def _after(self, header: ChunkHeader) -> int:
        """Return the byte after a chunk, or after its message indexes if a verified summary has nothing else there."""
        end, index = header.at + header.length, self._summary.chunks.get(header.at)
        if self._lost is None and index is not None and self._summary.verified and matches_header(index, header):
            following, length = self._following.get(header.at), index.message_index_length
            # An entry is smaller than its message: longer indexes are read one by one.
            if following == end + length and length <= index.uncompressed_size:
                return following if self._only_message_indexes(header.at, end, length) else end
        return end

    def _only_message_indexes(self, chunk: int, at: int, length: int) -> bool:
        if chunk in self._skip and self._file.remote is not None:
            return only_message_indexes_between(self._file, at, at + length)
        return only_message_indexes(self._file.read(at, length))

    @property
    def is_partly_read(self) -> bool:
        """Return whether parts of a file at a URL are not read: a checksum of more than a chunk is not checked."""
        return self._file.remote is not None and bool(self._skip)

    def _cut_chunk(self, header: ChunkHeader) -> Iterator[MessageBlock]:
        """Yield the messages before the cut of a chunk that the end of the file cuts off."""
        left = self._file.size - header.data
        loss = Loss.of_chunk(header, self._summary, f"the file ends within a chunk: {left} of {header.size} bytes")
        loss.size, loss.time = self._file.size - header.at, None
        if not header.consistent:
            raise DamageError(f"a record declares {header.length - PREFIX} bytes, but only {left} are left")
        header.check()
        self.losses.stopped = True
        self.losses.add(loss)
        yield from self.arena.flush()
        self.arena.reset(np.empty(max(JOINED, header.uncompressed_size), np.uint8), covered=False)
        content = self.arena.reserve(header.uncompressed_size)
        packed = self._file.read_scratch(header.data, left)
        if header.compression:
            try:
                left = self._decompressor.fill_available(header, packed, content)
            except DamageError as fault:
                loss.reason = str(fault)
                return
        else:
            content[:left] = packed
        yield from self.arena.walk(left)

    def _outside_chunks(self, at: int, length: int) -> Generator[MessageBlock, None, int]:
        """Yield the records outside of chunks that fit into a window, and return the byte after them."""
        if length > LARGEST:
            raise DamageError(f"a record declares {length - PREFIX} bytes, more than {LARGEST >> 20} MiB")
        window = self._file.array(at, max(self._window, length))
        walked = yield from self.arena.take_window(window)
        self._resync.verified_to = at + walked.at
        self._note(walked, at, len(window))
        self._window = min(4 * self._window, _LARGEST_WINDOW) if 2 * walked.at > len(window) else _SMALLEST_WINDOW
        if walked.reason == walk_kernel.SHORT_MESSAGE:
            return self._resume(at + walked.at, _REASONS[walked.reason])
        return at + walked.at

    def _note(self, walked: WalkResult, at: int, size: int) -> None:
        """Add the losses of records in a chunk or window at byte `at`."""
        for fault in walked.faults:
            self.losses.add(Loss(at, 0, f"a definition: {fault}"))
        if at in self.chunks and walked.reason in _REASONS:
            self.losses.add(Loss(at, size - walked.at, f"in a chunk: {_REASONS[walked.reason]}"))

    def _other(self, opcode: int, at: int, length: int, head: memoryview) -> None:
        self._resync.check(at, length)
        if opcode == MessageIndex.opcode:
            if self._lost is not None and length >= PREFIX + 6:
                self._lost.messages = (self._lost.messages or 0) + int.from_bytes(head[11:15], "little") // 16
            return
        self._lost = None
        body = at + PREFIX
        if opcode == DataEnd.opcode:
            if self._summary.verified and any(self._is_chunk(start) for start in self._summary.chunks if start > at):
                raise DamageError("the data section ends before chunks that the summary names")
            self.end = DataEnd.read(self._file.read(body, min(length - PREFIX, 64)))
        elif opcode in (Attachment.opcode, Metadata.opcode):
            try:
                if opcode == Attachment.opcode:
                    check_attachment(self._file, at, length, with_crc=not self.is_partly_read)
                else:
                    Metadata.read(self._file.read(body, min(length - PREFIX, LARGEST)))
            except DamageError as fault:
                self.losses.add(Loss(at, length, str(fault)))
            else:
                self.extras[opcode, at, length] = None
                if opcode == Attachment.opcode:
                    self._resync.verified_to = at + length


def record_length(at: int, head: memoryview, size: int) -> int:
    """Return the length of the record at byte `at`, including its prefix.

    Section "Records": opcode, length of the content, content. The file has `size` bytes. Raises DamageError if the
    length is impossible.
    """
    left = size - at - PREFIX
    if left < 0:
        raise DamageError(f"the file ends within a record: {left + PREFIX} bytes are left")
    length = int.from_bytes(head[1:PREFIX], "little")
    if head[0] == 0:
        raise DamageError(_NO_KIND)
    if length > left:
        raise DamageError(f"a record declares {length} bytes, but only {left} are left")
    return PREFIX + length


class Resync:
    """Locates the byte where reading continues after damage.

    All bytes before `verified_to` were read, or verified by a CRC. A wrong length that no CRC covers may skip complete
    chunks; they are before the byte where the damage is detected, and after `verified_to`. The number of bytes to go
    back is limited, because a file may consist of such lengths.
    """

    def __init__(self, file: FileBytes, summary: Summary) -> None:
        self.verified_to = len(MAGIC)
        self._file = file
        self._known = sorted(summary.chunks) if summary.verified else []
        self._back = file.size  # the remaining number of bytes to go back

    def check(self, at: int, length: int) -> None:
        """Raise DamageError if a record other than a chunk overlaps a chunk that a verified summary names."""
        number = bisect_right(self._known, at)
        if number < len(self._known) and (following := self._known[number]) < at + length:
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
        window = file.array(at, _WINDOW + HEADER_LENGTH)
        for offset in _candidates(window):
            header = chunk_header(at + offset, window[offset : offset + HEADER_LENGTH].data)
            if header is not None and header.consistent and header.size <= LARGEST:
                return header.at
        at += _WINDOW
    return None


def _candidates(window: Bytes) -> list[int]:
    """Return the offsets where the opcode of a chunk precedes a length below 4 GiB."""
    last = len(window) - HEADER_LENGTH
    if last <= 0:
        return []
    matches = window[:last] == Chunk.opcode
    for i in range(PREFIX - 4, PREFIX):
        matches &= window[i : i + last] == 0
    return [int(offset) for offset in np.flatnonzero(matches)]
