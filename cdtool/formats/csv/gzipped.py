"""Open text files for reading; one that is compressed with gzip is decompressed while it is read, never as a whole.

The first bytes decide, not the name. The decompression by ISA-L needs about a third of the time of Python's own. Its
checksums are compared at the end of each member, and any damage is a RecordingError in one line.
"""

from __future__ import annotations

import gzip
import zlib
from collections.abc import Callable
from gzip import BadGzipFile
from importlib import import_module
from io import RawIOBase
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, TypeVar, cast

from cdtool.errors import RecordingError
from cdtool.formats.container_checks import check_size

if TYPE_CHECKING:
    from _typeshed import WriteableBuffer

MAGIC = b"\x1f\x8b"
_PIECE = 1 << 20
T = TypeVar("T")


def open_text(path: Path) -> RawIOBase:
    """Return an open text file without a buffer of its own, decompressed if necessary; raises OSError."""
    file = path.open("rb", buffering=0)
    head = file.read(len(MAGIC))
    file.seek(0)
    return _Decompressed(path, file) if head == MAGIC else cast(RawIOBase, file)


def is_gzipped(path: Path) -> bool:
    """Return whether a file begins as one that is compressed with gzip; raises OSError."""
    with path.open("rb", buffering=0) as file:
        return file.read(len(MAGIC)) == MAGIC


def measure(path: Path, most: int) -> tuple[int, int, bytes]:
    """Return the decompressed size of a file, its size without NUL bytes at the end, and its last `most` bytes or more.

    Raises RecordingError if the file is damaged, or decompresses to far more than a log of its size can contain.
    """
    total = end = 0
    last, before = b"", b""
    with open_text(path) as file:
        while piece := file.read(_PIECE):
            total += len(piece)
            check_size(path, total // 8)
            content = len(piece.rstrip(b"\0"))
            end = total - len(piece) + content if content else end
            before, last = (last, piece) if len(last) >= most else (b"", before + last + piece)
    return total, end, before + last


class _Decompressed(RawIOBase):
    """The decompressed content of an open file, as a raw file that reads and seeks; RecordingError if damaged."""

    def __init__(self, path: Path, file: IO[bytes]) -> None:
        self._path, self._file = path, file
        reader: Any
        try:
            reader, error = import_module("isal.igzip").IGzipFile, import_module("isal.isal_zlib").error
        except ImportError:  # a platform without a wheel
            reader, error = gzip.GzipFile, zlib.error
        self._reader, self._error = reader(fileobj=file, mode="rb"), error

    def readable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True

    def readinto(self, buffer: WriteableBuffer, /) -> int:
        """Read bytes until the buffer is full or the content ends, and return how many."""
        return self._checked(lambda: int(self._reader.readinto(buffer)))

    def readall(self) -> bytes:
        """Return all bytes that are left."""
        return self._checked(lambda: bytes(self._reader.read()))

    def seek(self, offset: int, whence: int = 0, /) -> int:
        """Go to a byte of the content, from its beginning; backward, the file is decompressed again from there."""
        return self._checked(lambda: int(self._reader.seek(offset, whence)))

    def close(self) -> None:
        """Close the file."""
        self._reader.close()
        self._file.close()
        super().close()

    def _checked(self, read: Callable[[], T]) -> T:
        damages = (BadGzipFile, zlib.error, self._error)
        hint = "copy it again from its source; gzip -dc writes what can still be read"
        try:
            return read()
        except EOFError as fault:
            raise RecordingError(f"{self._path}: truncated: its gzip data have no end", hint) from fault
        except damages as fault:
            raise RecordingError(f"{self._path}: damaged: its gzip data: {fault}", hint) from fault
