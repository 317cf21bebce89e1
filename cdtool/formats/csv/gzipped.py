"""Open text files for reading; one that is compressed with gzip is decompressed while it is read, never as a whole.

The first bytes decide, not the name. The decompression by ISA-L needs about a third of the time of Python's own. Its
checksums are compared at the end of each member, and any damage is a RecordingError in one line.
"""

from __future__ import annotations

import gzip
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from gzip import BadGzipFile
from importlib import import_module
from pathlib import Path
from typing import IO, Any, cast

from cdtool.base.errors import RecordingError
from cdtool.base.files.bounded_loading import MIB
from cdtool.formats.containers.container_checks import check_size

MAGIC = b"\x1f\x8b"


@contextmanager
def open_text(path: Path) -> Iterator[IO[bytes]]:
    """Open a text file without a buffer of its own, decompressed if necessary; raises OSError, RecordingError."""
    with path.open("rb", buffering=0) as file:
        head = file.read(len(MAGIC))
        file.seek(0)
        if head != MAGIC:
            yield cast(IO[bytes], file)
            return
        unpack, error = _unpacking()
        hint = "copy it again from its source; gzip -dc writes what can still be read"
        try:
            with unpack(fileobj=file, mode="rb") as unpacked:
                yield unpacked
        except EOFError as fault:
            raise RecordingError("truncated: its gzip data have no end, or a few bytes follow it", hint) from fault
        except (BadGzipFile, zlib.error, error) as fault:
            raise RecordingError(f"damaged: its gzip data: {fault}", hint) from fault


def _unpacking() -> tuple[Any, type[Exception]]:
    """Return the class that decompresses, and its error."""
    try:
        return import_module("isal.igzip").IGzipFile, import_module("isal.isal_zlib").error
    except ImportError:  # a platform without a wheel
        return gzip.GzipFile, zlib.error


def is_gzipped(path: Path) -> bool:
    """Return whether a file begins as one that is compressed with gzip; raises OSError."""
    with path.open("rb", buffering=0) as file:
        return file.read(len(MAGIC)) == MAGIC


def measure(path: Path) -> tuple[int, int]:
    """Return the decompressed size of a file, and its size without NUL bytes at the end.

    Raises RecordingError if the file is damaged, or decompresses to far more than a log of its size can contain.
    """
    total = end = 0
    with open_text(path) as file:
        while piece := file.read(MIB):
            content = len(piece.rstrip(b"\0"))
            end = total + content if content else end
            total += len(piece)
            check_size(path, total // 8)
    return total, end
