"""Chunks that the summary names, decompressed and checked side by side before it is their turn.

Groups of them lie side by side in one piece of memory, so that columns are gathered from many messages at once. Nothing
is believed of them: a group counts only where all its chunks came out right, each under the very header that is met
when its turn comes. Otherwise its chunks are read one after the other, and what is wrong with them shows there.
"""

from __future__ import annotations

from collections.abc import Container, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from queue import Empty, SimpleQueue
from types import TracebackType
from typing import Self

from cdtool.formats.cores import usable_cores
from cdtool.formats.mcap.container.buffers import Buffers
from cdtool.formats.mcap.container.chunks import HEADER_LENGTH, ChunkHeader, Decompressor, chunk_header
from cdtool.formats.mcap.container.damage import DamageError
from cdtool.formats.mcap.container.file_bytes import FileBytes
from cdtool.formats.mcap.container.records import ChunkIndex
from cdtool.formats.mcap.container.summary import Summary, same_figures
from cdtool.formats.mcap.container.walk_kernel import Bytes

# Chunks lie side by side up to this many bytes (writers make them of one MiB and a little). More takes its time to come
# through the processor's cache, with less, what there is to do for each piece of memory counts.
JOINED = 14 << 20
_LARGEST = 16 << 20  # chunks beyond this size are read one by one
_GROUPS_AHEAD = 1
_MOST_THREADS = 4
# Memory that was never used before costs as much as decompressing into it does: it is kept from log to log.
_BUFFERS = Buffers(JOINED)


@dataclass(frozen=True)
class _Group:
    """Memory for a group of chunks, and each one's header, place in the memory, and whether it is there."""

    memory: Bytes
    chunks: tuple[Future[tuple[ChunkHeader, int] | None], ...]


class ChunksAhead:
    """The chunks of `summary` at places that are not in `skip`; without a CRC of the summary, none."""

    def __init__(self, path: Path, summary: Summary, skip: Container[int]) -> None:
        self._path = path
        chunks = [index for at, index in sorted(summary.chunks.items()) if at not in skip] if summary.verified else []
        threads = min(usable_cores(), _MOST_THREADS, len(chunks))
        self._groups = {group[0].chunk_start_offset: group for group in _groups(chunks)} if threads > 1 else {}
        self._following = dict(pairwise(self._groups))
        self._started: dict[int, _Group] = {}
        self._there: dict[ChunkHeader, int] = {}
        self._threads = ThreadPoolExecutor(threads, "chunks") if threads > 1 else None
        self._readers: SimpleQueue[tuple[FileBytes, Decompressor]] = SimpleQueue()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, fault: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._threads is not None:
            self._threads.shutdown(cancel_futures=True)
        while not self._readers.empty():
            self._readers.get()[0].close()

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
        for _ in range(1 + _GROUPS_AHEAD):
            if following is not None and following not in self._started:
                self._started[following] = self._start(self._groups[following])
            following = self._following.get(following) if following is not None else None
        group = self._started.pop(at)
        chunks = [chunk.result() for chunk in group.chunks]
        if not all(chunks) or len(group.memory) < size:
            return _BUFFERS.take(size)
        self._there = {header: place for chunk in chunks if chunk is not None for header, place in [chunk]}
        return group.memory

    def holds(self, header: ChunkHeader, content: Bytes) -> bool:
        """The chunk with this header stands in `content` already, checked."""
        return self._there.get(header) == content.ctypes.data

    def _start(self, chunks: list[ChunkIndex]) -> _Group:
        assert self._threads is not None
        memory = _BUFFERS.take(sum(index.uncompressed_size for index in chunks))
        begun, end = [], 0
        for index in chunks:
            start, end = end, end + index.uncompressed_size
            begun.append(self._threads.submit(self._fill, index, memory[start:end]))
        return _Group(memory, tuple(begun))

    def _fill(self, index: ChunkIndex, content: Bytes) -> tuple[ChunkHeader, int] | None:
        at = index.chunk_start_offset
        try:
            file, decompressor = self._reader()
        except OSError:
            return None
        try:
            header = chunk_header(at, file.read(at, HEADER_LENGTH))
            if header is None or not header.uncompressed_crc or not same_figures(index, header):
                return None
            header.check()
            decompressor.read(file, header, content)
        except (DamageError, OSError):
            return None
        else:
            return header, content.ctypes.data
        finally:
            self._readers.put((file, decompressor))

    def _reader(self) -> tuple[FileBytes, Decompressor]:
        try:
            return self._readers.get_nowait()
        except Empty:
            return FileBytes(self._path), Decompressor()


def _groups(chunks: list[ChunkIndex]) -> Iterator[list[ChunkIndex]]:
    group: list[ChunkIndex] = []
    size = 0
    for index in chunks:
        if group and size + index.uncompressed_size > JOINED:
            yield group
            group, size = [], 0
        if index.uncompressed_size <= _LARGEST:
            group.append(index)
            size += index.uncompressed_size
    if group:
        yield group
