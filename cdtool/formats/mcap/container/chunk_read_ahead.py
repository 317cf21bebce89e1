"""Read chunks ahead: decompress and check chunks of the summary in several threads before they are needed.

Groups of chunks are consecutive in one memory block, so that columns are gathered from many messages at once. A group
is used only if all its chunks are correct and have the same headers as the data section. Otherwise its chunks are read
again one by one, and damage is reported then.
"""

from __future__ import annotations

from collections.abc import Container, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from queue import Empty, SimpleQueue
from types import TracebackType
from typing import NamedTuple, Self

import numpy as np

from cdtool.cores import usable_cores
from cdtool.formats.mcap.container.chunks import HEADER_LENGTH, ChunkHeader, Decompressor, chunk_header
from cdtool.formats.mcap.container.damage import DamageError
from cdtool.formats.mcap.container.file_bytes import FileBytes
from cdtool.formats.mcap.container.records import PREFIX, Chunk, ChunkIndex
from cdtool.formats.mcap.container.skippable_chunks import only_message_indexes
from cdtool.formats.mcap.container.summary import Summary, matches_header
from cdtool.formats.mcap.container.walk_kernel import Bytes

# The size of a group [bytes] (writers make chunks of slightly more than one MiB). Larger groups exceed the processor's
# cache; with smaller ones the effort per group dominates.
JOINED = 14 << 20
# Chunks beyond this size are read one by one, and so are those whose record and message indexes are longer.
_LARGEST, _LONGEST = 16 << 20, 32 << 20
_GROUPS_AHEAD = 1
_MOST_THREADS = 4
# In a message index the prefix, the channel's id and the length precede the entries; each is a time and an offset.
_BEFORE_ENTRIES, _ENTRY = PREFIX + 6, 16


class CheckedChunk(NamedTuple):
    """A checked chunk: its header, and either its messages, if the fast path has read them, or its address.

    `end` is the byte after its record, or after its message indexes if nothing else is before the next chunk.
    """

    header: ChunkHeader
    end: int
    address: int = 0


class _Reader:
    """The file, decompressor and buffer of one thread."""

    def __init__(self, path: Path) -> None:
        self.file = FileBytes(path)
        self.decompressor = Decompressor()
        self._buffer = np.empty(0, np.uint8)

    def buffer(self, size: int) -> Bytes:
        """Return memory that is reused for each chunk, so that it stays in the processor's cache."""
        if size > len(self._buffer):
            self._buffer = np.empty(size, np.uint8)
        return self._buffer[:size]


@dataclass(frozen=True)
class _Group:
    """Memory for a group of chunks, and the future result of each; None if the chunk must be read again."""

    memory: Bytes
    chunks: tuple[Future[list[CheckedChunk | None]], ...]


class ChunkReadAhead:
    """Reads ahead the chunks of a `summary` with a CRC, except those at the bytes `skip`.

    The fast path (`chunk_reader`) is applied to each chunk as long as no id in `definitions` is ambiguous.
    """

    def __init__(self, path: Path, summary: Summary, skip: Container[int]) -> None:
        self._path = path
        chunks = [index for at, index in sorted(summary.chunks.items()) if at not in skip] if summary.verified else []
        self._count = min(usable_cores(), _MOST_THREADS, len(chunks))
        self._groups = {group[0].chunk_start_offset: group for group in _groups(chunks)} if self._count > 1 else {}
        self._following = dict(pairwise(self._groups))
        self._next_chunk = dict(pairwise(sorted(summary.chunks)))
        self._started: dict[int, _Group] = {}
        self._checked: dict[int, CheckedChunk] = {}
        self._threads = ThreadPoolExecutor(self._count, "chunks") if self._count > 1 else None
        self._readers: SimpleQueue[_Reader] = SimpleQueue()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, fault: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._threads is not None:
            self._threads.shutdown(cancel_futures=True)
        while not self._readers.empty():
            self._readers.get().file.close()

    def begins(self, at: int) -> bool:
        """Return whether the chunk at byte `at` is the first of a group, which has its own memory."""
        return at in self._groups

    def group(self, at: int) -> Bytes | None:
        """Return the memory of the group that begins at byte `at`; None if one of its chunks must be read again."""
        self._checked = {}
        for earlier in [start for start in self._started if start < at]:
            del self._started[earlier]
        following: int | None = at
        for _ in range(1 + _GROUPS_AHEAD):
            if following is not None and following not in self._started:
                self._started[following] = self._start(self._groups[following])
            following = self._following.get(following) if following is not None else None
        group = self._started.pop(at)
        chunks = [chunk for future in group.chunks for chunk in future.result()]
        if not all(chunks):
            return None
        self._checked = {chunk.header.at: chunk for chunk in chunks if chunk is not None}
        return group.memory

    def checked(self, at: int) -> CheckedChunk | None:
        """Return the chunk at byte `at` of the current group; None if it must be read."""
        return self._checked.get(at)

    def _start(self, chunks: list[ChunkIndex]) -> _Group:
        assert self._threads is not None
        memory = np.empty(sum(index.uncompressed_size for index in chunks), np.uint8)
        targets, end = [], 0
        for index in chunks:
            start, end = end, end + index.uncompressed_size
            targets.append((index, memory[start:end]))
        each = -(-len(targets) // self._count)  # a task per thread: fewer tasks, fewer waits for the interpreter's lock
        tasks = [targets[i : i + each] for i in range(0, len(targets), each)]
        return _Group(memory, tuple(self._threads.submit(self._fill_all, task) for task in tasks))

    def _fill_all(self, targets: list[tuple[ChunkIndex, Bytes]]) -> list[CheckedChunk | None]:
        try:
            reader = self._reader()
        except OSError:
            return [None] * len(targets)
        try:
            return [self._fill(reader, index, content) for index, content in targets]
        finally:
            self._readers.put(reader)

    def _fill(self, reader: _Reader, index: ChunkIndex, content: Bytes) -> CheckedChunk | None:
        at, length = index.chunk_start_offset, index.chunk_length + self._indexes_length(index)
        if length > min(_LONGEST, reader.file.size - at):
            return None
        try:
            record = reader.file.read_scratch(at, length)
            header = chunk_header(at, record[:HEADER_LENGTH].data)
            if header is None or record[0] != Chunk.opcode or not header.uncompressed_crc:
                return None
            if not matches_header(index, header):
                return None
            header.check()
            packed = record[header.data - at : header.data - at + header.size]
            end = at + (length if only_message_indexes(record.data, header.length) else header.length)
            reader.decompressor.fill(header, packed, content)
            return CheckedChunk(header, end, content.ctypes.data)
        except (DamageError, OSError):
            return None

    def _indexes_length(self, index: ChunkIndex) -> int:
        """Return the length of the bytes after a chunk if only its message indexes should be there; otherwise 0.

        An entry is smaller than its message: a longer index is not read at once.
        """
        end, length = index.chunk_start_offset + index.chunk_length, index.message_index_length
        is_usual = length <= index.uncompressed_size and self._next_chunk.get(index.chunk_start_offset) == end + length
        return length if is_usual else 0

    def _reader(self) -> _Reader:
        try:
            return self._readers.get_nowait()
        except Empty:
            return _Reader(self._path)


def _groups(chunks: list[ChunkIndex]) -> Iterator[list[ChunkIndex]]:
    """Yield groups of chunks; the first group is a single chunk, from which the fast path learns."""
    group: list[ChunkIndex] = []
    size = most = 0
    for index in chunks:
        if group and size + index.uncompressed_size > most:
            yield group
            group, size, most = [], 0, JOINED
        if index.uncompressed_size <= _LARGEST:
            group.append(index)
            size += index.uncompressed_size
    if group:
        yield group
