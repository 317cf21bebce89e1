"""Read the bytes of a text file (encoding, line ends, NUL bytes at the end) and its lines in blocks.

The bytes of a file that is compressed with gzip are those of the text in it (`gzipped.py`). UTF-16 and UTF-32 are
recoded to UTF-8 while reading; in any other encoding the bytes of a number are ASCII, and nothing is recoded. The
result is called the stream: bytes without a byte order mark.
"""

from __future__ import annotations

import codecs
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from io import BytesIO, RawIOBase
from itertools import count
from pathlib import Path

import numpy as np
import numpy.typing as npt

from cdtool.errors import RecordingError
from cdtool.formats.csv.gzipped import MAGIC, is_gzipped, open_text

Bytes = npt.NDArray[np.uint8]

SAMPLE_BYTES = 1 << 17
BLOCK_BYTES = 1 << 20
# Number of line ends after a block, which end any number, word or time stamp.
AFTER = 64
RING = 8
TAIL_BYTES = 1 << 16
UNIT_BYTES = {"utf-16-le": 2, "utf-16-be": 2, "utf-32-le": 4, "utf-32-be": 4}


@dataclass(frozen=True)
class Text:
    """The encoding of a text file. The byte order mark has `mark` bytes; `padding` NUL bytes start at byte `size`.

    `content` are the bytes of a file of at most one block, which is read once. `end` are the last bytes of a longer
    file that is compressed, and the byte where they start.
    """

    path: Path
    encoding: str
    mark: int
    size: int
    padding: int
    line_end: bytes
    content: bytes | None = field(default=None, repr=False, compare=False)
    end: tuple[int, bytes] | None = field(default=None, repr=False, compare=False)

    @property
    def recoded(self) -> bool:
        """Return whether the stream is UTF-8 that was recoded from UTF-16 or UTF-32."""
        return self.encoding in UNIT_BYTES

    def decode(self, line: bytes) -> str:
        """Return a line of the stream as text."""
        return line.decode("utf-8" if self.recoded else self.encoding, errors="replace")

    def between(self, start: int, end: int) -> bytes:
        """Return bytes of the file."""
        if self.content is not None:
            return self.content[start:end]
        if self.end is not None and start >= self.end[0]:
            return self.end[1][start - self.end[0] : end - self.end[0]]
        with open_text(self.path) as file:
            file.seek(start)
            return file.read(end - start) or b""

    def chunks(self) -> Iterator[bytes]:
        """Yield the stream in pieces that may end within a line; raises RecordingError if it cannot be decoded."""
        decoder = codecs.getincrementaldecoder(self.encoding)() if self.recoded else None
        with self._open() as file:
            file.seek(self.mark)
            left = self.size - self.mark
            while left > 0 and (piece := file.read(min(BLOCK_BYTES, left))):
                left -= len(piece)
                if decoder is None:
                    yield piece
                    continue
                try:
                    yield decoder.decode(piece, final=left == 0).encode()
                except UnicodeError as fault:
                    raise RecordingError(
                        f"{self.path}: damaged: not valid {self.encoding.upper()} near byte {self.size - left}",
                        "save it again as UTF-8",
                    ) from fault

    def tail(self) -> list[bytes]:
        """Return the last lines of the stream, including an unfinished last line; the first may be part of a line."""
        if self.recoded:
            last = [b"", b""]
            for piece in self.chunks():
                last = [last[1], piece]
            end = b"".join(last)
        else:
            end = self.between(max(self.mark, self.size - TAIL_BYTES), self.size)
        return end.split(self.line_end)

    def count_lines(self, offset: int, counted: Callable[[Bytes, int], int]) -> int:
        """Return the number of lines after byte `offset` of the stream, including an unfinished last line.

        `counted` counts the occurrences of one byte.
        """
        end = self.line_end[0]
        if self.content is not None and not self.recoded:
            data = np.frombuffer(self.content, dtype=np.uint8)[self.mark + offset : self.size]
            return counted(data, end) + (len(data) > 0 and bool(data[-1] != end))
        total, last = 0, end
        for buffer, size in self._filled(offset, BLOCK_BYTES):
            total += counted(np.frombuffer(buffer, dtype=np.uint8, count=size), end)
            last = buffer[size - 1]
        return total + (last != end)

    def blocks(self, offset: int) -> Iterator[tuple[bytearray, int]]:
        """Yield blocks of complete lines after byte `offset` of the stream: bytes, and the size of the lines in them.

        The lines of a block are followed by AFTER line ends. Only the last line of the last block may be without a line
        end. A block's buffer is reused RING blocks later.
        """
        left = [b""]
        for buffer, size in self._filled(offset, BLOCK_BYTES, lambda: left[0]):
            cut = buffer.rfind(self.line_end, 0, size) + 1
            rest = left[0] = bytes(memoryview(buffer)[cut:size])
            if len(rest) > BLOCK_BYTES // 2:
                raise RecordingError(f"{self.path}: has a line of more than {BLOCK_BYTES >> 11} KB", "is it a table?")
            if cut:
                buffer[cut : cut + AFTER] = self.line_end * AFTER
                yield buffer, cut
        if left[0]:
            yield bytearray(left[0] + self.line_end * AFTER), len(left[0])

    def _open(self) -> RawIOBase | BytesIO:
        return open_text(self.path) if self.content is None else BytesIO(self.content)

    def _filled(self, offset: int, most: int, before: Callable[[], bytes] = bytes) -> Iterator[tuple[bytearray, int]]:
        """Yield the stream from `offset` in buffers, with the size of their content; each starts with `before()`."""
        if self.recoded:
            for piece in self.chunks():
                content = piece[offset:]
                offset = max(0, offset - len(piece))
                if content:
                    content = before() + content
                    yield bytearray(content), len(content)
            return
        left = self.size - self.mark - offset
        if self.content is not None:
            if left > 0:
                yield bytearray(memoryview(self.content)[self.mark + offset : self.size]), left
            return
        ring = [bytearray(2 * most + AFTER) for _ in range(RING if left > most else 1)]
        with open_text(self.path) as file:
            file.seek(self.mark + offset)
            for turn in count():
                if left <= 0:
                    return
                buffer, first = ring[turn % len(ring)], before()
                buffer[: len(first)] = first
                free = memoryview(buffer)[len(first) : len(first) + min(most, left)]
                size = file.readinto(free)
                free.release()
                if not size:
                    return
                left -= size
                yield buffer, len(first) + size


def read_sample(path: Path, most: int = SAMPLE_BYTES) -> bytes:
    """Return the first bytes of a file, in which its dialect is detected; raises RecordingError."""
    with _readable(path), open_text(path) as file:
        return file.read(most) or b""


def read_small(path: Path) -> bytes | None:
    """Return the bytes of a file of at most one block; None for a larger file. Raises RecordingError."""
    with _readable(path):
        with path.open("rb", buffering=0) as file:
            size = os.fstat(file.fileno()).st_size
            content = file.readall() if size <= BLOCK_BYTES else None
        if is_gzipped(path) if content is None else content.startswith(MAGIC):
            content = read_sample(path, BLOCK_BYTES + 1)
    return content if content is None or len(content) <= BLOCK_BYTES else None


@contextmanager
def _readable(path: Path) -> Iterator[None]:
    """Raise RecordingError if the file cannot be read."""
    try:
        yield
    except OSError as fault:
        raise RecordingError(
            f"{path}: cannot be read: {fault.strerror}", "check the path and its permissions"
        ) from fault
