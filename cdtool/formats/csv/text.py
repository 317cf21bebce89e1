"""Read the bytes of a text file (encoding, line ends, NUL bytes at the end) and its lines in blocks.

The bytes of a file that is compressed with gzip are those of the text in it (`gzipped.py`). UTF-16 and UTF-32 are
recoded to UTF-8 in memory; in any other encoding the bytes of a number are ASCII, and nothing is recoded. The result
is called the stream: bytes without a byte order mark.
"""

from __future__ import annotations

import codecs
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path

from cdtool.base.errors import RecordingError
from cdtool.formats.containers.container_checks import check_size
from cdtool.formats.csv.gzipped import MAGIC, is_gzipped, open_text

# The beginning of a file that shows its dialect: hundreds of rows, also below a long head.
SAMPLE_BYTES = 1 << 17
# A file is read in blocks: the memory for it does not grow with the file.
BLOCK_BYTES = 1 << 20
UNIT_BYTES = {"utf-16-le": 2, "utf-16-be": 2, "utf-32-le": 4, "utf-32-be": 4}


@dataclass(frozen=True)
class Text:
    """The encoding of a text file. The byte order mark has `mark` bytes; `padding` NUL bytes start at byte `size`.

    `content` are the bytes of a file that is recoded, or of at most one block, which is read once.
    """

    path: Path
    encoding: str
    mark: int
    size: int
    padding: int
    line_end: bytes
    content: bytes | None = field(default=None, repr=False, compare=False)

    @property
    def stream_encoding(self) -> str:
        """Return the encoding of the stream."""
        return "utf-8" if self.encoding in UNIT_BYTES else self.encoding

    def decode(self, line: bytes) -> str:
        """Return a line of the stream as text."""
        return line.decode(self.stream_encoding, errors="replace")

    def chunks(self, offset: int = 0) -> Iterator[bytes]:
        """Yield the stream from byte `offset` in pieces that may end within a line."""
        left = self.size - self.mark - offset
        with open_text(self.path) if self.content is None else BytesIO(self.content) as file:
            file.seek(self.mark + offset)
            # Four at once: pandas takes as long to start as to read some ten kilobytes.
            while left > 0 and (piece := file.read(min(4 * BLOCK_BYTES, left))):
                left -= len(piece)
                yield piece

    def tail(self) -> list[bytes]:
        """Return the last lines of the stream, including an unfinished last line; the first may be part of a line."""
        start = max(self.mark, self.size - (1 << 16))  # hundreds of lines
        return b"".join(self.chunks(start - self.mark)).split(self.line_end)

    def blocks(self, offset: int) -> Iterator[bytes]:
        """Yield blocks of complete lines after byte `offset` of the stream.

        Only the last line of the last block may be without a line end.
        """
        if self.content is not None and len(self.content) <= BLOCK_BYTES:
            if rows := self.content[self.mark + offset : self.size]:
                yield rows
            return
        rest = b""
        for piece in self.chunks(offset):
            cut = piece.rfind(self.line_end) + 1
            whole = not rest and cut == len(piece)
            block = piece if whole else b"".join((rest, memoryview(piece)[:cut]))
            rest = piece[cut:] if cut else rest + piece
            if len(rest) > BLOCK_BYTES // 2:
                raise RecordingError(f"has a line of more than {BLOCK_BYTES >> 11} KB", "is it a table?")
            if cut:
                yield block
        if rest:
            yield rest


def read_sample(path: Path, most: int = SAMPLE_BYTES) -> bytes:
    """Return the first bytes of a file, in which its dialect is detected; raises RecordingError."""
    with _readable(), open_text(path) as file:
        return file.read(most) or b""


def recoded(path: Path, encoding: str, mark: int, content: bytes | None) -> bytes:
    """Return a text as UTF-8; `content` are its bytes if they have been read. Raises RecordingError."""
    decoder, pieces, size = codecs.getincrementaldecoder(encoding)(), [], 0
    with open_text(path) if content is None else BytesIO(content) as file:
        file.seek(mark)
        try:
            while piece := file.read(BLOCK_BYTES):
                pieces.append(decoder.decode(piece).encode())
                size += len(piece)
                check_size(path, size // 8)
            pieces.append(decoder.decode(b"", final=True).encode())
        except UnicodeError as fault:
            raise RecordingError(
                f"damaged: not valid {encoding.upper()} near byte {mark + size}", "save it again as UTF-8"
            ) from fault
    return b"".join(pieces)


def read_small(path: Path) -> bytes | None:
    """Return the bytes of a file of at most one block; None for a larger file. Raises RecordingError."""
    with _readable():
        with path.open("rb", buffering=0) as file:
            size = os.fstat(file.fileno()).st_size
            content = file.readall() if size <= BLOCK_BYTES else None
        if is_gzipped(path) if content is None else content.startswith(MAGIC):
            content = read_sample(path, BLOCK_BYTES + 1)
    return content if content is None or len(content) <= BLOCK_BYTES else None


@contextmanager
def _readable() -> Iterator[None]:
    """Raise RecordingError if the file cannot be read."""
    try:
        yield
    except OSError as fault:
        raise RecordingError(f"cannot be read: {fault.strerror}", "check the path and its permissions") from fault
