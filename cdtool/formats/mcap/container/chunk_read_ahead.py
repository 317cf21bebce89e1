"""Chunks that the summary names, decompressed and checked side by side before it is their turn.

Groups of them lie side by side in one piece of memory, so that columns are gathered from many messages at once. Nothing
is believed of them: a group counts only where all its chunks came out right, each under the very header that is met
when its turn comes. Otherwise its chunks are read one after the other, and what is wrong with them shows there.
"""

from __future__ import annotations

import mmap
import weakref
from collections import Counter
from collections.abc import Container, Iterable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from queue import Empty, SimpleQueue
from types import TracebackType
from typing import Self

import numpy as np

from cdtool.cores import usable_cores
from cdtool.formats.mcap.container.chunks import HEADER_LENGTH, ChunkHeader, Decompressor, chunk_header
from cdtool.formats.mcap.container.damage import DamageError
from cdtool.formats.mcap.container.definitions import Definitions
from cdtool.formats.mcap.container.file_bytes import FileBytes
from cdtool.formats.mcap.container.records import PREFIX, ChunkIndex
from cdtool.formats.mcap.container.summary import Summary, matches_header
from cdtool.formats.mcap.container.walk_kernel import Bytes
from cdtool.messages.taken import Taken, Taker

_LARGE_PAGE = 2 << 20
_MOST_KEPT = 3
# Chunks lie side by side up to this many bytes (writers make them of one MiB and a little). More takes its time to come
# through the processor's cache, with less, what there is to do for each piece of memory counts.
JOINED = 14 << 20
_LARGEST = 16 << 20  # chunks beyond this size are read one by one
_GROUPS_AHEAD = 1
_MOST_THREADS = 4
_SUBMITTED = 3  # chunks to one thread: handing them over costs as much as a tenth of one
# Channel's id and the length of all entries precede these; each is a time and an offset [bytes].
_BEFORE_ENTRIES, _ENTRY = PREFIX + 6, 16


class Buffers:
    """Memory for decompressed chunks: in large pages, and used again once nothing refers to it any more.

    Arrays have `size` bytes, a multiple of a large page; larger ones are made where they are asked for. Messages lie
    far apart, and a page of 4 KiB holds few of them: with small pages most of the time goes into finding where they are
    (a quarter of decompressing, half of gathering).
    """

    def __init__(self, size: int) -> None:
        self.size = size
        self._free: list[mmap.mmap] = []

    def take(self, size: int) -> Bytes:
        """An array of at least `size` bytes, with whatever stands in it."""
        if size > self.size:
            return np.empty(size, np.uint8)
        memory = self._free.pop() if self._free else _large_pages(self.size)
        whole: Bytes = np.frombuffer(memory, np.uint8)
        # Every part of it refers to `whole`, which therefore lives as long as any of them.
        weakref.finalize(whole, self._give_back, memory)
        start = -whole.ctypes.data % _LARGE_PAGE
        return whole[start : start + self.size]

    def _give_back(self, memory: mmap.mmap) -> None:
        if len(self._free) < _MOST_KEPT:
            self._free.append(memory)


def _large_pages(size: int) -> mmap.mmap:
    memory = mmap.mmap(-1, size + _LARGE_PAGE)
    if hasattr(mmap, "MADV_HUGEPAGE"):  # Linux
        memory.madvise(mmap.MADV_HUGEPAGE)
    return memory


# Memory that was never used before costs as much as decompressing into it does: it is kept from log to log.
_BUFFERS = Buffers(JOINED)


@dataclass(frozen=True)
class _CheckedChunk:
    """A chunk that was checked: its header, and either its messages, if they were taken, or its address in memory."""

    header: ChunkHeader
    address: int = 0
    taken: Taken | None = None


class _Reader:
    """What one thread reads with at a time."""

    def __init__(self, path: Path) -> None:
        self.file = FileBytes(path)
        self.decompressor = Decompressor()
        self._buffer = np.empty(0, np.uint8)

    def buffer(self, size: int) -> Bytes:
        """Memory that is used for one chunk after another, so that it stays in the processor's cache."""
        if size > len(self._buffer):
            self._buffer = np.empty(size, np.uint8)
        return self._buffer[:size]


@dataclass(frozen=True)
class _Group:
    """Memory for a group of chunks, and what becomes of each; None: it has to be read when its turn comes."""

    memory: Bytes
    chunks: tuple[Future[list[_CheckedChunk | None]], ...]


class ChunkReadAhead:
    """The chunks of `summary` at places that are not in `skip`; without a CRC of the summary, none.

    `taker` is given each one, as long as `definitions` are of one meaning.
    """

    def __init__(
        self, path: Path, summary: Summary, skip: Container[int], definitions: Definitions, taker: Taker | None
    ) -> None:
        self._path, self._definitions, self._taker = path, definitions, taker
        chunks = [index for at, index in sorted(summary.chunks.items()) if at not in skip] if summary.verified else []
        self._rows = expected_rows(chunks) if taker is not None else {}
        threads = min(usable_cores(), _MOST_THREADS, len(chunks))
        self._groups = {group[0].chunk_start_offset: group for group in _groups(chunks)} if threads > 1 else {}
        self._following = dict(pairwise(self._groups))
        self._started: dict[int, _Group] = {}
        self._there: dict[ChunkHeader, _CheckedChunk] = {}
        self._threads = ThreadPoolExecutor(threads, "chunks") if threads > 1 else None
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
        """The chunk at byte `at` is the first of a group: it and the others have memory of their own."""
        return at in self._groups

    def memory(self, at: int, size: int) -> Bytes:
        """Memory of `size` bytes at least for the chunk at byte `at`; where it begins a group, the group's."""
        self._there = {}
        if at not in self._groups:
            return _BUFFERS.take(size)
        for passed in [place for place in self._started if place < at]:
            del self._started[passed]
        following: int | None = at
        # What a taker learns from the first group holds for the next ones only if it comes before them.
        learning = self._taker is not None and at == next(iter(self._groups))
        for _ in range(1 if learning else 1 + _GROUPS_AHEAD):
            if following is not None and following not in self._started:
                self._started[following] = self._start(self._groups[following])
            following = self._following.get(following) if following is not None else None
        group = self._started.pop(at)
        chunks = [chunk for several in group.chunks for chunk in several.result()]
        if not all(chunks) or len(group.memory) < size:
            return _BUFFERS.take(size)
        self._there = {chunk.header: chunk for chunk in chunks if chunk is not None}
        return group.memory

    def holds(self, header: ChunkHeader, content: Bytes) -> bool:
        """The chunk with this header stands in `content` already, checked."""
        filled = self._there.get(header)
        return filled is not None and filled.address == content.ctypes.data

    def taken(self, header: ChunkHeader) -> Taken | None:
        """The messages of the chunk with this header; None where they have to be looked at."""
        filled = self._there.get(header)
        return None if filled is None or self._definitions.ambiguous else filled.taken

    def _start(self, chunks: list[ChunkIndex]) -> _Group:
        assert self._threads is not None
        memory = _BUFFERS.take(sum(index.uncompressed_size for index in chunks))
        places, end = [], 0
        for index in chunks:
            start, end = end, end + index.uncompressed_size
            places.append((index, memory[start:end]))
        several = [places[i : i + _SUBMITTED] for i in range(0, len(places), _SUBMITTED)]
        return _Group(memory, tuple(self._threads.submit(self._fill_all, some) for some in several))

    def _fill_all(self, places: list[tuple[ChunkIndex, Bytes]]) -> list[_CheckedChunk | None]:
        return [self._fill(index, content) for index, content in places]

    def _fill(self, index: ChunkIndex, content: Bytes) -> _CheckedChunk | None:
        at = index.chunk_start_offset
        try:
            reader = self._reader()
        except OSError:
            return None
        try:
            header = chunk_header(at, reader.file.read(at, HEADER_LENGTH))
            if header is None or not header.uncompressed_crc or not matches_header(index, header):
                return None
            header.check()
            if self._taker is None or not self._taker.ready or at not in self._rows:
                reader.decompressor.read(reader.file, header, content)
                return _CheckedChunk(header, content.ctypes.data)
            buffer = reader.buffer(len(content))
            reader.decompressor.read(reader.file, header, buffer)
            taken = self._taker.take(buffer, self._rows[at], self._is_known)
            if taken is not None:
                return _CheckedChunk(header, taken=taken)
            content[:] = buffer
            return _CheckedChunk(header, content.ctypes.data)
        except (DamageError, OSError):
            return None
        finally:
            self._readers.put(reader)

    def _is_known(self, opcode: int, body: bytes) -> bool:
        return self._definitions.knows(opcode, body, covered=True)

    def _reader(self) -> _Reader:
        try:
            return self._readers.get_nowait()
        except Empty:
            return _Reader(self._path)


def _groups(chunks: list[ChunkIndex]) -> Iterator[list[ChunkIndex]]:
    """The first one is a single chunk, as a taker learns from it."""
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


def expected_rows(chunks: Iterable[ChunkIndex]) -> dict[int, Mapping[int, range]]:
    """By a chunk's place and a channel's id the numbers of its messages among all of the channel in these chunks.

    A message index has 16 bytes for each message of its channel, and its place in the file is in the chunk's
    index (section "Chunk Index").
    It ends before the first chunk whose message indexes cannot be as long as they claim.
    """
    foretold: dict[int, Mapping[int, range]] = {}
    passed: Counter[int] = Counter()
    for index in chunks:
        places = sorted((at, channel) for channel, at in index.message_index_offsets.items())
        behind = index.chunk_start_offset + index.chunk_length + index.message_index_length
        rows = {}
        for (at, channel), (end, _) in pairwise((*places, (behind, 0))):
            count, rest = divmod(end - at - _BEFORE_ENTRIES, _ENTRY)
            if count < 0 or rest:
                return foretold
            rows[channel] = range(passed[channel], passed[channel] + count)
            passed[channel] += count
        foretold[index.chunk_start_offset] = rows
    return foretold
