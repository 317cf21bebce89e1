"""A text file's bytes: encoding, line ends, NUL bytes at the end; and its lines in blocks.

UTF-16 and UTF-32 are recoded to UTF-8 on the way; every other encoding agrees with ASCII in the bytes of a number, and
is left as it is. What is read from here on is "the stream": bytes without a byte order mark.
"""

from __future__ import annotations

import codecs
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import count
from pathlib import Path

import numpy as np
import numpy.typing as npt

from cdtool.errors import RecordingError

Bytes = npt.NDArray[np.uint8]

SAMPLE_BYTES = 1 << 17
BLOCK_BYTES = 1 << 20
# Bytes behind a block that end any number, word or stamp.
AFTER = 32
RING = 8
TAIL_BYTES = 1 << 16
UNIT_BYTES = {"utf-16-le": 2, "utf-16-be": 2, "utf-32-le": 4, "utf-32-be": 4}


@dataclass(frozen=True)
class Text:
    """How the bytes of a file are to be read.

    `mark` bytes of byte order mark come first, `size` is where the text ends and `padding` NUL bytes begin.
    """

    path: Path
    encoding: str
    mark: int
    size: int
    padding: int
    line_end: bytes

    @property
    def recoded(self) -> bool:
        """True if the stream is UTF-8 made from wider characters."""
        return self.encoding in UNIT_BYTES

    def decode(self, line: bytes) -> str:
        """A line of the stream as text."""
        return line.decode("utf-8" if self.recoded else self.encoding, errors="replace")

    def chunks(self) -> Iterator[bytes]:
        """The stream, in pieces cut anywhere; raises RecordingError where it cannot be decoded."""
        decoder = codecs.getincrementaldecoder(self.encoding)() if self.recoded else None
        with self.path.open("rb") as file:
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
                        f"{self.path}: is damaged: no {self.encoding.upper()} near byte {self.size - left}",
                        "save it again as UTF-8",
                    ) from fault

    def tail(self) -> list[bytes]:
        """The last lines of the stream, the last one unfinished; the first of them may be a part of a line."""
        if self.recoded:
            last = [b"", b""]
            for piece in self.chunks():
                last = [last[1], piece]
            end = b"".join(last)
        else:
            with self.path.open("rb") as file:
                file.seek(max(self.mark, self.size - TAIL_BYTES))
                end = file.read(min(TAIL_BYTES, self.size - self.mark))
        return end.split(self.line_end)

    def count_lines(self, offset: int, counted: Callable[[Bytes, int], int]) -> int:
        """Lines from byte `offset` of the stream on, the last of which may be unfinished; `counted` counts one byte."""
        end = self.line_end[0]
        total, last = 0, end
        for buffer, size in self._filled(offset, BLOCK_BYTES):
            total += counted(np.frombuffer(buffer, dtype=np.uint8, count=size), end)
            last = buffer[size - 1]
        return total + (last != end)

    def blocks(self, offset: int) -> Iterator[tuple[bytearray, int]]:
        """Whole lines from byte `offset` of the stream on: bytes with AFTER line ends behind them, and their number.

        Only the last block may lack the end of its last line. A block's buffer is used again RING blocks later.
        """
        left = [b""]
        for buffer, size in self._filled(offset, BLOCK_BYTES, lambda: left[0]):
            cut = buffer.rfind(self.line_end, 0, size) + 1
            rest = left[0] = bytes(memoryview(buffer)[cut:size])
            if len(rest) > BLOCK_BYTES // 2:
                raise RecordingError(f"{self.path}: holds a line of more than {BLOCK_BYTES >> 11} KB", "is it a table?")
            if cut:
                buffer[cut : cut + AFTER] = self.line_end * AFTER
                yield buffer, cut
        if left[0]:
            yield bytearray(left[0] + self.line_end * AFTER), len(left[0])

    def _filled(self, offset: int, most: int, before: Callable[[], bytes] = bytes) -> Iterator[tuple[bytearray, int]]:
        """The stream from `offset` on in buffers, with how far each is filled; `before` gives what it begins with."""
        if self.recoded:
            for piece in self.chunks():
                kept = piece[offset:]
                offset = max(0, offset - len(piece))
                if kept:
                    kept = before() + kept
                    yield bytearray(kept), len(kept)
            return
        left = self.size - self.mark - offset
        ring = [bytearray(2 * most + AFTER) for _ in range(RING if left > most else 1)]
        with self.path.open("rb", buffering=0) as file:
            file.seek(self.mark + offset)
            for turn in count():
                if left <= 0:
                    return
                buffer, first = ring[turn % len(ring)], before()
                buffer[: len(first)] = first
                place = memoryview(buffer)[len(first) : len(first) + min(most, left)]
                size = file.readinto(place)
                place.release()
                if not size:
                    return
                left -= size
                yield buffer, len(first) + size


def read_sample(path: Path) -> bytes:
    """The first bytes of a file; raises RecordingError."""
    try:
        with path.open("rb") as file:
            return file.read(SAMPLE_BYTES)
    except OSError as fault:
        raise RecordingError(
            f"{path}: cannot be read: {fault.strerror}", "check the path and its permissions"
        ) from fault
